// A range image and its noise as Python hands them over: once, for every kernel to use.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <variant>

#include "base/parallel.hpp"
#include "image/frame.hpp"
#include "python/arrays.hpp"

namespace rangeedge::python {

// The coefficients of the waves, and what FitNoise takes along rows and along columns.
using FitsArray = std::array<double, 4 + 2 * FitNoise::size>;

// They keep the arrays alive to which their kernels' side points.
struct BoundNoise {
    BoundNoise(double a, double b, double c, const FitsArray& fits, Image<float> deviations) : map(deviations) {
        noise.single = {a, b, c, 0};
        noise.waves = {fits[0], fits[1], fits[2], fits[3]};
        noise.rows = FitNoise(&fits[4]);
        noise.cols = FitNoise(&fits[4 + FitNoise::size]);
        double diagonals[FitNoise::size];  // between those along rows and those along columns
        for (std::size_t i = 0; i < FitNoise::size; ++i)
            diagonals[i] = std::sqrt(fits[4 + i] * fits[4 + FitNoise::size + i]);
        noise.diagonals = FitNoise(diagonals);
        noise.map = deviations.data();
    }

    Image<float> map;
    Noise noise;
};

struct BoundFrame {
    using Samples = nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu>;

    template <class T>
    BoundFrame(nb::ndarray<const T, nb::c_contig, nb::device::cpu> values, bool projective,
               const std::array<double, 6>& to_plane, const std::array<double, 3>& axis, bool curved, bool ranges,
               const BoundNoise& noise)
        : samples(values), map(noise.map) {
        const bool points = values.ndim() == 3;
        Frame<T> own{};
        own.rows = rows(values);
        own.cols = cols(values);
        own.ordinate = points ? nullptr : values.data();
        own.points = points ? values.data() : nullptr;
        own.projective = projective;
        std::copy(to_plane.begin(), to_plane.end(), own.to_plane);
        std::copy(axis.begin(), axis.end(), own.axis);
        own.curved = curved;
        own.ranges = ranges;
        own.noise = noise.noise;
        frame = own;
    }

    Samples samples;
    Image<float> map;
    std::variant<Frame<float>, Frame<double>> frame;
};

// Threads for kernels that detect edges: no more than are worth starting for an image of that size.
inline Team team_for(const BoundFrame& bound, int threads) {
    constexpr std::int64_t pixels_per_thread = 1 << 15;
    const std::int64_t pixels =
        std::visit([](const auto& frame) { return std::int64_t{frame.rows} * frame.cols; }, bound.frame);
    return Team(static_cast<int>(std::min<std::int64_t>(threads, 1 + pixels / pixels_per_thread)));
}

}  // namespace rangeedge::python
