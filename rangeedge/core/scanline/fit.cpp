// SPDX-License-Identifier: Apache-2.0
#include "scanline/fit.hpp"

#include <algorithm>

namespace rangeedge {
namespace {

// A line, the quadratic term it leaves aside, and the sums of squared residuals without and with that.
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

LineAndRest fit_line(const Moments& moments) {
    LineAndRest fit;
    Curve& line = fit.line;
    line.base = moments.base;
    line.mean = moments.origin + moments.x1 / moments.n;
    line.v0 = 1 / moments.n;
    const Moments m = moments.moved(line.mean);
    line.c0 = m.y0 / m.n;
    fit.squares = fit.curved_squares = std::max(0.0, m.yy - m.y0 * line.c0);
    if (!(m.n >= 2 && m.x2 > 0)) return fit;
    line.v1 = 1 / m.x2;
    line.c1 = m.y1 / m.x2;
    fit.squares = fit.curved_squares = std::max(0.0, fit.squares - line.c1 * m.y1);
    fit.alpha = m.x3 / m.x2;
    fit.beta = m.x2 / m.n;
    fit.norm2 = m.x4 - fit.alpha * m.x3 - fit.beta * m.x2;
    // Three samples or more at distinct places; rounding leaves a trace of a norm where there are two.
    if (m.n >= 3 && fit.norm2 > 1e-9 * m.x4) {
        fit.c2 = (m.y2 - fit.alpha * m.y1 - fit.beta * m.y0) / fit.norm2;
        fit.curved_squares = std::max(0.0, fit.squares - fit.c2 * fit.c2 * fit.norm2);
    } else {
        fit.norm2 = 0;
    }
    return fit;
}

bool curved(const Moments& moments, const LineAndRest& fit, double least) {
    return moments.n > 3 && std::abs(fit.c2) * std::sqrt(fit.norm2) > least;
}

}  // namespace

Curve fit_least_squares(const Moments& moments, double least) {
    const LineAndRest fit = fit_line(moments);
    return curved(moments, fit, least) ? fit.with_quadratic() : fit.line;
}

double residual_squares(const Moments& moments, double least) {
    const LineAndRest fit = fit_line(moments);
    return curved(moments, fit, least) ? fit.curved_squares : fit.squares;
}

Curve fit_least_squares(const Projections& p, double first, double least) {
    Curve curve;
    curve.base = p.mean;
    curve.mean = first + (p.n - 1) / 2;
    curve.v0 = 1 / p.n;
    if (p.n > 1) {
        curve.v1 = 1 / Projections::norm1(p.n);
        curve.c1 = p.y1 * curve.v1;
    }
    if (p.n > 3 && p.gain() > least * least) {
        curve.beta = Projections::beta(p.n);
        curve.v2 = 1 / Projections::norm2(p.n);
        curve.c2 = p.y2 * curve.v2;
    }
    return curve;
}

Curve fit_interpolating(const Moments& moments) {
    const LineAndRest fit = fit_line(moments);
    return fit.norm2 > 0 ? fit.with_quadratic() : fit.line;
}

}  // namespace rangeedge
