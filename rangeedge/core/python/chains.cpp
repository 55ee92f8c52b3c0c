// Edges as chains of points.
// SPDX-License-Identifier: Apache-2.0
#include "chains/link.hpp"

#include <nanobind/stl/pair.h>

#include "edges/detect.hpp"
#include "image/pixels.hpp"
#include "python/candidates.hpp"
#include "python/frame.hpp"

namespace rangeedge::python {
namespace {

// The candidates of a frame, for what comes after the map of lines is known.
struct BoundCandidates {
    CandidateList all;
};

BoundCandidates keep_candidates(const BoundFrame& bound, const ScanLineOptions& options, int threads,
                                const OutImage<float>& jump, const OutImage<float>& crease,
                                const OutImage<std::uint8_t>& kind, const OutImage<float>& significance) {
    return std::visit(
        [&](const auto& frame) {
            Team team = team_for(bound, threads);
            BoundCandidates found{find_candidates(frame, options, team)};
            combine(found.all, maps_of(jump, crease, kind, significance), team);
            mark_boundary(frame, boundary_bit, kind.data(), team);
            return found;
        },
        bound.frame);
}

using Points = nb::ndarray<nb::numpy, double, nb::ndim<2>>;
using Chains = nb::ndarray<nb::numpy, std::int32_t, nb::ndim<2>>;

std::pair<Points, Chains> bound_link_edges(const BoundFrame& bound, const BoundCandidates& candidates,
                                           const Image<std::uint8_t>& thin, const Image<std::uint8_t>& kinds,
                                           const LinkOptions& options, int threads) {
    LinkedEdges linked;
    {
        const Unlock unlock;
        linked = std::visit(
            [&](const auto& frame) {
                return link_edges(frame, candidates.all, thin.data(), kinds.data(), options, threads);
            },
            bound.frame);
    }
    return {handed_over<double>(std::move(linked.points)), handed_over<std::int32_t>(std::move(linked.chains))};
}

}  // namespace

void bind_chains(nb::module_& m) {
    nb::class_<BoundCandidates>(m, "Candidates", "The edge candidates of a frame.");
    using L = LinkOptions;
    bind_options(m, "LinkOptions", field("bridge", &L::bridge), field("corner_angle", &L::corner_angle),
                 field("min_length", &L::min_length), field("outlines", &L::outlines));
    m.def("keep_candidates", &keep_candidates, "frame"_a, "options"_a, "threads"_a, array("jump"), array("crease"),
          array("kind"), array("significance"), Unlocked());
    m.def("link_edges", &bound_link_edges, "frame"_a, "candidates"_a, array("thin"), array("kinds"), "options"_a,
          "threads"_a);
}

}  // namespace rangeedge::python
