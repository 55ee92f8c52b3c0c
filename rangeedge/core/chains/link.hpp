// Edges as geometry: candidates joined along the map of thin lines into ordered chains of points, each with its place
// in the image and on the image plane, and what either surface is like there.
//
//   trace    the lines of the map become paths without branches (trace.hpp)
//   divide   paths end where the kind of edge changes (pieces.hpp)
//   join     pieces that continue each other become chains (join.hpp)
//   cut      chains end at corners (corners.hpp)
//   smooth   the noise of neighbouring candidates is averaged along each chain (smooth.hpp)
//
// Linear in the number of pixels and candidates, but for the sorting of ends.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "edges/candidate.hpp"
#include "image/frame.hpp"

namespace rangeedge {

struct LinkOptions {
    double bridge;        // pixels: the widest gap that is bridged
    double corner_angle;  // degrees: a chain ends where it turns by more
    int min_length;       // pixels
    bool outlines;        // whether to link boundaries with pixels without data, too
};

// All numbers as double, so that points are rows of one array.
struct ChainPoint {
    double x, y;            // pixels
    double plane[2];        // in the plane of the image
    double ordinate[2];     // of the surface to the left and to the right; of a jump the left one is nearer
    double gradient[2][2];  // of their ordinates over the plane of the image; NaN where unknown
    double significance;
    double measured[3];  // before smoothing: in the plane of the image, and the ordinate of the nearer surface
    double deviation;    // pixels across a straight jump that pixels on both sides bound; NaN elsewhere
};

struct ChainHeader {
    std::int32_t first, count;  // of its points
    std::int32_t kind;          // jump_bit, convex_bit, concave_bit or boundary_bit
    std::int32_t closed, straight;
};

struct LinkedEdges {
    std::vector<ChainPoint> points;
    std::vector<ChainHeader> chains;
};

// `candidates` are those of the frame in any order; `thin` is a map of lines, `kinds` that of the kinds of pixels.
template <class T>
LinkedEdges link_edges(const Frame<T>& frame, const CandidateList& candidates, const std::uint8_t* thin,
                       const std::uint8_t* kinds, const LinkOptions& options, int threads);

}  // namespace rangeedge
