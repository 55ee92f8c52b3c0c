// The small holes of a scan line that its surface bridges.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "base/array.hpp"
#include "image/hole.hpp"
#include "scanline/line.hpp"

namespace rangeedge {

// The holes of at most `most` samples across which the line runs on: as steeply as it does on one of the two sides, but
// for twice the tolerance, below which there are no jumps.
template <class T>
void find_bridged(const Line<T>& line, int most, Array<Hole>& holes);

}  // namespace rangeedge
