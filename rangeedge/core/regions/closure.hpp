// Contour closure: lines across the gaps between edges, where the surfaces on their two sides meet or part.
//
//   divide   what is no edge falls into parts, each of one region; slivers that lie beside an edge, on the wrong side
//            of it, go to the part that they are open to
//   verify   most pixels of a part lie on its surface, by what lies off the surfaces of all
//   align    where surfaces meet, the border between two parts lies where one passes through the other
//   draw     what is left of open borders between verified parts, as far as a gap is wide at most
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "regions/surface_image.hpp"

namespace rangeedge {

struct ClosureParameters {
    double correlation;  // standard deviation of a pixel from its surface, in units of that between pixels
    double tolerance;    // of a pixel on its surface, in these standard deviations
    double share;        // of the pixels of a surface that lie on it
    int max_gap;         // pixels
    int min_area;        // of a part, in pixels
};

// `regions` are labels from 1 on, 0 for none. `lines` becomes 255 on lines across the gaps of edges, else 0.
void close_contours(const RangeMap& map, const std::int32_t* regions, const ClosureParameters& parameters, int threads,
                    std::uint8_t* lines);

}  // namespace rangeedge
