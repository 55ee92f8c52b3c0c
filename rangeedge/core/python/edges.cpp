// Scan lines and edges.
// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/array.h>

#include <array>

#include "base/simd.hpp"
#include "edges/detect.hpp"
#include "edges/select.hpp"
#include "edges/thin.hpp"
#include "image/pixels.hpp"
#include "python/candidates.hpp"
#include "python/frame.hpp"
#include "scanline/split.hpp"

namespace rangeedge::python {
namespace {

template <class T>
auto split_scan_line(const Values<T>& y, const Values<T>& x, double eps) {
    std::vector<Segment> segments;
    {
        const Unlock unlock;
        std::vector<T> samples(y.data(), y.data() + y.size());
        samples.resize(y.size() + padding);
        Splitter<T> splitter;
        splitter.add({samples.data(), x.data(), nullptr, static_cast<int>(y.size()), static_cast<T>(eps)});
        splitter.split();
        splitter.for_each_segment(0, [&](const Segment& s) { segments.push_back(s); });
    }
    return handed_over<int>(std::move(segments));
}

CandidateList candidates_of(const BoundFrame& bound, const ScanLineOptions& options, Team& team) {
    return std::visit([&](const auto& frame) { return find_candidates(frame, options, team); }, bound.frame);
}

Columns edge_candidates(const BoundFrame& bound, const ScanLineOptions& options, int threads) {
    CandidateList candidates;
    {
        const Unlock unlock;
        Team team = team_for(bound, threads);
        candidates = candidates_of(bound, options, team);
        put_in_order(candidates);
    }
    return columns(candidates);
}

using Strengths = OutImage<float>;

CandidateList fill(const BoundFrame& bound, const ScanLineOptions& options, int threads, const EdgeMaps& maps) {
    Team team = team_for(bound, threads);
    CandidateList candidates = candidates_of(bound, options, team);
    combine(candidates, maps, team);
    std::visit([&](const auto& frame) { mark_boundary(frame, boundary_bit, maps.kind, team); }, bound.frame);
    return candidates;
}

void edge_strength(const BoundFrame& frame, const ScanLineOptions& options, int threads, const Strengths& jump,
                   const Strengths& crease, const OutImage<std::uint8_t>& kind, const Strengths& significance) {
    fill(frame, options, threads, maps_of(jump, crease, kind, significance));
}

Columns edge_strength_and_candidates(const BoundFrame& frame, const ScanLineOptions& options, int threads,
                                     const Strengths& jump, const Strengths& crease, const OutImage<std::uint8_t>& kind,
                                     const Strengths& significance) {
    CandidateList candidates;
    {
        const Unlock unlock;
        candidates = fill(frame, options, threads, maps_of(jump, crease, kind, significance));
        put_in_order(candidates);
    }
    return columns(candidates);
}

void flying_pixels(const BoundFrame& bound, const ScanLineOptions& options, int threads,
                   const OutImage<std::uint8_t>& flying) {
    Team team = team_for(bound, threads);
    std::visit([&](const auto& frame) { find_candidates(frame, options, team, flying.data()); }, bound.frame);
}

void bound_select_pixels(const Image<float>& jump, const Image<float>& crease, const Image<std::uint8_t>& kind,
                         const std::array<double, 3>& thresholds, bool wrap, int threads,
                         const OutImage<std::uint8_t>& edges) {
    Team team(threads);
    const rangeedge::Strengths strengths{jump.data(), crease.data(), kind.data(), rows(jump), cols(jump), wrap};
    select_pixels(strengths, {thresholds[0], thresholds[1], thresholds[2]}, team, edges.data());
}

void bound_keep_lines(const Image<std::uint8_t>& edges, bool wrap, int min_length, const Image<float>& significance,
                      double least_significance, const OutImage<std::uint8_t>& kept) {
    keep_lines(edges.data(), rows(edges), cols(edges), wrap, min_length, significance.data(), least_significance,
               kept.data());
}

void thin_to_lines(const Image<std::uint8_t>& edges, const Image<std::uint8_t>& preferred, int spur_length,
                   const OutImage<std::uint8_t>& thin) {
    thin_lines(edges.data(), preferred.data(), rows(edges), cols(edges), spur_length, thin.data());
}

}  // namespace

void bind_edges(nb::module_& m) {
    using O = ScanLineOptions;
    bind_options(m, "ScanLineOptions", field("eps", &O::eps), field("eps_factor", &O::eps_factor),
                 field("directions", &O::directions), field("interpolate", &O::interpolate),
                 field("endpoint", &O::endpoint), field("normals", &O::normals), field("max_shift", &O::max_shift),
                 field("max_gap", &O::max_gap), field("max_smear", &O::max_smear), field("shadows", &O::shadows),
                 field("spaced", &O::spaced), field("merge_significance", &O::merge_significance),
                 field("min_significance", &O::min_significance));
    m.def("split_scan_line", &split_scan_line<float>, array("y"), optional_array("x"), "eps"_a);
    m.def("split_scan_line", &split_scan_line<double>, array("y"), optional_array("x"), "eps"_a);
    m.def("edge_candidates", &edge_candidates, "frame"_a, "options"_a, "threads"_a);
    m.def("edge_strength", &edge_strength, "frame"_a, "options"_a, "threads"_a, array("jump"), array("crease"),
          array("kind"), array("significance"), Unlocked());
    m.def("edge_strength_and_candidates", &edge_strength_and_candidates, "frame"_a, "options"_a, "threads"_a,
          array("jump"), array("crease"), array("kind"), array("significance"));
    m.def("flying_pixels", &flying_pixels, "frame"_a, "options"_a, "threads"_a, array("flying"), Unlocked());
    m.def("thin_lines", &thin_to_lines, array("edges"), optional_array("preferred"), "spur_length"_a, array("thin"),
          Unlocked());
    m.def("select_pixels", &bound_select_pixels, array("jump"), array("crease"), optional_array("kind"), "thresholds"_a,
          "wrap"_a, "threads"_a, array("edges"), Unlocked());
    m.def("keep_lines", &bound_keep_lines, array("edges"), "wrap"_a, "min_length"_a, optional_array("significance"),
          "least_significance"_a, array("kept"), Unlocked());
}

}  // namespace rangeedge::python
