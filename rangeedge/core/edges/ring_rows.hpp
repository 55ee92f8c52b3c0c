// The rings of many pixels at once: a whole image takes hardly longer than looking at it.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>

namespace rangeedge {

// States of pixels as thinning has them, in one array: a pixel's neighbours above and below are `stride` away. There
// are pixels around all that matter, and as many as a vector has bytes after these.
struct StateMap {
    static constexpr std::uint8_t on = 1, line = 2, candidate = 4, queued = 8, stays = 16, kept = 32;
    static constexpr std::ptrdiff_t beyond = 64;  // pixels

    std::uint8_t* states;
    std::ptrdiff_t first, last, stride;
};

// Of the pixels that are on and in no line yet, those at the border, where a 4-neighbour is not on, become candidates
// if they may go, else lines; `layer` becomes that of the round there.
struct BorderCount {
    std::size_t pixels, enclosed;  // pixels that are on and in no line, at the border and within
};
BorderCount mark_border(const StateMap& map, int round, std::uint8_t* layer);
// Candidates that must stay become kept.
void mark_kept(const StateMap& map);
// The rings of all pixels; `rings` holds zeros before.
void list_rings(const StateMap& map, std::uint8_t* rings);

}  // namespace rangeedge
