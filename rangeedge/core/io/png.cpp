// SPDX-License-Identifier: Apache-2.0
#include "png.hpp"

#include <algorithm>
#include <cstdlib>

namespace rangeedge {

namespace {

int paeth(int a, int b, int c) {
    const int from_a = std::abs(b - c), from_b = std::abs(a - c), from_c = std::abs(a + b - 2 * c);
    const int a_or_b = from_b < from_a ? b : a;
    return from_c < std::min(from_a, from_b) ? c : a_or_b;
}

// What a byte is stored less of.
int prediction(int filter, int a, int b, int c) {
    if (filter == 1) return a;
    if (filter == 2) return b;
    if (filter == 3) return (a + b) / 2;
    return filter == 4 ? paeth(a, b, c) : 0;
}

}  // namespace

bool png_unfilter(const std::uint8_t* filtered, std::size_t rows, std::size_t row_bytes, std::size_t pixel_bytes,
                  std::uint8_t* out) {
    for (std::size_t row = 0; row < rows; ++row, out += row_bytes, filtered += row_bytes + 1) {
        const std::uint8_t filter = *filtered;
        if (filter > 4) return false;
        const std::uint8_t* stored = filtered + 1;
        const std::uint8_t* above = row > 0 ? out - row_bytes : nullptr;
        for (std::size_t i = 0; i < row_bytes; ++i) {
            const bool first = i < pixel_bytes;
            const int a = first ? 0 : out[i - pixel_bytes];
            const int b = above ? above[i] : 0;
            const int c = first || !above ? 0 : above[i - pixel_bytes];
            out[i] = static_cast<std::uint8_t>(stored[i] + prediction(filter, a, b, c));
        }
    }
    return true;
}

}  // namespace rangeedge
