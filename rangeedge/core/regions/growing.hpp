// Growing: patches take the free pixels around them that lie on their surfaces.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "patches.hpp"

namespace rangeedge {

// Square tiles of pixels and the power sums of those that have no edge, from which the misfit of a tile to any surface
// is a few operations.
class Tiles {
public:
    const int side;  // pixels: 4 or 8

    Tiles(const SurfaceImage& image, int size, Team& team);
    int rows() const { return rows_; }
    int cols() const { return cols_; }
    int index(int row, int col) const { return row * cols_ + col; }
    // Whether all pixels are open; only then it has sums.
    bool is_open(int t) const { return sums_[t].count() > 0; }
    const SurfaceSums& sums(int t) const { return sums_[t]; }
    int first_pixel(int t) const { return first_[t]; }

private:
    int rows_, cols_;
    Array<SurfaceSums> sums_;
    Array<int> first_;
};

struct TilePyramid {
    Tiles large, small;
    TilePyramid(const SurfaceImage& image, Team& team) : large(image, 8, team), small(image, 4, team) {}
};

// Patches grow over open pixels within `tolerance` standard deviations of their surfaces, which follow their pixels.
void grow(PatchMap& patches, const TilePyramid& tiles, double tolerance);

// Free pixels up to `reach` go to the neighbouring patch they fit best, within `tolerance`; surfaces stay.
void fill(PatchMap& patches, PatchMap::Free reach, double tolerance);

// Pixels at borders move to the neighbouring patch if they fit that better.
void adjust_borders(PatchMap& patches);

}  // namespace rangeedge
