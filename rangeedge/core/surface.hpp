// Surfaces over the image plane: least-squares planes and quadratics of an ordinate.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace rangeedge {

// One pixel: its place on the image plane in about pixels, its ordinate, and 1 / variance of the latter.
struct Sample {
    double x, y, ordinate, weight;
};

// f(x, y) = c0 + c1 u + c2 v + c3 u^2 + c4 u v + c5 v^2 with u = x - x0, v = y - y0.
struct Surface {
    double x0 = 0, y0 = 0;
    std::array<double, 6> c{};
    double rms = 0;  // of the weighted residuals
    bool curved = false;

    double value(double x, double y) const {
        const double u = x - x0, v = y - y0;
        return c[0] + u * (c[1] + u * c[3] + v * c[4]) + v * (c[2] + v * c[5]);
    }
    double value_on_plane(double x, double y) const { return c[0] + (x - x0) * c[1] + (y - y0) * c[2]; }
    double slope_x(double x, double y) const { return c[1] + 2 * c[3] * (x - x0) + c[4] * (y - y0); }
    double slope_y(double x, double y) const { return c[2] + c[4] * (x - x0) + 2 * c[5] * (y - y0); }
};

// Weighted power sums of samples, counted from an origin that is set once.
class SurfaceSums {
public:
    SurfaceSums() = default;
    SurfaceSums(double x0, double y0, double base) : x0_(x0), y0_(y0), base_(base) {}

    void add(const Sample& s);
    // Only what a plane takes.
    void add_to_plane(const Sample& s) {
        const double u = s.x - x0_, v = s.y - y0_, f = s.ordinate - base_, w = s.weight;
        const std::array<double, 6> term{1, u, v, u * u, u * v, v * v};
        for (std::size_t k = 0; k < 6; ++k) power_[k] += w * term[k];
        for (std::size_t k = 0; k < 3; ++k) product_[k] += w * f * term[k];
        square_ += w * f * f;
        ++count_;
    }
    int count() const { return count_; }
    double x0() const { return x0_; }
    double y0() const { return y0_; }
    double base() const { return base_; }

    // The same sums counted from another origin, and those of two sets together.
    SurfaceSums moved(double x0, double y0, double base) const;
    SurfaceSums joined(const SurfaceSums& other) const;

    // Root mean square of the weighted residuals from a surface.
    double rms(const Surface& surface) const;

    Surface plane() const { return fit(3); }
    Surface quadratic() const { return fit(6); }

private:
    Surface fit(int terms) const;

    double x0_ = 0, y0_ = 0, base_ = 0;
    int count_ = 0;
    std::array<double, 15> power_{};   // of u^i v^j, i + j <= 4
    std::array<double, 6> product_{};  // of the ordinate with 1, u, v, u^2, u v, v^2
    double square_ = 0;                // of the ordinate
};

}  // namespace rangeedge
