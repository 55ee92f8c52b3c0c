// What the detector does at a pixel, for whoever asks why.
// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include "edges/detect.hpp"
#include "edges/select.hpp"
#include "edges/trace.hpp"
#include "python/candidates.hpp"
#include "python/frame.hpp"

namespace rangeedge::python {
namespace {

nb::tuple kept_and_weak(const BoundFrame& bound, const ScanLineOptions& options, int threads) {
    CandidateList kept, weak;
    {
        const Unlock unlock;
        Team team = team_for(bound, threads);
        std::visit([&](const auto& frame) { kept = find_candidates(frame, options, team, nullptr, &weak); },
                   bound.frame);
    }
    return nb::make_tuple(columns(kept), columns(weak));
}

// Samples, segments and cuts, a row each, in the order of the fields of their structs.
nb::tuple traced_line(const BoundFrame& bound, const ScanLineOptions& options, int direction, int col, int row) {
    LineTrace trace;
    {
        const Unlock unlock;
        std::visit([&](const auto& frame) { trace = trace_line(frame, options, direction, col, row); }, bound.frame);
    }
    return nb::make_tuple(handed_over<double>(std::move(trace.samples)), handed_over<double>(std::move(trace.segments)),
                          handed_over<double>(std::move(trace.cuts)));
}

}  // namespace

void bind_explain(nb::module_& m) {
    m.attr("lone_significance") = lone_significance;
    m.attr("company") = company;
    m.attr("usual_length") = usual_length;
    m.def("kept_and_weak", &kept_and_weak, "frame"_a, "options"_a, "threads"_a);
    m.def("trace_line", &traced_line, "frame"_a, "options"_a, "direction"_a, "col"_a, "row"_a);
}

}  // namespace rangeedge::python
