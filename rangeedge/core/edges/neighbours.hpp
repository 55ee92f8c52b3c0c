// What the neighbours of an edge candidate, in other lines and directions, add to it.
//
// The paper treats every scan line by itself and leaves it to thresholds on strength and on the length of edges to tell
// edges from noise (paper, 6). But an edge goes on from line to line: candidates of one kind that lie close together
// support each other. So
//
//   1. significances are joined: the root of the weighted sum of squares over the neighbourhood, and candidates below
//      `min_significance` are dropped;
//   2. creases move onto the line that they form together (align.hpp);
//   3. with `normals`, the crease becomes the angle between the normals of the two surfaces (normals.hpp), which the
//      paper calls optimal (paper, 2, formula 1); else the angles in the four directions stay as they are.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "edges/candidate.hpp"
#include "edges/neighbourhood.hpp"
#include "image/frame.hpp"
#include "scanline/options.hpp"

namespace rangeedge {

// Candidates in the order of their places, which they are numbered by as they come; `grid` has room for what follows.
CandidateList in_place(const std::vector<const Candidate*>& found, NeighbourGrid& grid);

// `grid` is as `in_place` leaves it. `weak`, unless null, receives those dropped.
template <class T>
void join_neighbours(CandidateList& candidates, NeighbourGrid& grid, const Frame<T>& frame,
                     const ScanLineOptions& options, CandidateList* weak);

}  // namespace rangeedge
