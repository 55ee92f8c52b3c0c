// A range image in units of its noise, and which surface describes a set of its pixels.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "surface.hpp"

namespace rangeedge {

// Maps of rows * cols pixels. Planes of the scene are affine functions ordinate(x, y).
struct RangeMap {
    int rows, cols;
    const float* x;         // place on the image plane, neighbours about 1 apart; null: the column
    const float* y;         // null: the row
    const float* ordinate;  // grows toward the viewer, less `offset`; NaN: no data
    double offset;
    bool projective;                  // the ordinate is inverse depth, else height
    std::array<double, 6> to_plane;   // (x, y, 1) to normalised image coordinates, or to lengths
    std::array<double, 3> noise;      // standard deviation a + b z + c z^2 of a length z
    const float* noise_map;           // or that of every pixel; null: the former
    const std::uint8_t* edges;        // non-zero: edge; null: none
};

using Pixels = std::vector<int>;

constexpr double lateral_deviation = 0.15;  // pixels: by how much a sample may stem from beside its line of sight
constexpr std::size_t least_pixels = 12;  // of a surface
constexpr std::size_t least_curved = 40;  // of a quadratic

// Pixels are known by their index in a copy with a margin of one pixel, so that each has all its neighbours.
class SurfaceImage {
public:
    // `lateral` is the standard deviation of a pixel's place, in pixels.
    SurfaceImage(const RangeMap& map, double lateral);

    int rows() const { return rows_; }
    int cols() const { return cols_; }
    int stride() const { return cols_ + 2; }
    int size() const { return (rows_ + 2) * stride(); }
    int index(int row, int col) const { return (row + 1) * stride() + col + 1; }
    std::array<int, 4> neighbours() const { return {-stride(), -1, 1, stride()}; }

    bool valid(int p) const { return state_[static_cast<std::size_t>(p)] != none; }
    bool open(int p) const { return state_[static_cast<std::size_t>(p)] == plain; }
    bool edge(int p) const { return state_[static_cast<std::size_t>(p)] == edge_pixel; }
    bool beside_edge(int p) const;

    // Noise correlated over several pixels moves surfaces more than its deviation between neighbours tells: the typical
    // misfit of a quadratic to one of `sets` does. It scales every standard deviation from then on.
    void estimate_correlation(const std::vector<Pixels>& sets);
    void set_correlation(double correlation) { correlation_ = correlation; }
    double correlation() const { return correlation_; }

    Sample sample(int p) const {
        const Pixel& s = at(p);
        return {static_cast<double>(s.x), static_cast<double>(s.y), static_cast<double>(s.ordinate),
                1 / static_cast<double>(s.variance)};
    }

    // Square of the distance of a pixel from a surface in standard deviations: of the noise over a region, and of the
    // pixel's place.
    double residual(int p, const Surface& s) const {
        const Pixel& pixel = at(p);
        const double x = static_cast<double>(pixel.x), y = static_cast<double>(pixel.y);
        if (!s.curved) {
            const double d = static_cast<double>(pixel.ordinate) - s.value_on_plane(x, y);
            return d * d / variance(pixel, s.c[1], s.c[2]);
        }
        const double d = static_cast<double>(pixel.ordinate) - s.value(x, y);
        return d * d / variance(pixel, s.slope_x(x, y), s.slope_y(x, y));
    }

    SurfaceSums sums_of(const Pixels& pixels) const;
    Surface plane_of(const Pixels& pixels) const;
    // A plane unless a quadratic is much better.
    Surface surface_of(const SurfaceSums& sums) const;
    bool is_flat(const Surface& surface) const;
    // Two planes that meet in a crease describe some sets of pixels better than a quadratic: whether so, and which
    // pixels lie on which.
    bool split_roof(const Pixels& pixels, const Surface& curved, Pixels& first, Pixels& second) const;
    // Whether two surfaces agree between two neighbours, within some standard deviations and an angle.
    bool agree(int p, int q, const Surface& a, const Surface& b, double tolerance, double cosine) const;

private:
    enum State : std::uint8_t { none, edge_pixel, plain };
    struct Pixel {
        float x, y, ordinate, variance;
    };

    const Pixel& at(int p) const { return pixel_[static_cast<std::size_t>(p)]; }
    double variance(const Pixel& p, double slope_x, double slope_y) const {
        return correlation_ * correlation_ * static_cast<double>(p.variance) +
               lateral_ * lateral_ * (slope_x * slope_x + slope_y * slope_y);
    }
    SurfaceSums origin_of(const Pixels& pixels) const;
    std::array<double, 3> normal(const Surface& s, double x, double y) const;

    int rows_, cols_;
    bool projective_;
    double lateral_, offset_, unit_ = 1, correlation_ = 1;
    std::array<double, 6> to_plane_;
    std::vector<Pixel> pixel_;
    std::vector<std::uint8_t> state_;
};

}  // namespace rangeedge
