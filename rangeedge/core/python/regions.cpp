// Seeds, regions and closed contours.
// SPDX-License-Identifier: Apache-2.0
#include "regions/regions.hpp"

#include <nanobind/stl/array.h>

#include <array>
#include <cstdint>

#include "python/frame.hpp"
#include "regions/closure.hpp"
#include "regions/description.hpp"
#include "regions/seeds.hpp"

namespace rangeedge::python {
namespace {

using Points = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

// The maps on which surfaces are fitted, of a frame whose geometry and noise they share.
struct BoundMap {
    BoundMap(const BoundFrame& bound, Image<float> x, Image<float> y, Image<float> ordinate, double offset,
             double rounding, const std::array<double, 6>& to_plane, Image<std::uint8_t> edge_map)
        : arrays{x, y, ordinate, bound.map}, edges(edge_map) {
        std::visit(
            [&](const auto& frame) {
                map = {frame.rows, frame.cols,       x.data(), y.data(),    ordinate.data(), offset,
                       rounding,   frame.projective, to_plane, frame.noise, edge_map.data()};
            },
            bound.frame);
    }

    Image<float> arrays[4];
    Image<std::uint8_t> edges;
    RangeMap map;
};

int bound_extract_seeds(const Image<float>& distance, const Image<std::uint8_t>& mask, bool wrap, float min_distance,
                        float separation, int threads, const OutImage<std::int32_t>& markers) {
    return extract_seeds(distance.data(), mask.data(), rows(distance), cols(distance), wrap, min_distance, separation,
                         threads, markers.data());
}

int bound_grow_regions(const BoundMap& map, const Image<std::int32_t>& markers, const RegionParameters& options,
                       int threads, const OutImage<std::int32_t>& labels) {
    return grow_regions(map.map, markers.data(), options, threads, labels.data());
}

void bound_close_contours(const BoundMap& map, const Image<std::int32_t>& regions, const ClosureParameters& options,
                          int threads, const OutImage<std::uint8_t>& lines) {
    close_contours(map.map, regions.data(), options, threads, lines.data());
}

template <class A>
LabelImage label_image(const Image<std::int32_t>& labels, const A& of_labels) {
    return {labels.data(), rows(labels), cols(labels), rows(of_labels)};
}

void bound_label_statistics(const Image<std::int32_t>& labels, int threads, const OutImage<std::int32_t>& boxes,
                            const OutImage<double>& centroids) {
    label_statistics(label_image(labels, boxes), threads, boxes.data(), centroids.data());
}

void bound_region_moments(const Image<std::int32_t>& labels, const Points& points, const Image<double>& ordinate,
                          int threads, const OutImage<double>& origins, const OutValues<double>& scales,
                          const OutImage<double>& moments, const OutValues<std::uint8_t>& curved) {
    region_moments(label_image(labels, scales), points.data(), ordinate.data(), threads, origins.data(), scales.data(),
                   moments.data(), curved.data());
}

void bound_quadric_misfits(const Image<std::int32_t>& labels, const Points& points, int threads,
                           const Image<double>& origins, const Values<double>& scales, const Image<double>& quadrics,
                           const Values<double>& floors, const OutValues<double>& misfits) {
    quadric_misfits(label_image(labels, scales), points.data(), threads, origins.data(), scales.data(), quadrics.data(),
                    floors.data(), misfits.data());
}

}  // namespace

void bind_regions(nb::module_& m) {
    nb::class_<BoundMap>(m, "RangeMap", "Maps on which surfaces are fitted: places, ordinates less an offset, edges.")
        .def(nb::init<const BoundFrame&, Image<float>, Image<float>, Image<float>, double, double,
                      const std::array<double, 6>&, Image<std::uint8_t>>(),
             "frame"_a, optional_array("x"), optional_array("y"), array("ordinate"), "offset"_a, "rounding"_a,
             "to_plane"_a, optional_array("edges"));
    using R = RegionParameters;
    bind_options(m, "RegionOptions", field("tolerance", &R::tolerance), field("smooth_angle", &R::smooth_angle),
                 field("min_area", &R::min_area), field("new_seeds", &R::new_seeds));
    using C = ClosureParameters;
    bind_options(m, "ClosureOptions", field("correlation", &C::correlation), field("tolerance", &C::tolerance),
                 field("share", &C::share), field("max_gap", &C::max_gap), field("min_area", &C::min_area));
    m.def("extract_seeds", &bound_extract_seeds, array("distance"), optional_array("mask"), "wrap"_a, "min_distance"_a,
          "separation"_a, "threads"_a, array("markers"), Unlocked());
    m.def("grow_regions", &bound_grow_regions, "map"_a, array("markers"), "options"_a, "threads"_a, array("labels"),
          Unlocked());
    m.def("close_contours", &bound_close_contours, "map"_a, array("regions"), "options"_a, "threads"_a, array("lines"),
          Unlocked());
    m.def("label_statistics", &bound_label_statistics, array("labels"), "threads"_a, array("boxes"), array("centroids"),
          Unlocked());
    m.def("region_moments", &bound_region_moments, array("labels"), array("points"), array("ordinate"), "threads"_a,
          array("origins"), array("scales"), array("moments"), array("curved"), Unlocked());
    m.def("quadric_misfits", &bound_quadric_misfits, array("labels"), array("points"), "threads"_a, array("origins"),
          array("scales"), array("quadrics"), array("floors"), array("misfits"), Unlocked());
}

}  // namespace rangeedge::python
