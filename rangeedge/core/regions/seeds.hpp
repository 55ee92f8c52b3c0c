// Seeds: the peaks of a distance map with what surrounds them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace rangeedge {

// Markers 1..n of the peaks of `distance` that reach `min_distance`, and 0 elsewhere; returns n. A peak counts by
// itself where every 8-connected path to a higher one (or to an equal one of lower index) drops below `separation`
// times its distance; its seed is the connected set around it that does not. Pixels with `mask` 0 (it may be null) do
// not exist. `wrap` says that the first column follows the last. Seeds are numbered in raster order of their first
// pixels.
int extract_seeds(const float* distance, const std::uint8_t* mask, int height, int width, bool wrap, float min_distance,
                  float separation, int threads, std::int32_t* markers);

}  // namespace rangeedge
