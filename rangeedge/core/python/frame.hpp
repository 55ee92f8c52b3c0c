// A range image and its noise as Python hands them over: once, for every kernel to use.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <array>
#include <variant>

#include "image/frame.hpp"
#include "python/arrays.hpp"

namespace rangeedge::python {

// They keep the arrays alive to which their kernels' side points.
struct BoundNoise {
    BoundNoise(double a, double b, double c, double correlation, Image<float> deviations)
        : map(deviations), noise{a, b, c, correlation, deviations.data()} {}

    Image<float> map;
    Noise noise;
};

struct BoundFrame {
    using Samples = nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu>;

    template <class T>
    BoundFrame(nb::ndarray<const T, nb::c_contig, nb::device::cpu> values, bool projective,
               const std::array<double, 6>& to_plane, const std::array<double, 3>& axis, const BoundNoise& noise)
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
        own.noise = noise.noise;
        frame = own;
    }

    Samples samples;
    Image<float> map;
    std::variant<Frame<float>, Frame<double>> frame;
};

}  // namespace rangeedge::python
