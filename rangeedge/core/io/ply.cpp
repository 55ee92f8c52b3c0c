// SPDX-License-Identifier: Apache-2.0
#include "ply.hpp"

namespace rangeedge {

std::size_t ply_first_items(const std::uint8_t* data, std::size_t size, std::size_t count, const PlyList& list,
                            std::int64_t* first) {
    std::size_t at = 0;
    for (std::size_t i = 0; i < count; ++i) {
        if (size - at < list.length_bytes) return size + 1;
        std::size_t length = 0;
        for (std::size_t k = 0; k < list.length_bytes; ++k) {
            const std::size_t shift = 8 * (list.big_endian ? list.length_bytes - 1 - k : k);
            length |= std::size_t{data[at + k]} << shift;
        }
        at += list.length_bytes;
        first[i] = length > 0 ? static_cast<std::int64_t>(at) : -1;
        if (length > (size - at) / list.item_bytes) return size + 1;
        at += length * list.item_bytes;
    }
    return at;
}

}  // namespace rangeedge
