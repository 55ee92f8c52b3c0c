// Bands of edge pixels become lines one pixel wide.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace rangeedge {

// `thin` becomes 255 on the lines of `edges`, else 0. Pixels that `preferred` marks stay where the lines can do with
// them; it may be null. Branches that stand out of their band by fewer than `spur_length` pixels are removed.
void thin_lines(const std::uint8_t* edges, const std::uint8_t* preferred, int rows, int cols, int spur_length,
                std::uint8_t* thin);

}  // namespace rangeedge
