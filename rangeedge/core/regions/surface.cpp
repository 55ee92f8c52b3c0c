// SPDX-License-Identifier: Apache-2.0
#include "surface.hpp"

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

}  // namespace

SurfaceSums SurfaceSums::moved(double x0, double y0, double base) const {
    static constexpr int choose[5][5] = {{1}, {1, 1}, {1, 2, 1}, {1, 3, 3, 1}, {1, 4, 6, 4, 1}};
    std::array<double, 5> a{1}, b{1};
    for (std::size_t k = 1; k < 5; ++k) a[k] = a[k - 1] * (x0_ - x0), b[k] = b[k - 1] * (y0_ - y0);
    const double d = base_ - base;
    SurfaceSums m(x0, y0, base);
    m.count_ = count_;
    for (int degree = 0; degree <= 4; ++degree)
        for (int j = 0; j <= degree; ++j)
            for (int k = 0, i = degree - j; k <= i; ++k)
                for (int l = 0; l <= j; ++l) {
                    const std::size_t from = place(k, l), to = place(i, j);
                    const double factor = choose[i][k] * a[static_cast<std::size_t>(i - k)] * choose[j][l] *
                                          b[static_cast<std::size_t>(j - l)];
                    m.power_[to] += factor * power_[from];
                    if (degree <= 2) m.product_[to] += factor * (product_[from] + d * power_[from]);
                }
    m.square_ = square_ + d * (2 * product_[0] + d * power_[0]);
    return m;
}

SurfaceSums SurfaceSums::joined(const SurfaceSums& other) const {
    const double wa = power_[0], wb = other.power_[0], share = wa + wb > 0 ? wb / (wa + wb) : 0;
    const double x = x0_ + share * (other.x0_ - x0_), y = y0_ + share * (other.y0_ - y0_);
    const double base = base_ + share * (other.base_ - base_);
    SurfaceSums sum = moved(x, y, base);
    const SurfaceSums b = other.moved(x, y, base);
    for (std::size_t k = 0; k < power_.size(); ++k) sum.power_[k] += b.power_[k];
    for (std::size_t k = 0; k < product_.size(); ++k) sum.product_[k] += b.product_[k];
    sum.square_ += b.square_;
    sum.count_ += b.count_;
    return sum;
}

double SurfaceSums::rms(const Surface& surface) const {
    const SurfaceSums here = moved(surface.x0, surface.y0, base_);
    std::array<double, 6> c = surface.c;
    c[0] -= base_;
    double sum = here.square_;
    for (std::size_t i = 0; i < c.size(); ++i) {
        sum -= 2 * c[i] * here.product_[i];
        for (std::size_t j = 0; j < c.size(); ++j)
            sum += c[i] * c[j] * here.power_[place(power_u[i] + power_u[j], power_v[i] + power_v[j])];
    }
    return count_ > 0 ? std::sqrt(std::max(0.0, sum) / count_) : 0;
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
