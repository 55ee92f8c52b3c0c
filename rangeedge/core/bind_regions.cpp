// SPDX-License-Identifier: Apache-2.0
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>

#include <array>
#include <cstdint>

#include "regions/closure.hpp"
#include "regions/description.hpp"
#include "regions/regions.hpp"
#include "regions/seeds.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

template <class T>
using Map = nb::ndarray<T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Optional = Map<const float>;
template <class T>
using Stack = nb::ndarray<T, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
template <class T>
using List = nb::ndarray<T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

int extract_seeds(const Map<const float>& distance, const Map<const std::uint8_t>& mask, float min_distance,
                  float separation, int threads, const Map<std::int32_t>& markers) {
    return rangeedge::extract_seeds(distance.data(), mask.data(), static_cast<int>(distance.shape(0)),
                                    static_cast<int>(distance.shape(1)), min_distance, separation, threads,
                                    markers.data());
}

rangeedge::RangeMap range_map(const Optional& x, const Optional& y, const Map<const float>& ordinate, double offset,
                              double rounding, bool projective, const std::array<double, 6>& to_plane,
                              const std::array<double, 3>& noise, const Optional& noise_map,
                              const Map<const std::uint8_t>& edges) {
    return {static_cast<int>(ordinate.shape(0)),
            static_cast<int>(ordinate.shape(1)),
            x.data(),
            y.data(),
            ordinate.data(),
            offset,
            rounding,
            projective,
            to_plane,
            noise,
            noise_map.data(),
            edges.data()};
}

int grow_regions(const Optional& x, const Optional& y, const Map<const float>& ordinate, double offset, double rounding,
                 bool projective, const std::array<double, 6>& to_plane, const std::array<double, 3>& noise,
                 const Optional& noise_map, const Map<const std::uint8_t>& edges,
                 const Map<const std::int32_t>& markers, const rangeedge::RegionParameters& parameters, int threads,
                 const Map<std::int32_t>& labels) {
    const auto map = range_map(x, y, ordinate, offset, rounding, projective, to_plane, noise, noise_map, edges);
    return rangeedge::grow_regions(map, markers.data(), parameters, threads, labels.data());
}

void verified_regions(const Optional& x, const Optional& y, const Map<const float>& ordinate, double offset,
                      double rounding, bool projective, const std::array<double, 6>& to_plane,
                      const std::array<double, 3>& noise, const Optional& noise_map,
                      const Map<const std::uint8_t>& edges, double correlation, double tolerance, double share,
                      int dilations, int min_area, int threads, const Map<std::int32_t>& regions) {
    const auto map = range_map(x, y, ordinate, offset, rounding, projective, to_plane, noise, noise_map, edges);
    rangeedge::verified_regions(map, {correlation, tolerance, share, dilations, min_area}, threads, regions.data());
}

rangeedge::LabelImage label_image(const Map<const std::int32_t>& labels, std::size_t count) {
    return {labels.data(), static_cast<int>(labels.shape(0)), static_cast<int>(labels.shape(1)),
            static_cast<int>(count)};
}

void label_statistics(const Map<const std::int32_t>& labels, int threads, const Map<std::int32_t>& boxes,
                      const Map<double>& centroids) {
    rangeedge::label_statistics(label_image(labels, boxes.shape(0)), threads, boxes.data(), centroids.data());
}

void region_moments(const Map<const std::int32_t>& labels, const Stack<const double>& points,
                    const Map<const double>& ordinate, int threads, const Map<double>& origins,
                    const List<double>& scales, const Map<double>& moments, const List<std::uint8_t>& curved) {
    rangeedge::region_moments(label_image(labels, scales.shape(0)), points.data(), ordinate.data(), threads,
                              origins.data(), scales.data(), moments.data(), curved.data());
}

void quadric_misfits(const Map<const std::int32_t>& labels, const Stack<const double>& points, int threads,
                     const Map<const double>& origins, const List<const double>& scales,
                     const Map<const double>& quadrics, const List<const double>& floors, const List<double>& misfits) {
    rangeedge::quadric_misfits(label_image(labels, scales.shape(0)), points.data(), threads, origins.data(),
                               scales.data(), quadrics.data(), floors.data(), misfits.data());
}

}  // namespace

// Outputs are written in place; masks may be None. Shapes are the caller's to check.
void bind_regions(nb::module_& m) {
    m.def("extract_seeds", &extract_seeds, "distance"_a.noconvert(), "mask"_a.noconvert().none(), "min_distance"_a,
          "separation"_a, "threads"_a, "markers"_a.noconvert(), nb::call_guard<nb::gil_scoped_release>());
    using rangeedge::RegionParameters;
    nb::class_<RegionParameters>(m, "RegionParameters")
        .def(
            "__init__",
            [](RegionParameters* self, double tolerance, double smooth_angle, int min_area, bool new_seeds) {
                new (self) RegionParameters{tolerance, smooth_angle, min_area, new_seeds};
            },
            nb::kw_only(), "tolerance"_a, "smooth_angle"_a, "min_area"_a, "new_seeds"_a);
    m.def("grow_regions", &grow_regions, "x"_a.noconvert().none(), "y"_a.noconvert().none(), "ordinate"_a.noconvert(),
          "offset"_a, "rounding"_a, "projective"_a, "to_plane"_a, "noise"_a, "noise_map"_a.noconvert().none(),
          "edges"_a.noconvert().none(), "markers"_a.noconvert(), "parameters"_a, "threads"_a, "labels"_a.noconvert(),
          nb::call_guard<nb::gil_scoped_release>());
    m.def("verified_regions", &verified_regions, "x"_a.noconvert().none(), "y"_a.noconvert().none(),
          "ordinate"_a.noconvert(), "offset"_a, "rounding"_a, "projective"_a, "to_plane"_a, "noise"_a,
          "noise_map"_a.noconvert().none(), "edges"_a.noconvert().none(), "correlation"_a, "tolerance"_a, "share"_a,
          "dilations"_a, "min_area"_a, "threads"_a, "regions"_a.noconvert(), nb::call_guard<nb::gil_scoped_release>());
    m.def("label_statistics", &label_statistics, "labels"_a.noconvert(), "threads"_a, "boxes"_a.noconvert(),
          "centroids"_a.noconvert(), nb::call_guard<nb::gil_scoped_release>());
    m.def("region_moments", &region_moments, "labels"_a.noconvert(), "points"_a.noconvert(), "ordinate"_a.noconvert(),
          "threads"_a, "origins"_a.noconvert(), "scales"_a.noconvert(), "moments"_a.noconvert(), "curved"_a.noconvert(),
          nb::call_guard<nb::gil_scoped_release>());
    m.def("quadric_misfits", &quadric_misfits, "labels"_a.noconvert(), "points"_a.noconvert(), "threads"_a,
          "origins"_a.noconvert(), "scales"_a.noconvert(), "quadrics"_a.noconvert(), "floors"_a.noconvert(),
          "misfits"_a.noconvert(), nb::call_guard<nb::gil_scoped_release>());
}
