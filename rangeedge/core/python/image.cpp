// Range images: Frame, Noise, and what makes and measures them.
// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/array.h>

#include "image/pixels.hpp"
#include "noise/statistics.hpp"
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

using Numbers = nb::ndarray<nb::numpy, double, nb::ndim<1>>;

template <class T>
void bind_statistics(nb::module_& m) {
    m.def(
        "noise_statistics",
        [](const Image<T>& ordinate,
           int threads) -> nb::typed<nb::tuple, double, double, double, double, Numbers, Numbers> {
            NoiseStatistics found;
            {
                nb::gil_scoped_release release;
                found = noise_statistics(ordinate.data(), rows(ordinate), cols(ordinate), threads);
            }
            return nb::make_tuple(found.near, found.far, found.lowest, found.highest,
                                  handed_over<double>(std::move(found.ordinates)),
                                  handed_over<double>(std::move(found.deviations)));
        },
        array("ordinate"), "threads"_a);
}

template <class T>
using FrameInit = nb::init<nb::ndarray<const T, nb::c_contig, nb::device::cpu>, bool, const std::array<double, 6>&,
                           const std::array<double, 3>&, const BoundNoise&>;

}  // namespace

void bind_image(nb::module_& m) {
    nb::class_<BoundNoise>(m, "Noise", "Standard deviation a + b z + c z^2 of a length z, or that of every pixel.")
        .def(nb::init<double, double, double, double, Image<float>>(), "a"_a, "b"_a, "c"_a, "correlation"_a,
             optional_array("map") = nb::none())
        .def_prop_ro("correlation", [](const BoundNoise& n) { return n.noise.correlation; });
    nb::class_<BoundFrame>(m, "Frame", "A range image: ordinates (H, W) or points (H, W, 3), NaN without data.")
        .def(FrameInit<float>(), array("samples"), "projective"_a, "to_plane"_a, "axis"_a, "noise"_a)
        .def(FrameInit<double>(), array("samples"), "projective"_a, "to_plane"_a, "axis"_a, "noise"_a);
    bind_inverse<float, float>(m);
    bind_inverse<double, double>(m);
    bind_inverse<std::uint16_t, float>(m);
    bind_statistics<float>(m);
    bind_statistics<double>(m);
}

}  // namespace rangeedge::python
