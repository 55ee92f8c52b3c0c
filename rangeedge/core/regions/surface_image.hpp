// A range image in units of its noise: how far pixels lie off surfaces, and where surfaces agree with each other.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/array.hpp"
#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "image/noise.hpp"
#include "regions/surface.hpp"

namespace rangeedge {

// Maps of rows * cols pixels. Planes of the scene are affine functions ordinate(x, y).
struct RangeMap {
    int rows, cols;
    const float* x;         // place on the image plane, neighbours about 1 apart; null: the column
    const float* y;         // null: the row
    const float* ordinate;  // grows toward the viewer, less `offset`; NaN: no data
    double offset;
    double rounding;                 // of ordinates, before `offset` was taken away
    bool projective;                 // the ordinate is inverse depth, else height
    std::array<double, 6> to_plane;  // (x, y, 1) to normalised image coordinates, or to lengths
    Noise noise;                     // of lengths
    const std::uint8_t* edges;       // non-zero: edge; null: none
};

using Pixels = std::vector<int>;

constexpr double lateral_deviation = 0.15;  // pixels: by how much a sample may stem from beside its line of sight
constexpr int least_pixels = 12;            // of a surface
constexpr double correlation_max = 8;       // noise over a region, in units of that between neighbours

// Pixels are known by their index in a copy with a margin of one pixel, so that each has all its neighbours.
class SurfaceImage {
public:
    enum State : std::uint8_t { none, open_pixel, edge_pixel };  // none: without data

    // `lateral` is the standard deviation of a pixel's place, in pixels.
    SurfaceImage(const RangeMap& map, double lateral, Team& team);

    int rows() const { return rows_; }
    int cols() const { return cols_; }
    int stride() const { return cols_ + 2; }
    int size() const { return (rows_ + 2) * stride(); }
    int index(int row, int col) const { return (row + 1) * stride() + col + 1; }
    std::array<int, 4> neighbours() const { return {-stride(), -1, 1, stride()}; }

    const Array<std::uint8_t>& states() const { return state_; }
    State state(int p) const { return static_cast<State>(state_[p]); }
    bool open(int p) const { return state_[p] == open_pixel; }
    bool edge(int p) const { return state_[p] == edge_pixel; }
    // Whether an edge runs between two neighbours, or along them a pixel away; not whether one runs across both.
    bool edge_between(int p, int q) const {
        const int step = q - p;
        return edge(p - step) || edge(p) || edge(q) || edge(q + step);
    }

    // The standard deviation of pixels from the surface of their region, in units of that between neighbours.
    double correlation() const { return correlation_; }
    // Over how many pixels the noise is the same.
    double correlation_area() const { return correlation_area_; }
    void set_correlation(double correlation, double area) { correlation_ = correlation, correlation_area_ = area; }

    Sample sample(int p) const {
        const Pixel& s = at(p);
        return {static_cast<double>(s.x), static_cast<double>(s.y), static_cast<double>(s.ordinate),
                1 / static_cast<double>(s.variance)};
    }

    // Says that a pixel is going to be read: those along borders are scattered over memory.
    void prefetch(int p) const { __builtin_prefetch(&at(p)); }

    // Square of the distance of a pixel from a surface in standard deviations: of the noise over a region, and of the
    // pixel's place.
    double residual(int p, const Surface& s) const {
        const Pixel& pixel = at(p);
        const double x = static_cast<double>(pixel.x), y = static_cast<double>(pixel.y);
        if (!s.curved) {
            const double d = static_cast<double>(pixel.ordinate) - s.value_on_plane(x, y);
            return d * d / variance(static_cast<double>(pixel.variance), s.c[1], s.c[2]);
        }
        const double d = static_cast<double>(pixel.ordinate) - s.value(x, y);
        return d * d / variance(static_cast<double>(pixel.variance), s.slope_x(x, y), s.slope_y(x, y));
    }
    // The mean of the same over a set of pixels.
    double residual(const SurfaceSums& sums, const Surface& s) const;

    SurfaceSums sums_of(const Pixels& pixels) const;
    // Sums of no pixels yet, counted from the middle of these.
    SurfaceSums origin_of(const Pixels& pixels) const;
    // A plane unless a quadratic is much better.
    Surface surface_of(const SurfaceSums& sums) const;
    bool is_flat(const Surface& surface) const;

    // How two surfaces go on into each other between two neighbouring pixels.
    struct Continuation {
        double gap;     // squared, in variances of a pixel
        double cosine;  // of the angle between their normals
    };
    Continuation continuation(int p, int q, const Surface& a, const Surface& b) const;

    // Whether x and y are columns and rows.
    bool regular() const { return regular_; }
    // Sums down the columns of some rows, of which samples have v = -rows / 2, ... and f = ordinate - base; for each of
    // n columns. Where a pixel is not open a sum says nothing, and `closed` is set.
    struct ColumnSums {
        double *w[5], *wf[3], *wff;
        std::uint8_t* closed;
    };
    void sum_columns(int first, int rows, int n, const double* base, const ColumnSums& sums) const;

private:
    struct Pixel {
        float x, y, ordinate, variance;
    };

    void fill_row(const RangeMap& map, int row, const double* sigma);
    const Pixel& at(int p) const { return pixel_[static_cast<std::size_t>(p)]; }
    double variance(double variance, double slope_x, double slope_y) const {
        return correlation_ * correlation_ * variance + lateral_ * lateral_ * (slope_x * slope_x + slope_y * slope_y);
    }
    std::array<double, 3> normal(const Surface& s, double x, double y) const;

    int rows_, cols_;
    bool projective_, regular_;
    double lateral_, offset_, unit_ = 1, correlation_ = 1, correlation_area_ = 1;
    std::array<double, 6> to_plane_;
    LargeVector<Pixel> pixel_;
    Array<std::uint8_t> state_;
};

}  // namespace rangeedge
