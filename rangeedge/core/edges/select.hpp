// Which pixels of an edge map stay: isolated ones are mostly noise. The paper names thresholds on strength and length
// of edges for that (paper, 6); the longer side of the bounding box stands for the length here. Beside it, a line must
// be significant as a whole, the more so the shorter it is: what its pixels tell adds up along it.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace rangeedge {

// Pixels of `edges` that stay are 1 in `kept`, the others 0. A line, whose pixels may lie three apart, stays if its
// `significance` (null: any) is at least `least_significance`: the root mean square of its pixels', times the root of
// its length in units of 10 pixels. Of that those 8-connected pieces stay whose bounding box has a side of at least
// `min_length` pixels. `wrap` says that the first column follows the last.
void keep_lines(const std::uint8_t* edges, int rows, int cols, bool wrap, int min_length, const float* significance,
                double least_significance, std::uint8_t* kept);

}  // namespace rangeedge
