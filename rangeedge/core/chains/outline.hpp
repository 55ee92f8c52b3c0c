// Outlines of data: where lines of a map run along pixels without data, and no surface is known beyond.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "edges/candidate.hpp"
#include "image/frame.hpp"

namespace rangeedge {

// Candidates half a pixel beyond the pixels that are boundaries and no other edges, of kind `boundary_bit`, with
// `occluding_bit` where the data is before them.
template <class T>
CandidateList outline_candidates(const Frame<T>& frame, const std::uint8_t* kinds);

}  // namespace rangeedge
