// The filters of PNG, by which each row is stored as differences from its neighbours.
//
// A row begins with the number of its filter, then come its bytes. With a the byte of the pixel to the left, b the one
// above, c the one above a (0 outside of the image), each is stored less a prediction:
//
//     0 none: 0     1 sub: a     2 up: b     3 average: (a + b) / 2     4 Paeth: that of a, b, c next to a + b - c
//
// Format: PNG (third edition), section 9, https://www.w3.org/TR/png-3/#9Filters.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace rangeedge {

// From `rows` times 1 + `row_bytes` filtered bytes to the plain ones; false where a row has an unknown filter.
bool png_unfilter(const std::uint8_t* filtered, std::size_t rows, std::size_t row_bytes, std::size_t pixel_bytes,
                  std::uint8_t* out);

}  // namespace rangeedge
