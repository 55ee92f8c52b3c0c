// SPDX-License-Identifier: Apache-2.0
#include "png.hpp"

#include <cstdlib>

namespace rangeedge {

namespace {

int paeth(int a, int b, int c) {
    const int from_a = std::abs(b - c), from_b = std::abs(a - c), from_c = std::abs(a + b - 2 * c);
    if (from_a <= from_b && from_a <= from_c) return a;
    return from_b <= from_c ? b : c;
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
            int prediction = 0;
            switch (filter) {
                case 1:
                    prediction = a;
                    break;
                case 2:
                    prediction = b;
                    break;
                case 3:
                    prediction = (a + b) / 2;
                    break;
                case 4:
                    prediction = paeth(a, b, c);
                    break;
                default:
                    break;
            }
            out[i] = static_cast<std::uint8_t>(stored[i] + prediction);
        }
    }
    return true;
}

}  // namespace rangeedge
