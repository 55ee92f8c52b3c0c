// Lists in binary PLY files: a length, then that many items. Where one begins is known when all before it are read.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace rangeedge {

struct PlyList {
    std::size_t length_bytes;  // 1, 2 or 4
    bool big_endian;
    std::size_t item_bytes;
};

// For each of `count` lists in `data` where its first item is, -1 if it has none. Returns where the last one ends; a
// number beyond `size` where the data ends before.
std::size_t ply_first_items(const std::uint8_t* data, std::size_t size, std::size_t count, const PlyList& list,
                            std::int64_t* first);

}  // namespace rangeedge
