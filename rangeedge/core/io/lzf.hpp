// LZF, the compression of binary_compressed PCD files.
//
// The packed bytes are a sequence of literal runs and repetitions, told apart by a control byte:
//
//     000LLLLL                      L + 1 literal bytes follow
//     LLLDDDDD dddddddd             repeat L + 2 bytes from D * 256 + d + 1 bytes back (L from 1 to 6)
//     111DDDDD llllllll dddddddd    the same with L = 7 + l
//
// A repetition may overlap what it writes: distance 1 fills with one byte.
// Format: Marc Lehmann, LibLZF, http://software.schmorp.de/pkg/liblzf.html (described there, written anew here).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace rangeedge {

// Unpacks all of `packed` into exactly `size` bytes; false, with `out` in part written, where it does not fit.
bool lzf_unpack(const std::uint8_t* packed, std::size_t packed_size, std::uint8_t* out, std::size_t size);

}  // namespace rangeedge
