// What the eight neighbours of a pixel say about it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace rangeedge {

// Bits of a byte: east, northeast, north, and so on around; the even ones are the 4-neighbours.
using Ring = unsigned;
constexpr Ring four = 0x55, diagonal = 0xaa;
constexpr int east = 0, north = 2, west = 4, south = 6;

// The ring turned: what lies `steps` bits further around every neighbour.
constexpr Ring turned(Ring ring, int steps) { return (ring >> steps | ring << (8 - steps)) & 255u; }

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
    for (Ring on = 0; on < 256; ++on) {
        // Yokoi's connectivity number: into how many parts the neighbours fall; 0 inside and of a lone pixel.
        const int parts = count(~on & (turned(on, 1) | turned(on, 2)) & four);
        kinds[on] = {static_cast<std::uint8_t>(count(on)), parts == 1};
    }
    return kinds;
}
inline constexpr std::array<Kind, 256> kinds = list_kinds();

// Whether a pixel, seen `from` a side that is open, lies beside a line which runs past it on the other side.
constexpr bool lies_beside_line(Ring on, int from) {
    const Ring ahead = turned(on, (from + 4) & 7);  // east is now the pixel ahead
    return (ahead & 1) && (ahead & 0x06) && (ahead & 0xc0);
}

// Whether a candidate belongs to a clique of which a pixel must stay. `on` are the neighbours that are set,
// `candidates` those of them that would go with it.
constexpr bool is_crucial(Ring on, Ring candidates) {
    // A pair of 4-neighbours: what touches their common side must do so at one of its two ends.
    const Ring left = turned(on, 1) | turned(on, 2), right = turned(on, 7) | turned(on, 6);
    const Ring pairs = candidates & ~(left ^ right) & four;
    // A square of which two pixels across, three or all are set, none of them to stay.
    const Ring stay = on & ~candidates;
    const Ring squares =
        (on | (turned(on, 1) & turned(on, 7))) & ~(stay | turned(stay, 1) | turned(stay, 7)) & diagonal;
    return pairs | squares;
}

}  // namespace rangeedge
