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
            std::memcpy(out + written, packed + at, length);
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
        if (distance >= length) {
            std::memcpy(out + written, out + written - distance, length);
        } else {
            for (std::size_t i = 0; i < length; ++i) out[written + i] = out[written + i - distance];
        }
        written += length;
    }
    return written == size;
}

}  // namespace rangeedge
