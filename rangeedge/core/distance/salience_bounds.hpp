// Bounds by which the search for the nearest salient pixel, in salience.cpp, excludes sources and blocks of them. They
// are loops over many candidates at once, in float.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "distance/source_tree.hpp"

namespace rangeedge {

constexpr int tile_pixels = tile_size * tile_size;
constexpr float slack = 1.0f / (1 << 19);  // for the rounding of bounds, as a share of them

struct Tile {
    int y, x;                        // its first pixel
    float left, right, top, bottom;  // its first and last columns and rows inside the image
};

// Groups of slots copied into flat arrays.
struct Candidates {
    std::vector<int> groups;
    std::vector<float> weight, x, y, left, right, top, bottom, peak, slope_x, slope_y;

    int count() const { return static_cast<int>(groups.size()) * group_size; }
    int slot(int i) const { return groups[static_cast<std::size_t>(i / group_size)] * group_size + i % group_size; }

    void gather(const Points& from) {
        gather(from.weight, weight);
        gather(from.x, x);
        gather(from.y, y);
    }

    void gather(const Blocks& from) {
        gather(static_cast<const Points&>(from));
        gather(from.left, left);
        gather(from.right, right);
        gather(from.top, top);
        gather(from.bottom, bottom);
        gather(from.peak, peak);
        gather(from.slope_x, slope_x);
        gather(from.slope_y, slope_y);
    }

private:
    void gather(const Array<float>& from, std::vector<float>& to) const {
        to.resize(static_cast<std::size_t>(count()));
        for (std::size_t i = 0; i < groups.size(); ++i)
            std::memcpy(&to[i * group_size], &from[std::ptrdiff_t{groups[i]} * group_size], group_size * sizeof(float));
    }
};

// `aspect` is the squared height of a pixel in pixel widths, `unit_y` the height itself.

// Lower bounds of the blocks on a tile; returns the least upper bound.
float bound(const Candidates& blocks, const Tile& tile, float aspect, float* lower);

// Upper bounds of the sources, or the strongest ones of blocks, on a tile; returns the number of about the least one.
int find_pivot(const Candidates& from, const Tile& tile, float aspect, float* upper);

// By how much each source exceeds the pivot everywhere on the tile, less what rounding may amount to: one above 0 has
// no say there.
void exceed(const Candidates& sources, int pivot, const Tile& tile, float aspect, const float* upper, float* excess);

// An upper bound of the pivot's distance over a tile, as a plane: at its middle and how it rises from there, per pixel
// width either way.
struct PivotPlane {
    float middle, rise_x, rise_y;
};
PivotPlane plane_of_pivot(float weight, float x, float y, const Tile& tile, float unit_y);

// A lower bound of |p - q| - s(q) D(p) over the sources q of a block and the pixels p of a tile, where D is the pivot's
// distance: above 0 the block has no say there. With t = p - middle of the tile, r = q - middle of the block and u the
// direction from the latter to the former,
//     |p - q| >= |middle - middle| + u (t - r),   s(q) <= peak + slope r,   D(p) <= D_0 + rise t.
void exceed_as_planes(const Candidates& blocks, const PivotPlane& pivot, const Tile& tile, float unit_y, float* excess);

// For every pixel of a tile the least w d^2, the number of its source, and the second least.
void compare(int count, const float* weight, const float* x, const float* y, const Tile& tile, float aspect,
             float* least, std::int32_t* number, float* second);

// Marks the sources whose w d^2 at one pixel is at most `limit`. Their number is a multiple of `lanes`.
constexpr int lanes = 16;
void mark_near(int count, const float* weight, const float* x, const float* y, float row, float col, float aspect,
               float limit, std::uint8_t* marks);

// width |p - q| / s(q) of every pixel of a tile, from |p - q|^2.
void weigh(const double* squared, const double* salience, double width, float* distance);

}  // namespace rangeedge
