// Range images: Frame, Noise, and what makes and measures them.
// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/array.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "image/pixels.hpp"
#include "image/ranks.hpp"
#include "noise/estimate.hpp"
#include "python/frame.hpp"

namespace rangeedge::python {
namespace {

template <class T, class Real>
void bind_inverse(nb::module_& m) {
    m.def(
        "invert_depth",
        [](const Image<T>& depth, Real factor, const Image<std::uint8_t>& mask, const OutImage<Real>& inverse) {
            invert_depth(depth.data(), depth.size(), factor, mask.data(), inverse.data());
        },
        array("depth"), "factor"_a, optional_array("mask"), array("inverse"), Unlocked());
}

// The coefficients of sigma, those of the waves, and what FitNoise takes along rows and along columns.
template <class T>
void bind_estimate(nb::module_& m) {
    m.def(
        "estimate_noise",
        [](const Image<T>& ordinate, bool projective, double step, int threads) {
            const NoiseEstimate e =
                estimate_noise(ordinate.data(), rows(ordinate), cols(ordinate), projective, step, threads);
            std::array<double, 4 + FitsArray().size()> numbers;
            auto next = numbers.begin();
            for (const Deviation& d : {e.single, e.fits.waves}) next = std::copy_n(&d.c0, 4, next);
            next = std::copy_n(e.fits.rows, FitNoise::size, next);
            std::copy_n(e.fits.cols, FitNoise::size, next);
            return numbers;
        },
        array("ordinate"), "projective"_a, "step"_a, "threads"_a, Unlocked());
}

// For every share the values of the ranks below and above it, of which the first is of rank floor(share (n - 1)), n
// being how many values are no NaN, which is returned.
template <class T>
void bind_ranks(nb::module_& m) {
    m.def(
        "ranked",
        [](const Values<T>& values, const Values<double>& shares, const OutImage<T>& found) {
            const auto size = static_cast<std::int64_t>(values.size());
            const std::int64_t numbers = count_numbers(values.data(), size);
            if (numbers == 0) return numbers;
            std::vector<std::int64_t> ranks;
            for (std::size_t i = 0; i < shares.size(); ++i) {
                const double place = shares.data()[i] * static_cast<double>(numbers - 1);
                ranks.push_back(static_cast<std::int64_t>(std::floor(place)));
                ranks.push_back(static_cast<std::int64_t>(std::ceil(place)));
            }
            const std::vector<T> all = values_of_ranks(values.data(), size, ranks);
            std::copy(all.begin(), all.end(), found.data());
            return numbers;
        },
        array("values"), array("shares"), array("found"), Unlocked());
}

template <class T>
using FrameInit = nb::init<nb::ndarray<const T, nb::c_contig, nb::device::cpu>, bool, const std::array<double, 6>&,
                           const std::array<double, 3>&, bool, bool, const BoundNoise&>;

}  // namespace

void bind_image(nb::module_& m) {
    nb::class_<BoundNoise>(m, "Noise", "Standard deviation a + b z + c z^2 of a length z, or that of every pixel.")
        .def(nb::init<double, double, double, const FitsArray&, Image<float>>(), "a"_a, "b"_a, "c"_a, "fits"_a,
             optional_array("map") = nb::none());
    nb::class_<BoundFrame>(m, "Frame", "A range image: ordinates (H, W) or points (H, W, 3), NaN without data.")
        .def(FrameInit<float>(), array("samples"), "projective"_a, "to_plane"_a, "axis"_a, "curved"_a, "ranges"_a,
             "noise"_a)
        .def(FrameInit<double>(), array("samples"), "projective"_a, "to_plane"_a, "axis"_a, "curved"_a, "ranges"_a,
             "noise"_a);
    bind_inverse<float, float>(m);
    bind_inverse<double, double>(m);
    bind_inverse<std::uint16_t, float>(m);
    bind_estimate<float>(m);
    bind_estimate<double>(m);
    bind_ranks<float>(m);
    bind_ranks<double>(m);
}

}  // namespace rangeedge::python
