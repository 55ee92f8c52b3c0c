// Depths without holes and with less noise.
// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <vector>

#include "cleaning/holes.hpp"
#include "cleaning/smooth.hpp"
#include "edges/detect.hpp"
#include "image/pixels.hpp"
#include "python/candidates.hpp"
#include "python/frame.hpp"

namespace rangeedge::python {
namespace {

void edge_strength_and_flying(const BoundFrame& bound, const ScanLineOptions& options, int threads,
                              const OutImage<float>& jump, const OutImage<float>& crease,
                              const OutImage<std::uint8_t>& kind, const OutImage<float>& significance,
                              const OutImage<std::uint8_t>& flying) {
    std::visit(
        [&](const auto& frame) {
            Team team = team_for(bound, threads);
            combine(find_candidates(frame, options, team, flying.data()), maps_of(jump, crease, kind, significance),
                    team);
            mark_boundary(frame, boundary_bit, kind.data(), team);
        },
        bound.frame);
}

void clean_surfaces(const Image<float>& ordinate, const Image<float>& x, const Image<float>& y,
                    const Image<std::uint8_t>& holes, const Image<float>& mixed, int count, double zero, double radius,
                    int threads, const OutImage<std::int32_t>& labels, const OutImage<float>& smoothed) {
    const OrdinateMap map{rows(ordinate), cols(ordinate), x.data(), y.data(), ordinate.data()};
    const std::vector<Surface> surfaces = fit_surfaces(map, labels.data(), count);
    fill_holes(map, surfaces, holes.data(), mixed.data(), zero, labels.data());
    smooth_surfaces(map, surfaces, labels.data(), radius, threads, smoothed.data());
}

}  // namespace

void bind_cleaning(nb::module_& m) {
    m.def("edge_strength_and_flying", &edge_strength_and_flying, "frame"_a, "options"_a, "threads"_a, array("jump"),
          array("crease"), array("kind"), array("significance"), array("flying"), Unlocked());
    m.def("clean_surfaces", &clean_surfaces, array("ordinate"), optional_array("x"), optional_array("y"),
          array("holes"), array("mixed"), "count"_a, "zero"_a, "radius"_a, "threads"_a, array("labels"),
          array("smoothed"), Unlocked());
}

}  // namespace rangeedge::python
