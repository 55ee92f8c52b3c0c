// LZW, the compression of most TIFF files.
//
// Codes of 9 to 12 bits, the highest bit first. Codes 0 to 255 are bytes, 256 empties the table, 257 ends the data;
// each further code stands for the string of the code before and one more byte, the first of the string of the next.
// The width grows one code early: to 10 bits when code 510 has been added, to 11 with 1022, to 12 with 2046.
// Format: TIFF 6.0, section 13.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace rangeedge {

// Unpacks into at most `size` bytes and returns how many were written; what follows in `packed` is left.
// Stops where the code is wrong or the data ends.
std::size_t lzw_unpack(const std::uint8_t* packed, std::size_t packed_size, std::uint8_t* out, std::size_t size);

}  // namespace rangeedge
