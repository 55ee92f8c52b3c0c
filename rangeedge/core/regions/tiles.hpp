// Tiles: small squares of pixels, of which sums tell all that fits need.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "array.hpp"
#include "surface_image.hpp"

namespace rangeedge {

// Square tiles of pixels and the power sums of those that have no edge, from which the misfit of a tile to any surface
// is a few operations.
class Tiles {
public:
    const int side;  // pixels: 4 or 8

    Tiles(const SurfaceImage& image, int size);
    int rows() const { return rows_; }
    int cols() const { return cols_; }
    int count() const { return rows_ * cols_; }
    int index(int row, int col) const { return row * cols_ + col; }
    // Whether all pixels are open; only then it has sums.
    bool is_open(int t) const { return open_[t]; }
    const SurfaceSums& sums(int t) const { return sums_[t]; }
    int first_pixel(int t) const { return first_[t]; }

    // Sums of a tile from its pixels, or from the four smaller tiles that it consists of, if all of these are open.
    void add_up(const SurfaceImage& image, int t);
    void add_up(const Tiles& quarters, int row, int col);

private:
    int rows_, cols_;
    Array<SurfaceSums> sums_;
    Array<int> first_;
    Array<std::uint8_t> open_;
};

// Tiles of 8 x 8 pixels, and of 4 x 4.
struct TilePyramid {
    Tiles large, small;
    TilePyramid(const SurfaceImage& image, Team& team);
};

// The noise of a range image at the scale of tiles, which is that of its surfaces where noise has long waves.
struct TileNoise {
    // The standard deviation of pixels from the smooth surface below them, in units of that between neighbours: 1 for
    // independent noise, more where pixels err together.
    double deviation;
    // How many pixels tell as much as one that is independent of all others: n pixels have a mean with the variance of
    // one, over n / area.
    double area;
};

TileNoise tile_noise(const TilePyramid& tiles);

}  // namespace rangeedge
