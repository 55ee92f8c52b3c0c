// Which pixels of an edge map stay: isolated ones are mostly noise. The paper names thresholds on strength and length
// of edges for that (paper, 6); the longer side of the bounding box stands for the length here. Beside it, a line must
// be significant somewhere, so that its other pixels need less significance than a pixel by itself.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace rangeedge {

// `kept` becomes 1 on the 8-connected components of `edges` whose bounding box has a side of at least `min_length`
// pixels and which hold a pixel of at least `min_peak` in `significance` (null: any), else 0.
void keep_lines(const std::uint8_t* edges, int rows, int cols, int min_length, const float* significance,
                float min_peak, std::uint8_t* kept);

}  // namespace rangeedge
