// Which pixels are edges: those whose strengths reach thresholds (paper, 6). Jumps count on their nearer side, and
// creases where they do not stand alone.
//
// Which pixels of that map stay: isolated ones are mostly noise. The paper names thresholds on strength and length
// of edges for that (paper, 6); the longer side of the bounding box stands for the length here. Beside it, a line must
// be significant as a whole, the more so the shorter it is: what its pixels tell adds up along it.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

#include "base/parallel.hpp"

namespace rangeedge {

constexpr int company = 4;           // creases of the nine pixels around one that stays, itself among them
constexpr double usual_length = 10;  // of the line whose significance is that of its pixels

// Maps of strengths, 0 where there is no edge. `kind` is null where every jump and every crease counts by itself.
struct Strengths {
    const float *jump, *crease;
    const std::uint8_t* kind;
    int rows, cols;
    bool wrap;  // whether the first column follows the last
};

// Thresholds, 0 for any strength, and that on creases which count as company of others.
struct Thresholds {
    double jump, crease, company;
};

// 1 where a jump on its nearer side, or a crease with enough company, reaches its threshold, else 0. In an image of one
// or two rows or columns creases need no company, since lines cannot have so many neighbours.
void select_pixels(const Strengths& strengths, const Thresholds& thresholds, Team& team, std::uint8_t* edges);

// Pixels of `edges` that stay are 1 in `kept`, the others 0. A line, whose pixels may lie three apart, stays if its
// `significance` (null: any) is at least `least_significance`: the root mean square of its pixels', times the root of
// its length in units of 10 pixels. Of that those 8-connected pieces stay whose bounding box has a side of at least
// `min_length` pixels. `wrap` says that the first column follows the last.
void keep_lines(const std::uint8_t* edges, int rows, int cols, bool wrap, int min_length, const float* significance,
                double least_significance, std::uint8_t* kept);

}  // namespace rangeedge
