// What the eight neighbours of a pixel say about it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "base/simd.hpp"

namespace rangeedge {

// Bits of a byte: east, northeast, north, and so on around; the even ones are the 4-neighbours.
using Ring = unsigned;
constexpr std::uint8_t four = 0x55, diagonal = 0xaa;
constexpr int east = 0, north = 2, west = 4, south = 6;

// What follows takes rings of single pixels, and vectors of bytes that are rings.

// The ring turned: what lies `steps` bits further around every neighbour.
template <class R>
RANGEEDGE_INLINE constexpr R turned(R ring, int steps) {
    return (ring >> steps | ring << (8 - steps)) & 255;
}

// A bit for each of the parts into which the neighbours fall, Yokoi's connectivity number of them; 0 inside and of a
// lone pixel.
template <class R>
RANGEEDGE_INLINE constexpr R parts(R on) {
    return ~on & (turned(on, 1) | turned(on, 2)) & four;
}

constexpr int count(Ring ring) {
    int bits = 0;
    for (; ring; ring &= ring - 1) ++bits;
    return bits;
}

struct Kind {
    std::uint8_t neighbours;
    bool simple;

    constexpr bool may_go() const { return simple && neighbours > 1; }  // an end of a line may not
};

constexpr std::array<Kind, 256> list_kinds() {
    std::array<Kind, 256> kinds{};
    for (Ring on = 0; on < 256; ++on) kinds[on] = {static_cast<std::uint8_t>(count(on)), count(parts(on)) == 1};
    return kinds;
}
inline constexpr std::array<Kind, 256> kinds = list_kinds();

// Whether a pixel, seen `from` a side that is open, lies beside a line which runs past it on the other side.
constexpr bool lies_beside_line(Ring on, int from) {
    const Ring ahead = turned(on, (from + 4) & 7);  // east is now the pixel ahead
    return (ahead & 1) && (ahead & 0x06) && (ahead & 0xc0);
}

// The sides that are open and seen from which a pixel lies beside such a line: a bit each for east, north, west, south.
constexpr std::array<std::uint8_t, 256> list_ways() {
    std::array<std::uint8_t, 256> ways{};
    for (Ring on = 0; on < 256; ++on)
        for (const int from : {east, north, west, south})
            if (!(on >> from & 1) && lies_beside_line(on, from)) ways[on] |= static_cast<std::uint8_t>(1 << from / 2);
    return ways;
}
inline constexpr std::array<std::uint8_t, 256> ways = list_ways();

// Not 0 where a candidate belongs to a clique of which a pixel must stay. `on` are the neighbours that are set,
// `candidates` those of them that would go with it.
template <class R>
RANGEEDGE_INLINE constexpr R crucial(R on, R candidates) {
    // A pair of 4-neighbours: what touches their common side must do so at one of its two ends.
    const R left = turned(on, 1) | turned(on, 2), right = turned(on, 7) | turned(on, 6);
    const R pairs = candidates & ~(left ^ right) & four;
    // A square of which two pixels across, three or all are set, none of them to stay.
    const R stay = on & ~candidates;
    const R squares = (on | (turned(on, 1) & turned(on, 7))) & ~(stay | turned(stay, 1) | turned(stay, 7)) & diagonal;
    return pairs | squares;
}

}  // namespace rangeedge
