// Chains: pieces joined end to end where a gap is narrow and kind and direction agree on its two sides, be it a hole in
// the map of lines or a junction through which an edge runs on. Every end is joined once at most, the best pairs first.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "chains/pieces.hpp"

namespace rangeedge {

struct JoinOptions {
    double max_gap;     // pixels between the ends of two pieces
    double turn_angle;  // degrees that the direction may change from one to the other
};

std::vector<Piece> join_pieces(std::vector<Piece> pieces, const CandidateList& candidates, const Crossings& crossings,
                               const JoinOptions& options);

}  // namespace rangeedge
