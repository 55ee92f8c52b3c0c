// SPDX-License-Identifier: Apache-2.0
#include "scanline/fit.hpp"

#include <algorithm>
#include <cmath>

namespace rangeedge {
namespace {

// A line, the quadratic term it leaves aside (none: norm2 is 0), and the sums of squared residuals without and with it.
struct LineAndRest {
    Curve line;
    double alpha = 0, beta = 0, c2 = 0, norm2 = 0;
    double squares = 0, curved_squares = 0;

    Curve with_quadratic() const {
        Curve curve = line;
        curve.alpha = alpha;
        curve.beta = beta;
        curve.c2 = c2;
        curve.v2 = 1 / norm2;
        return curve;
    }
};

// The coefficients c_i = sum y p_i / sum p_i^2 of the polynomials p_i of curve.hpp, which are orthogonal over the
// samples: with those the normal equations of z = a x^2 + b x + c (paper, 4.2) fall apart. Of samples at any abscissas.
LineAndRest fit_line(const PowerSums& sums) {
    LineAndRest fit;
    Curve& line = fit.line;
    line.base = sums.base;
    line.mean = sums.origin + sums.x1 / sums.n;
    line.v0 = 1 / sums.n;
    const PowerSums m = sums.moved(line.mean);
    line.c0 = m.y0 / m.n;
    fit.squares = fit.curved_squares = std::max(0.0, m.yy - m.y0 * line.c0);
    if (!(m.n >= 2 && m.x2 > 0)) return fit;
    line.v1 = 1 / m.x2;
    line.c1 = m.y1 / m.x2;
    fit.squares = fit.curved_squares = std::max(0.0, fit.squares - line.c1 * m.y1);
    fit.alpha = m.x3 / m.x2;
    fit.beta = m.x2 / m.n;
    fit.norm2 = m.x4 - fit.alpha * m.x3 - fit.beta * m.x2;
    constexpr double rounding = 1e-9;  // what it leaves of a norm that is 0, of samples at two places
    if (m.n >= 3 && fit.norm2 > rounding * m.x4) {
        fit.c2 = (m.y2 - fit.alpha * m.y1 - fit.beta * m.y0) / fit.norm2;
        fit.curved_squares = std::max(0.0, fit.squares - fit.c2 * fit.c2 * fit.norm2);
    } else {
        fit.norm2 = 0;
    }
    return fit;
}

bool curved(const PowerSums& sums, const LineAndRest& fit, double least) {
    return sums.n > 3 && std::abs(fit.c2) * std::sqrt(fit.norm2) > least;
}

}  // namespace

Curve fit_least_squares(const PowerSums& sums, double least) {
    const LineAndRest fit = fit_line(sums);
    return curved(sums, fit, least) ? fit.with_quadratic() : fit.line;
}

double residual_squares(const PowerSums& sums, double least) {
    const LineAndRest fit = fit_line(sums);
    return curved(sums, fit, least) ? fit.curved_squares : fit.squares;
}

// The same c_i of samples at equal distances, of images with a regular grid or a camera: the sums hold sum y p_i.
Curve fit_least_squares(const OrthogonalSums& p, double first, double least) {
    Curve curve;
    curve.base = p.mean;
    curve.mean = first + (p.n - 1) / 2;
    curve.v0 = 1 / p.n;
    if (p.n > 1) {
        curve.v1 = 1 / OrthogonalSums::norm1(p.n);
        curve.c1 = p.y1 * curve.v1;
    }
    if (p.n > 3 && p.gain() > least * least) {
        curve.beta = OrthogonalSums::beta(p.n);
        curve.v2 = 1 / OrthogonalSums::norm2(p.n);
        curve.c2 = p.y2 * curve.v2;
    }
    return curve;
}

Curve fit_interpolating(const PowerSums& sums) {
    const LineAndRest fit = fit_line(sums);
    return fit.norm2 > 0 ? fit.with_quadratic() : fit.line;
}

}  // namespace rangeedge
