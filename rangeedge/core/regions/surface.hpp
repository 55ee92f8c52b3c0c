// Surfaces over the image plane: least-squares planes and quadratics of an ordinate.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace rangeedge {

constexpr double curved_gain = 0.8;  // a quadratic must lower the rms of a plane to this share
constexpr int least_curved = 40;     // pixels of a quadratic; fewer tell no curvature

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

// Weighted power sums of samples, counted from an origin that is set once. All that a least-squares fit needs of any
// number of pixels stands in 22 numbers, and those of two sets of pixels add up to those of both.
class SurfaceSums {
public:
    SurfaceSums() = default;
    SurfaceSums(double x0, double y0, double base) : x0_(x0), y0_(y0), base_(base) {}

    void add(const Sample& s) {
        const double u = s.x - x0_, v = s.y - y0_, f = s.ordinate - base_, w = s.weight, wf = w * f;
        const double uu = u * u, uv = u * v, vv = v * v;
        // Term by term: an array of them would be written in parts and read as a whole, for which a processor waits.
        power_[0] += w, power_[1] += w * u, power_[2] += w * v, power_[3] += w * uu, power_[4] += w * uv;
        power_[5] += w * vv, power_[6] += w * (u * uu), power_[7] += w * (u * uv), power_[8] += w * (u * vv);
        power_[9] += w * (v * vv), power_[10] += w * (uu * uu), power_[11] += w * (uu * uv);
        power_[12] += w * (uu * vv), power_[13] += w * (uv * vv), power_[14] += w * (vv * vv);
        product_[0] += wf, product_[1] += wf * u, product_[2] += wf * v;
        product_[3] += wf * uu, product_[4] += wf * uv, product_[5] += wf * vv;
        square_ += wf * f;
        ++count_;
    }
    // Only what a plane takes.
    void add_to_plane(const Sample& s) {
        const double u = s.x - x0_, v = s.y - y0_, f = s.ordinate - base_, w = s.weight;
        const std::array<double, 6> term{1, u, v, u * u, u * v, v * v};
        for (std::size_t k = 0; k < 6; ++k) power_[k] += w * term[k];
        for (std::size_t k = 0; k < 3; ++k) product_[k] += w * f * term[k];
        square_ += w * f * f;
        ++count_;
    }
    // n samples of a column at x, of which sums are known, with v = y - y0 and f = ordinate - base: those of w v^0 to
    // w v^4, of w f v^0 to w f v^2, and of w f^2.
    void add_column(double x, int n, const std::array<double, 5>& w, const std::array<double, 3>& wf, double wff) {
        const double u = x - x0_, uu = u * u, uuu = u * uu;
        power_[0] += w[0], power_[1] += u * w[0], power_[2] += w[1], power_[3] += uu * w[0], power_[4] += u * w[1];
        power_[5] += w[2], power_[6] += uuu * w[0], power_[7] += uu * w[1], power_[8] += u * w[2], power_[9] += w[3];
        power_[10] += uu * uu * w[0], power_[11] += uuu * w[1], power_[12] += uu * w[2], power_[13] += u * w[3];
        power_[14] += w[4];
        product_[0] += wf[0], product_[1] += u * wf[0], product_[2] += wf[1];
        product_[3] += uu * wf[0], product_[4] += u * wf[1], product_[5] += wf[2];
        square_ += wff;
        count_ += n;
    }
    // The samples of another set, too.
    void add(const SurfaceSums& other);

    int count() const { return count_; }
    double weight() const { return power_[0]; }
    // The mean ordinate, and the mean place.
    double mean_ordinate() const { return base_ + (power_[0] > 0 ? product_[0] / power_[0] : 0); }
    double mean_x() const { return x0_ + (power_[0] > 0 ? power_[1] / power_[0] : 0); }
    double mean_y() const { return y0_ + (power_[0] > 0 ? power_[2] / power_[0] : 0); }

    // The sums of two sets together, counted from about the middle of both.
    SurfaceSums joined(const SurfaceSums& other) const;

    // Root mean square of the weighted residuals from a surface.
    double rms(const Surface& surface) const;

    Surface plane() const { return fit(3); }
    Surface quadratic() const { return fit(6); }

private:
    SurfaceSums moved(double x0, double y0, double base) const;
    Surface fit(int terms) const;

    double x0_ = 0, y0_ = 0, base_ = 0;
    int count_ = 0;
    std::array<double, 15> power_{};   // of u^i v^j, i + j <= 4
    std::array<double, 6> product_{};  // of the ordinate with 1, u, v, u^2, u v, v^2
    double square_ = 0;                // of the ordinate
};

}  // namespace rangeedge
