// Seeds, regions and closed contours.
// SPDX-License-Identifier: Apache-2.0
#include "regions/regions.hpp"

#include <nanobind/stl/array.h>

#include <array>
#include <cstdint>

#include "python/frame.hpp"
#include "regions/closure.hpp"
#include "regions/seeds.hpp"

namespace rangeedge::python {
namespace {

// The maps on which surfaces are fitted, of a frame whose geometry and noise they share.
struct BoundMap {
    BoundMap(const BoundFrame& bound, Image<float> x, Image<float> y, Image<float> ordinate, double offset,
             const std::array<double, 6>& to_plane, Image<std::uint8_t> edge_map)
        : arrays{x, y, ordinate, bound.map}, edges(edge_map) {
        std::visit(
            [&](const auto& frame) {
                map = {frame.rows, frame.cols,       x.data(), y.data(),    ordinate.data(),
                       offset,     frame.projective, to_plane, frame.noise, edge_map.data()};
            },
            bound.frame);
    }

    Image<float> arrays[4];
    Image<std::uint8_t> edges;
    RangeMap map;
};

int bound_extract_seeds(const Image<float>& distance, const Image<std::uint8_t>& mask, float min_distance,
                        float separation, const OutImage<std::int32_t>& markers) {
    return extract_seeds(distance.data(), mask.data(), rows(distance), cols(distance), min_distance, separation,
                         markers.data());
}

int bound_grow_regions(const BoundMap& map, const Image<std::int32_t>& markers, const RegionParameters& options,
                       const OutImage<std::int32_t>& labels) {
    return grow_regions(map.map, markers.data(), options, labels.data());
}

void bound_verified_regions(const BoundMap& map, const ClosureParameters& options,
                            const OutImage<std::int32_t>& regions) {
    verified_regions(map.map, options, regions.data());
}

}  // namespace

void bind_regions(nb::module_& m) {
    nb::class_<BoundMap>(m, "RangeMap", "Maps on which surfaces are fitted: places, ordinates less an offset, edges.")
        .def(nb::init<const BoundFrame&, Image<float>, Image<float>, Image<float>, double, const std::array<double, 6>&,
                      Image<std::uint8_t>>(),
             "frame"_a, optional_array("x"), optional_array("y"), array("ordinate"), "offset"_a, "to_plane"_a,
             optional_array("edges"));
    using R = RegionParameters;
    bind_options(m, "RegionOptions", field("tolerance", &R::tolerance), field("smooth_angle", &R::smooth_angle),
                 field("min_area", &R::min_area), field("new_seeds", &R::new_seeds));
    using C = ClosureParameters;
    bind_options(m, "ClosureOptions", field("correlation", &C::correlation), field("tolerance", &C::tolerance),
                 field("share", &C::share), field("dilations", &C::dilations), field("min_area", &C::min_area));
    m.def("extract_seeds", &bound_extract_seeds, array("distance"), optional_array("mask"), "min_distance"_a,
          "separation"_a, array("markers"), Unlocked());
    m.def("grow_regions", &bound_grow_regions, "map"_a, array("markers"), "options"_a, array("labels"), Unlocked());
    m.def("verified_regions", &bound_verified_regions, "map"_a, "options"_a, array("regions"), Unlocked());
}

}  // namespace rangeedge::python
