// SPDX-License-Identifier: Apache-2.0
#include "distance/window.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/simd.hpp"

namespace rangeedge {
namespace {

constexpr int block = 64;  // pixels that are treated together
constexpr int step = 8;    // columns on either side that are looked at before distances are compared with their reach
constexpr int beyond = Window::reach + step;  // of which no distance within reach is

RANGEEDGE_WIDE void square_heights(const std::int32_t* sources, int y, int cols, std::uint16_t* heights) {
    for (int x = 0; x < cols; ++x) {
        const std::int32_t off = std::min(std::abs(y - sources[x]), beyond);
        const std::int32_t height = sources[x] < 0 ? beyond : off;
        heights[x] = static_cast<std::uint16_t>(height * height);
    }
}

// Of block after block, as far as all distances are within reach. Heights are known beyond both ends of the row.
RANGEEDGE_WIDE bool squares_within_reach(const std::uint16_t* heights, int cols, std::uint16_t* squared) {
    for (int begin = 0; begin < cols; begin += block) {
        const int first = std::min(begin, cols - block);
        const std::uint16_t* const h = heights + first;
        std::uint16_t best[block];
        for (int i = 0; i < block; ++i) best[i] = h[i];
        for (int seen = 0;; seen += step) {
            std::uint16_t worst = 0;
            for (int i = 0; i < block; ++i) worst = std::max(worst, best[i]);
            if (worst <= seen * seen) break;
            if (seen >= Window::reach) return false;
            for (int k = seen + 1; k <= seen + step; ++k) {
                const auto kk = static_cast<std::uint16_t>(k * k);
                for (int i = 0; i < block; ++i) {
                    const std::uint16_t nearer = std::min(h[i - k], h[i + k]);
                    best[i] = std::min(best[i], static_cast<std::uint16_t>(nearer + kk));
                }
            }
        }
        for (int i = 0; i < block; ++i) squared[first + i] = best[i];
    }
    return true;
}

// Correctly rounded where the width is 1: roots of integers below 2^24 are so in either precision.
RANGEEDGE_WIDE void roots(const std::uint16_t* squared, int cols, double width, float* distance) {
    if (width == 1)
        for (int x = 0; x < cols; ++x) distance[x] = std::sqrt(static_cast<float>(squared[x]));
    else
        for (int x = 0; x < cols; ++x)
            distance[x] = static_cast<float>(width * std::sqrt(static_cast<double>(squared[x])));
}

}  // namespace

bool Window::distances(const std::int32_t* sources, int y, const Grid& grid, float* distance) {
    if (grid.cols < block) return false;
    heights_.resize(grid.cols + 2 * beyond);
    squared_.resize(grid.cols);
    std::uint16_t* const own = heights_.data() + beyond;
    square_heights(sources, y, grid.cols, own);
    for (int k = 1; k <= beyond; ++k) {
        constexpr std::uint16_t none = beyond * beyond;
        own[-k] = grid.wrap ? own[grid.cols - 1 - (k - 1) % grid.cols] : none;
        own[grid.cols + k - 1] = grid.wrap ? own[(k - 1) % grid.cols] : none;
    }
    if (!squares_within_reach(own, grid.cols, squared_.data())) return false;
    roots(squared_.data(), grid.cols, grid.width, distance);
    return true;
}

}  // namespace rangeedge
