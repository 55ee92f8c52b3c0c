// SPDX-License-Identifier: Apache-2.0
#include "fit.hpp"

#include <algorithm>

namespace rangeedge {
namespace {

// The curve of degree 1, and the quadratic term it leaves aside.
struct LineAndRest {
    Curve line;
    double alpha = 0, beta = 0, c2 = 0, norm2 = 0;
};

LineAndRest fit_line(const Moments& moments) {
    LineAndRest fit;
    Curve& line = fit.line;
    line.base = moments.base;
    line.mean = moments.origin + moments.x1 / moments.n;
    line.n = moments.n;
    const Moments m = moments.moved(line.mean);
    line.c0 = m.y0 / m.n;
    const double total = std::max(0.0, m.yy - m.y0 * line.c0);
    if (!(m.n >= 2 && m.x2 > 0)) {
        line.sum_squares = total;
        return fit;
    }
    line.norm1 = m.x2;
    line.c1 = m.y1 / m.x2;
    line.sum_squares = std::max(0.0, total - line.c1 * m.y1);
    fit.alpha = m.x3 / m.x2;
    fit.beta = m.x2 / m.n;
    fit.norm2 = m.x4 - fit.alpha * m.x3 - fit.beta * m.x2;
    // Three samples or more at distinct places; rounding leaves a trace of a norm where there are two.
    if (m.n >= 3 && fit.norm2 > 1e-9 * m.x4)
        fit.c2 = (m.y2 - fit.alpha * m.y1 - fit.beta * m.y0) / fit.norm2;
    else
        fit.norm2 = 0;
    return fit;
}

Curve with_quadratic(const LineAndRest& fit) {
    Curve curve = fit.line;
    curve.alpha = fit.alpha;
    curve.beta = fit.beta;
    curve.c2 = fit.c2;
    curve.norm2 = fit.norm2;
    curve.sum_squares = std::max(0.0, curve.sum_squares - fit.c2 * fit.c2 * fit.norm2);
    return curve;
}

}  // namespace

Curve fit_least_squares(const Moments& moments, double least) {
    const LineAndRest fit = fit_line(moments);
    const bool curved = moments.n > 3 && std::abs(fit.c2) * std::sqrt(fit.norm2) > least;
    return curved ? with_quadratic(fit) : fit.line;
}

Curve fit_least_squares(const Projections& p, double first, double least) {
    Curve curve;
    curve.base = p.mean;
    curve.mean = first + (p.n - 1) / 2;
    curve.n = p.n;
    curve.sum_squares = residual_squares(p, least);
    if (p.n > 1) {
        curve.norm1 = Projections::norm1(p.n);
        curve.c1 = p.y1 / curve.norm1;
    }
    if (p.n > 3 && p.gain() > least * least) {
        curve.beta = Projections::beta(p.n);
        curve.norm2 = Projections::norm2(p.n);
        curve.c2 = p.y2 / curve.norm2;
    }
    return curve;
}

Curve fit_interpolating(const Moments& moments) {
    const LineAndRest fit = fit_line(moments);
    return fit.norm2 > 0 ? with_quadratic(fit) : fit.line;
}

}  // namespace rangeedge
