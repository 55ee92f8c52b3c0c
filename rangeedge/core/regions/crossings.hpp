// Segments of a drawing that get in each other's way. Borders of regions meet at their ends only; where lines that
// replace them meet elsewhere, regions overlap.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <vector>

namespace rangeedge {

struct PlaneSegment {
    std::array<double, 2> from, to;
};

// 1 for every segment that meets another one elsewhere than at a common end, or has more than that in common with it.
std::vector<std::uint8_t> find_crossings(const std::vector<PlaneSegment>& segments);

}  // namespace rangeedge
