// SPDX-License-Identifier: Apache-2.0
#include "lzf.hpp"

#include <cstring>

namespace rangeedge {

bool lzf_unpack(const std::uint8_t* packed, std::size_t packed_size, std::uint8_t* out, std::size_t size) {
    std::size_t at = 0, written = 0;
    while (at < packed_size) {
        const std::size_t control = packed[at++];
        if (control < 32) {
            const std::size_t length = control + 1;
            if (length > packed_size - at || length > size - written) return false;
            // A copy of fixed size is one instruction or two; what it writes beyond the run is written again.
            if (packed_size - at >= 32 && size - written >= 32) {
                std::memcpy(out + written, packed + at, 32);
            } else {
                std::memcpy(out + written, packed + at, length);
            }
            at += length;
            written += length;
            continue;
        }
        std::size_t length = (control >> 5) + 2;
        if (length == 9) {
            if (at == packed_size) return false;
            length += packed[at++];
        }
        if (at == packed_size) return false;
        const std::size_t distance = ((control & 31) << 8) + packed[at++] + 1;
        if (distance > written || length > size - written) return false;
        if (distance >= 16 && size - written >= length + 15) {
            for (std::size_t i = 0; i < length; i += 16) {
                std::memcpy(out + written + i, out + written + i - distance, 16);
            }
        } else {
            for (std::size_t i = 0; i < length; ++i) out[written + i] = out[written + i - distance];
        }
        written += length;
    }
    return written == size;
}

}  // namespace rangeedge
