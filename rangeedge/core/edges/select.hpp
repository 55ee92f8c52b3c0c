// Which pixels of an edge map stay: isolated ones are mostly noise. The paper names thresholds on strength and length
// of edges for that (paper, 6); this is the length, and the longer side of the bounding box stands for it.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace rangeedge {

// `kept` becomes 1 on the 8-connected components of `edges` whose bounding box has a side of at least `min_length`
// pixels, else 0.
void long_components(const std::uint8_t* edges, int rows, int cols, int min_length, std::uint8_t* kept);

}  // namespace rangeedge
