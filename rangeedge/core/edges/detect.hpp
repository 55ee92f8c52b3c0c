// Edge detection (paper, 4.2): every cut between two segments of a scan line is an edge candidate, whose position and
// strengths the two curves give. Rows, columns and both diagonals are worked on independently of each other.
//
// A jump that is smeared over a few samples is one candidate (smear.hpp), and so is the end of a surface beside shadow
// (shadow.hpp). The surfaces beside a jump do not meet: it has no crease.
//
// The paper keeps every candidate, since those that are no edges are weak. Here the noise decides: a candidate needs
// a significance by itself, and later one together with its neighbours (neighbours.hpp).
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "base/parallel.hpp"
#include "edges/candidate.hpp"
#include "image/frame.hpp"
#include "scanline/options.hpp"

namespace rangeedge {

constexpr double lone_significance = 3;  // standard deviations that a candidate needs by itself, before its neighbours

// All candidates, by their place in the image; the same for any number of threads. `smeared`, unless null, becomes 255
// at pixels over which a step is smeared (smear.hpp); it holds zeros before. `weak`, unless null, receives the
// candidates that were dropped because they and their neighbours are not significant.
template <class T>
CandidateList find_candidates(const Frame<T>& frame, const ScanLineOptions& options, Team& team,
                              std::uint8_t* smeared = nullptr, CandidateList* weak = nullptr);

// Brings them into their order along directions and lines.
void put_in_order(CandidateList& candidates);

}  // namespace rangeedge
