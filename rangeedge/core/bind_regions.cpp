// SPDX-License-Identifier: Apache-2.0
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>

#include "seeds.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

template <class T>
using Map = nb::ndarray<T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

int extract_seeds(const Map<const float>& distance, const Map<const std::uint8_t>& mask, float min_distance,
                  float separation, const Map<std::int32_t>& markers) {
    return rangeedge::extract_seeds(distance.data(), mask.data(), static_cast<int>(distance.shape(0)),
                                    static_cast<int>(distance.shape(1)), min_distance, separation, markers.data());
}

}  // namespace

// Outputs are written in place; masks may be None. Shapes are the caller's to check.
void bind_regions(nb::module_& m) {
    m.def("extract_seeds", &extract_seeds, "distance"_a.noconvert(), "mask"_a.noconvert().none(), "min_distance"_a,
          "separation"_a, "markers"_a.noconvert(), nb::call_guard<nb::gil_scoped_release>());
}
