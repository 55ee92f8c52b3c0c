// Corners among the positions along a chain: where two straight lines fit them much better than a smooth curve does, by
// the ratio of their sums of squared residuals, of which neighbours that are alike count less.
//
// Places where chords of several lengths turn most are looked at first; then of all corners found the least is taken
// back, again and again, while the lines between its neighbours do not confirm it; and last longer stretches are
// searched for those that turn so little that no chord tells of them.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>

#include "base/array.hpp"
#include "chains/pieces.hpp"

namespace rangeedge {

// Positions in the image, of which parabolas and circles are smooth, or from the side: positions along a chain and
// depths, which polynomials are.
enum class View { image, side };

// Numbers of the points at corners at which the line through them turns by `least_angle` degrees or more, ascending.
Array<std::ptrdiff_t> find_corners(const Array<Point>& points, bool closed, double least_angle, View view);

}  // namespace rangeedge
