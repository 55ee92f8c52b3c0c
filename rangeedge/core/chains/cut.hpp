// Chains are cut at corners, in the image and in space: where an edge runs on straight in the image into another one
// that leads elsewhere in depth, its depths along the chain have the corner.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "base/parallel.hpp"
#include "chains/pieces.hpp"
#include "image/frame.hpp"

namespace rangeedge {

// Parts between corners at which a chain turns by `least_angle` degrees or more.
template <class T>
std::vector<Piece> cut_at_corners(std::vector<Piece> chains, const Frame<T>& frame, const CandidateList& candidates,
                                  const Crossings& crossings, double least_angle, Team& team);

}  // namespace rangeedge
