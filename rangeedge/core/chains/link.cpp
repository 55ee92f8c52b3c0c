// SPDX-License-Identifier: Apache-2.0
#include "chains/link.hpp"

#include <algorithm>

#include "base/parallel.hpp"
#include "chains/cut.hpp"
#include "chains/join.hpp"
#include "chains/outline.hpp"
#include "chains/pieces.hpp"
#include "chains/smooth.hpp"
#include "chains/trace.hpp"

namespace rangeedge {
namespace {

constexpr double largest_turn = 15;    // degrees, across a gap
constexpr int chains_per_thread = 16;  // for fewer another thread is not worth starting

std::int32_t kind_of(EdgeClass type) {
    return type == EdgeClass::convex    ? convex_bit
           : type == EdgeClass::concave ? concave_bit
           : type == EdgeClass::outline ? boundary_bit
                                        : jump_bit;
}

}  // namespace

template <class T>
LinkedEdges link_edges(const Frame<T>& frame, const CandidateList& found, const std::uint8_t* thin,
                       const std::uint8_t* kinds, const LinkOptions& options, int threads) {
    CandidateList with_outlines;
    if (options.outlines) {
        with_outlines = outline_candidates(frame, kinds);
        with_outlines.insert(with_outlines.begin(), found.begin(), found.end());
    }
    const CandidateList& candidates = options.outlines ? with_outlines : found;
    const Tracing tracing = trace_paths(thin, frame.rows, frame.cols);
    const Crossings crossings = assign_candidates(candidates, tracing, frame.rows, frame.cols);
    std::vector<Piece> chains = join_pieces(find_pieces(candidates, tracing, crossings, kinds, frame.cols), candidates,
                                            crossings, {options.bridge, largest_turn});
    Team team(std::min(threads, 1 + static_cast<int>(chains.size()) / chains_per_thread));
    chains = cut_at_corners(std::move(chains), frame, candidates, crossings, options.corner_angle, team);
    chains.erase(std::remove_if(chains.begin(), chains.end(),
                                [&](const Piece& c) { return c.members.size() < options.min_length; }),
                 chains.end());

    std::vector<SmoothChain> smooth(chains.size());
    parallel_each(static_cast<int>(chains.size()), team, [&](int i, int) {
        const auto k = static_cast<std::size_t>(i);
        smooth[k] = smooth_chain(chains[k], frame, candidates, crossings);
    });
    LinkedEdges result;
    for (std::size_t i = 0; i < chains.size(); ++i) {
        const std::vector<ChainPoint>& points = smooth[i].points;
        if (points.size() < 2) continue;
        result.chains.push_back({static_cast<std::int32_t>(result.points.size()),
                                 static_cast<std::int32_t>(points.size()), kind_of(chains[i].type), chains[i].closed,
                                 smooth[i].straight});
        result.points.insert(result.points.end(), points.begin(), points.end());
    }
    return result;
}

template LinkedEdges link_edges(const Frame<float>&, const CandidateList&, const std::uint8_t*, const std::uint8_t*,
                                const LinkOptions&, int);
template LinkedEdges link_edges(const Frame<double>&, const CandidateList&, const std::uint8_t*, const std::uint8_t*,
                                const LinkOptions&, int);

}  // namespace rangeedge
