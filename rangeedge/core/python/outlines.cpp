// Outlines of regions, and the surfaces that they lie on.
// SPDX-License-Identifier: Apache-2.0
#include "regions/outlines.hpp"
#include "regions/crossings.hpp"

#include <nanobind/stl/tuple.h>

#include <cstdint>
#include <tuple>
#include <vector>

#include "cleaning/surfaces.hpp"
#include "python/arrays.hpp"

namespace rangeedge::python {
namespace {

using Rows = nb::ndarray<nb::numpy, std::int32_t, nb::ndim<2>>;
using Numbers = nb::ndarray<nb::numpy, std::int32_t, nb::ndim<1>>;

std::tuple<Rows, Rows, Numbers, Rows, Numbers> bound_trace_outlines(const Image<std::int32_t>& labels) {
    Outlines found;
    {
        const Unlock unlock;
        found = trace_outlines(labels.data(), rows(labels), cols(labels));
    }
    std::vector<std::array<std::int32_t, 3>> rings;  // the area is known from the corners
    rings.reserve(found.rings.size());
    for (const Outlines::Ring& ring : found.rings) rings.push_back({ring.first, ring.count, ring.region});
    return {handed_over<std::int32_t>(std::move(found.corners)), handed_over<std::int32_t>(std::move(found.arcs)),
            handed_over<std::int32_t>(std::move(found.steps)), handed_over<std::int32_t>(std::move(rings)),
            handed_over<std::int32_t>(std::move(found.labels))};
}

void bound_simplify_lines(const Image<double>& points, const Values<std::int32_t>& counts,
                          const Values<double>& tolerances, const OutValues<std::uint8_t>& kept) {
    std::vector<Polyline> lines;
    std::int64_t first = 0;
    for (std::size_t i = 0; i < counts.shape(0); ++i) {
        lines.push_back({first, counts.data()[i], tolerances.data()[i]});
        first += counts.data()[i];
    }
    simplify_lines(points.data(), lines, kept.data());
}

// 1 at every point of lines from which a segment leads to the next that crosses another.
void bound_find_crossings(const Image<double>& points, const Values<std::int32_t>& counts,
                          const OutValues<std::uint8_t>& crossing) {
    std::vector<PlaneSegment> segments;
    std::vector<std::int64_t> starts;
    std::int64_t first = 0;
    for (std::size_t i = 0; i < counts.shape(0); first += counts.data()[i++])
        for (std::int64_t k = first; k + 1 < first + counts.data()[i]; ++k) {
            const double *const from = points.data() + 2 * k, *const to = from + 2;
            segments.push_back({{from[0], from[1]}, {to[0], to[1]}});
            starts.push_back(k);
        }
    const std::vector<std::uint8_t> found = find_crossings(segments);
    for (std::size_t i = 0; i < starts.size(); ++i) crossing.data()[starts[i]] = found[i];
}

// For every label the origin (x0, y0), the six coefficients, the rms, and whether it is curved.
void bound_fit_surfaces(const Image<float>& ordinate, const Image<float>& x, const Image<float>& y,
                        const Image<std::int32_t>& labels, const OutImage<double>& surfaces) {
    const OrdinateMap map{rows(ordinate), cols(ordinate), x.data(), y.data(), ordinate.data()};
    double* out = surfaces.data();
    for (const Surface& s : fit_surfaces(map, labels.data(), rows(surfaces))) {
        *out++ = s.x0, *out++ = s.y0;
        for (const double c : s.c) *out++ = c;
        *out++ = s.rms, *out++ = s.curved ? 1 : 0;
    }
}

}  // namespace

void bind_outlines(nb::module_& m) {
    m.def("trace_outlines", &bound_trace_outlines, array("labels"));
    m.def("simplify_lines", &bound_simplify_lines, array("points"), array("counts"), array("tolerances"), array("kept"),
          Unlocked());
    m.def("find_crossings", &bound_find_crossings, array("points"), array("counts"), array("crossing"), Unlocked());
    m.def("fit_surfaces", &bound_fit_surfaces, array("ordinate"), optional_array("x"), optional_array("y"),
          array("labels"), array("surfaces"), Unlocked());
}

}  // namespace rangeedge::python
