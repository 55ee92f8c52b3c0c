// From a map of thin lines to the order of their pixels.
//
// A pixel with more than two neighbours is a junction and on no path, so that paths have no branches. Diagonal
// neighbours that a third pixel joins at right angles do not count as such.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/array.hpp"

namespace rangeedge {

struct LinePath {
    std::ptrdiff_t first, end;  // of its pixels in `Tracing::pixels`
    bool closed;
};

struct Tracing {
    std::vector<LinePath> paths;
    Array<std::int32_t> pixels;  // path after path, each in its order
    Array<std::int32_t> place;   // of every pixel of the image in `pixels`; negative if on no path
};

Tracing trace_paths(const std::uint8_t* thin, int rows, int cols);

}  // namespace rangeedge
