// Short distances, from all columns around: a row of squared distances is the minimum over k of
//
//     D^2(x) = min(h(x - k), h(x + k)) + k^2,
//
// where h are the squared distances along columns. Many pixels are treated at once, in 16 bits, nearer columns first;
// what is no farther than k needs none beyond. Takes squares of pixels without labels.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "base/array.hpp"
#include "distance/distance.hpp"

namespace rangeedge {

class Window {
public:
    static constexpr int reach = 172;  // of distances in pixels; sums of two squares of up to reach + 8 fit 16 bits

    // A row of distances, from the row of the nearest source in every column, -1 for none. Returns whether all of them
    // are within reach; else what is written counts for nothing.
    bool distances(const std::int32_t* sources, int y, const Grid& grid, float* distance);

private:
    Array<std::uint16_t> heights_, squared_;
};

}  // namespace rangeedge
