// SPDX-License-Identifier: Apache-2.0
#include "regions/surface.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace rangeedge {
namespace {

// Exponents of the monomials, and where u^i v^j stands among the power sums: sorted by degree, then by j.
constexpr std::array<int, 6> power_u{0, 1, 0, 2, 1, 0}, power_v{0, 0, 1, 0, 1, 2};

constexpr std::size_t place(int i, int j) { return static_cast<std::size_t>((i + j) * (i + j + 1) / 2 + j); }

// Pivots below this share of their diagonal are taken for zero: that direction is not determined by the samples.
constexpr double dependent = 1e-9;

// Power sums of degree up to n when every u grows by a and every v by b: the binomial expansion, by repeated addition
// in place (Horner's scheme).
template <int n, std::size_t size>
void shift(std::array<double, size>& sums, double a, double b) {
    for (int j = 0; j < n; ++j)
        for (int round = 1; round <= n - j; ++round)
            for (int i = n - j; i >= round; --i) {
                sums[place(i, j)] += a * sums[place(i - 1, j)];
            }
    for (int i = 0; i < n; ++i)
        for (int round = 1; round <= n - i; ++round)
            for (int j = n - i; j >= round; --j) sums[place(i, j)] += b * sums[place(i, j - 1)];
}

}  // namespace

SurfaceSums SurfaceSums::moved(double x0, double y0, double base) const {
    SurfaceSums m = *this;
    const double d = base_ - base;
    m.square_ += d * (2 * m.product_[0] + d * m.power_[0]);
    for (std::size_t k = 0; k < 6; ++k) m.product_[k] += d * m.power_[k];
    shift<4>(m.power_, x0_ - x0, y0_ - y0);
    shift<2>(m.product_, x0_ - x0, y0_ - y0);
    m.x0_ = x0, m.y0_ = y0, m.base_ = base;
    return m;
}

void SurfaceSums::add(const SurfaceSums& other) {
    const SurfaceSums b = other.moved(x0_, y0_, base_);
    for (std::size_t k = 0; k < power_.size(); ++k) power_[k] += b.power_[k];
    for (std::size_t k = 0; k < product_.size(); ++k) product_[k] += b.product_[k];
    square_ += b.square_;
    count_ += b.count_;
}

SurfaceSums SurfaceSums::joined(const SurfaceSums& other) const {
    const double wa = power_[0], wb = other.power_[0], share = wa + wb > 0 ? wb / (wa + wb) : 0;
    SurfaceSums sum =
        moved(x0_ + share * (other.x0_ - x0_), y0_ + share * (other.y0_ - y0_), base_ + share * (other.base_ - base_));
    sum.add(other);
    return sum;
}

double SurfaceSums::rms(const Surface& surface) const {
    if (count_ == 0) return 0;
    // The surface as counted from the origin of the sums.
    const std::array<double, 6> c{surface.value(x0_, y0_) - base_,
                                  surface.slope_x(x0_, y0_),
                                  surface.slope_y(x0_, y0_),
                                  surface.c[3],
                                  surface.c[4],
                                  surface.c[5]};
    const std::size_t terms = surface.curved ? 6 : 3;
    double sum = square_;
    for (std::size_t i = 0; i < terms; ++i) {
        sum += c[i] * (c[i] * power_[place(2 * power_u[i], 2 * power_v[i])] - 2 * product_[i]);
        for (std::size_t j = 0; j < i; ++j)
            sum += 2 * c[i] * c[j] * power_[place(power_u[i] + power_u[j], power_v[i] + power_v[j])];
    }
    return std::sqrt(std::max(0.0, sum) / count_);
}

// Cholesky on the normal equations, scaled to a unit diagonal.
Surface SurfaceSums::fit(int terms) const {
    const auto n = static_cast<std::size_t>(terms);
    std::array<std::array<double, 6>, 6> l{};
    std::array<double, 6> scale{}, z{}, c{};
    for (std::size_t i = 0; i < n; ++i) {
        const double diagonal = power_[place(2 * power_u[i], 2 * power_v[i])];
        scale[i] = diagonal > 0 ? 1 / std::sqrt(diagonal) : 0;
    }
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
            double sum = scale[i] * scale[j] * power_[place(power_u[i] + power_u[j], power_v[i] + power_v[j])];
            for (std::size_t k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
            if (i == j)
                l[i][i] = sum > dependent ? std::sqrt(sum) : 0;
            else
                l[i][j] = l[j][j] > 0 ? sum / l[j][j] : 0;
        }
        double sum = scale[i] * product_[i];
        for (std::size_t k = 0; k < i; ++k) sum -= l[i][k] * z[k];
        z[i] = l[i][i] > 0 ? sum / l[i][i] : 0;
    }
    double explained = 0;
    for (std::size_t i = n; i-- > 0;) {
        double sum = z[i];
        for (std::size_t k = i + 1; k < n; ++k) sum -= l[k][i] * c[k];
        c[i] = l[i][i] > 0 ? sum / l[i][i] : 0;
        explained += z[i] * z[i];
    }
    Surface s;
    s.x0 = x0_, s.y0 = y0_, s.curved = terms > 3;
    for (std::size_t i = 0; i < n; ++i) s.c[i] = c[i] * scale[i];
    s.c[0] += base_;
    s.rms = count_ > terms ? std::sqrt(std::max(0.0, square_ - explained) / (count_ - terms)) : 0;
    return s;
}

}  // namespace rangeedge
