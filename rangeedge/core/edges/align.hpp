// The second adaptation of an edge's position, after the one along its own scan line (position.hpp): where two curves
// intersect is uncertain in noise, but the creases of several scan lines form a line. A crease moves along its scan
// line to where that crosses the common line, unless this leads farther than `max_shift` samples from the cut, or by
// more than `max_spreads` standard deviations of its own position, or off the data. The paper adapts scan lines one by
// one (paper, 4.2).
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "edges/candidate.hpp"
#include "edges/neighbourhood.hpp"
#include "image/frame.hpp"

namespace rangeedge {

template <class T>
void align(Candidate& c, const NeighbourGrid::Near& near, const Frame<T>& frame, double max_shift, double max_spreads);

}  // namespace rangeedge
