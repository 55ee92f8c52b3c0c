// Marks of the pixels of a row that are worth a look, which loops over many pixels at once set.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace rangeedge {

// Bytes of the marks of n pixels, as for_marked reads them.
constexpr std::size_t marks_size(int n) { return static_cast<std::size_t>(n) + sizeof(std::uint64_t); }

// Calls visit(k) where a mark is set.
template <class F>
void for_marked(const std::uint8_t* marks, int n, F&& visit) {
    std::uint64_t eight;
    for (int k = 0; k < n; k += static_cast<int>(sizeof eight)) {
        std::memcpy(&eight, marks + k, sizeof eight);
        if (!eight) continue;
        for (int i = k; i < std::min(k + static_cast<int>(sizeof eight), n); ++i)
            if (marks[i]) visit(i);
    }
}

}  // namespace rangeedge
