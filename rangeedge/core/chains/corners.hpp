// Chains are cut at corners. A corner is where two straight lines fit the positions much better than a parabola or a
// circle does, by the ratio of their sums of squared residuals, of which neighbours that are alike count less.
//
// Places where chords of several lengths turn most are looked at first; then of all corners found the least is taken
// back, again and again, while the lines between its neighbours do not confirm it; and last longer stretches are
// searched for those that turn so little that no chord tells of them.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "base/parallel.hpp"
#include "chains/pieces.hpp"

namespace rangeedge {

// Parts between corners at which a chain turns by `least_angle` degrees or more.
std::vector<Piece> cut_at_corners(std::vector<Piece> chains, const std::vector<Candidate>& candidates,
                                  const Crossings& crossings, double least_angle, Team& team);

}  // namespace rangeedge
