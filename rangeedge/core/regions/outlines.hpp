// Outlines of regions along the borders of pixels. Regions that touch share their border: it is traced once, as an arc
// from one corner of pixels at which three or four regions meet to the next, and the outline of either is a ring of
// such arcs. Whatever is done to an arc happens to both outlines, which therefore leave no gap and do not overlap.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <vector>

namespace rangeedge {

struct Outlines {
    struct Arc {
        std::int32_t first, count;  // of its corners
        std::int32_t right, left;   // the regions beside it, seen along it with y downwards; 0 is none
    };
    struct Ring {
        std::int32_t first, count;  // of its steps
        std::int32_t region;        // on the right
        std::int64_t area;          // pixels inside; of a hole minus these
    };
    std::vector<std::array<std::int32_t, 2>> corners;  // column and row; pixel (u, v) has (u, v) to (u + 1, v + 1)
    std::vector<Arc> arcs;                             // closed ones end where they begin
    std::vector<std::int32_t> steps;                   // of rings: arc i forwards: i, backwards: -i - 1
    std::vector<Ring> rings;                           // by region; the first one of a region is its outside
    std::vector<std::int32_t> labels;                  // of regions 1, 2, ...: connected pixels of a label
};

// Of labels > 0; pixels of a region are connected by their sides. Arcs have no corner in the middle of a straight run.
Outlines trace_outlines(const std::int32_t* labels, int rows, int cols);

// Which points of lines to keep so that no other lies farther than a tolerance from the line through these (Douglas and
// Peucker). A line has points first .. first + count - 1 of (x, y); the first and the last stay, and of closed lines
// at least three more where there are as many. Lines that meet at their ends only do so afterwards, too: more points
// stay where they would meet elsewhere.
struct Polyline {
    std::int64_t first, count;
    double tolerance;
};
void simplify_lines(const double* points, const std::vector<Polyline>& lines, std::uint8_t* kept);

}  // namespace rangeedge
