// Tiles: small squares of pixels, of which sums tell all that fits need.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "base/array.hpp"
#include "regions/surface_image.hpp"

namespace rangeedge {

// A grid of square tiles of pixels. Those without an edge are open, and have power sums, from which the misfit of a
// tile to any surface is a few operations.
class Tiles {
public:
    Tiles(const SurfaceImage& image, int side);

    int side() const { return side_; }
    int rows() const { return rows_; }
    int cols() const { return cols_; }
    int count() const { return rows_ * cols_; }
    int index(int row, int col) const { return row * cols_ + col; }
    int first_pixel(int t) const { return image_.index(t / cols_ * side_, t % cols_ * side_); }
    // The tile of a pixel, -1 where the grid has none.
    int at(int p) const {
        const int row = (p / image_.stride() - 1) / side_, col = (p % image_.stride() - 1) / side_;
        return row < rows_ && col < cols_ ? index(row, col) : -1;
    }
    bool is_open(int t) const { return open_[t]; }
    // The mean ordinate of an open tile, in standard deviations of a pixel.
    double mean(int t) const { return mean_[t]; }
    SurfaceSums sums(int t) const { return sums_.empty() ? add_up(t) : sums_[t]; }

    // Sums of the pixels of a tile, none if it is not open.
    SurfaceSums add_up(int t) const;
    // The same of a whole row of tiles.
    void add_up_row(int row, SurfaceSums* sums) const;
    // Notes that a tile has these sums, and keeps them if `keep` was called before.
    void set(int t, const SurfaceSums& sums);
    void keep() { sums_.resize(open_.size()); }

private:
    const SurfaceImage& image_;
    int side_, rows_, cols_;
    Array<std::uint8_t> open_;
    Array<double> mean_;
    Array<SurfaceSums> sums_;
};

// Tiles of 8 x 8 pixels, and of 4 x 4. Only the large ones keep their sums, which are the sums of small ones.
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
