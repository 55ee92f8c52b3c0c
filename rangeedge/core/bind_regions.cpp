// SPDX-License-Identifier: Apache-2.0
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>

#include <array>
#include <cstdint>

#include "regions.hpp"
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

int grow_regions(const Map<const float>& x, const Map<const float>& y, const Map<const float>& ordinate,
                 const Map<const float>& sigma, const Map<const std::uint8_t>& edges,
                 const Map<const std::int32_t>& markers, bool projective, double offset, double unit,
                 const std::array<double, 6>& to_plane, const rangeedge::RegionParameters& parameters,
                 const Map<std::int32_t>& labels) {
    const rangeedge::RegionImage image{static_cast<int>(ordinate.shape(0)), static_cast<int>(ordinate.shape(1)),
                                       x.data(), y.data(), ordinate.data(), sigma.data(), edges.data(),
                                       projective, offset, unit, to_plane};
    return rangeedge::grow_regions(image, markers.data(), parameters, labels.data());
}

}  // namespace

// Outputs are written in place; masks may be None. Shapes are the caller's to check.
void bind_regions(nb::module_& m) {
    m.def("extract_seeds", &extract_seeds, "distance"_a.noconvert(), "mask"_a.noconvert().none(), "min_distance"_a,
          "separation"_a, "markers"_a.noconvert(), nb::call_guard<nb::gil_scoped_release>());
    using rangeedge::RegionParameters;
    nb::class_<RegionParameters>(m, "RegionParameters")
        .def(
            "__init__",
            [](RegionParameters* self, double tolerance, double lateral, double smooth_angle, int min_area, bool new_seeds) {
                new (self) RegionParameters{tolerance, lateral, smooth_angle, min_area, new_seeds};
            },
            nb::kw_only(), "tolerance"_a, "lateral"_a, "smooth_angle"_a, "min_area"_a, "new_seeds"_a);
    m.def("grow_regions", &grow_regions, "x"_a.noconvert(), "y"_a.noconvert(), "ordinate"_a.noconvert(),
          "sigma"_a.noconvert(), "edges"_a.noconvert().none(), "markers"_a.noconvert(), "projective"_a, "offset"_a,
          "unit"_a, "to_plane"_a, "parameters"_a, "labels"_a.noconvert(), nb::call_guard<nb::gil_scoped_release>());
}
