// The curve of a segment (paper, end of section 4.2): a least-squares line or quadratic with its covariance.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>

namespace rangeedge {

// Power sums of samples (x, y), x counted from `origin` and y from `base`.
struct Moments {
    double origin = 0, base = 0;
    double n = 0, x1 = 0, x2 = 0, x3 = 0, x4 = 0;
    double y0 = 0, y1 = 0, y2 = 0, yy = 0;

    void add(double x, double y) {
        const double t = x - origin, t2 = t * t, h = y - base;
        n += 1;
        x1 += t, x2 += t2, x3 += t * t2, x4 += t2 * t2;
        y0 += h, y1 += h * t, y2 += h * t2, yy += h * h;
    }
    // The same sums, counted from another origin.
    Moments moved(double to) const {
        const double d = origin - to, d2 = d * d;
        Moments m = *this;
        m.origin = to;
        m.x1 = x1 + d * n;
        m.x2 = x2 + 2 * d * x1 + d2 * n;
        m.x3 = x3 + 3 * d * x2 + 3 * d2 * x1 + d * d2 * n;
        m.x4 = x4 + 4 * d * x3 + 6 * d2 * x2 + 4 * d * d2 * x1 + d2 * d2 * n;
        m.y1 = y1 + d * y0;
        m.y2 = y2 + 2 * d * y1 + d2 * y0;
        return m;
    }
    // The same sums, with y counted from another base.
    Moments rebased(double to) const {
        const double d = base - to;
        Moments m = *this;
        m.base = to;
        m.y0 = y0 + d * n;
        m.y1 = y1 + d * x1;
        m.y2 = y2 + d * x2;
        m.yy = yy + 2 * d * y0 + d * d * n;
        return m;
    }
    // Adds the sums of other samples, counted from the same base.
    Moments& operator+=(const Moments& other) {
        const Moments o = other.moved(origin);
        n += o.n, x1 += o.x1, x2 += o.x2, x3 += o.x3, x4 += o.x4;
        y0 += o.y0, y1 += o.y1, y2 += o.y2, yy += o.yy;
        return *this;
    }
};

// The sums over both segments, the second one next to the first, counted from their common mean.
inline Moments joined(const Moments& a, const Moments& b) {
    Moments sum = a;
    sum += b.rebased(a.base);
    return sum.moved(sum.origin + sum.x1 / sum.n);
}

// f(x) = c0 + c1 p1 + c2 p2 in the polynomials p1 = x - mean and p2 = p1^2 - alpha p1 - beta, which are orthogonal
// over the samples, with the variances of c0, c1 and c2 for samples of unit variance. A line has c2 = 0 and v2 = 0; a
// single sample has c1 = 0 and v1 = 0 as well.
struct Curve {
    double base = 0, mean = 0, alpha = 0, beta = 0;
    double c0 = 0, c1 = 0, c2 = 0;
    double v0 = 0, v1 = 0, v2 = 0;

    double value(double x) const {
        const double p1 = x - mean;
        return base + c0 + p1 * c1 + ((p1 - alpha) * p1 - beta) * c2;
    }
    double slope(double x) const { return c1 + (2 * (x - mean) - alpha) * c2; }
    // Variances for samples of unit variance; a slope that the samples do not fix has none: infinite.
    double value_variance(double x) const {
        const double p1 = x - mean, p2 = (p1 - alpha) * p1 - beta;
        return v0 + p1 * p1 * v1 + p2 * p2 * v2;
    }
    double slope_variance(double x) const {
        const double d = 2 * (x - mean) - alpha;
        return v1 > 0 ? v1 + d * d * v2 : HUGE_VAL;
    }
};

// The same for samples one unit apart, whose polynomials depend on their number alone: p1 = x - mean and
// p2 = p1^2 - (n^2 - 1) / 12. The ordinates are given by their mean and their products with p1 and p2.
struct Projections {
    double n = 0, mean = 0, y1 = 0, y2 = 0;
    double squares = 0;  // of the distances from the mean

    static double beta(double n) { return (n * n - 1) / 12; }
    static double norm1(double n) { return n * beta(n); }
    static double norm2(double n) { return norm1(n) * (n * n - 4) / 15; }
    // By how much the quadratic term lowers the sum of squared residuals.
    double gain() const { return y2 * y2 / norm2(n); }
};

inline Projections joined(const Projections& a, const Projections& b) {
    const double n = a.n + b.n, step = b.mean - a.mean, product = a.n * b.n;
    const double moved = product / n * step;  // b's sum of distances from the common mean, and less a's
    Projections both;
    both.n = n;
    both.mean = a.mean + b.n / n * step;
    both.squares = a.squares + b.squares + moved * step;
    both.y1 = a.y1 + b.y1 + product / 2 * step;
    both.y2 = a.y2 + b.y2 + a.n * b.y1 - b.n * a.y1 + moved * (a.n - b.n) * n / 6;
    return both;
}

// Least squares. The quadratic term is kept only where it exceeds `least` of the standard deviations it has with
// samples of unit variance. Three samples fix a quadratic, but nothing then tells noise from curvature.
Curve fit_least_squares(const Moments& moments, double least);
Curve fit_least_squares(const Projections& projections, double first, double least);  // `first`: the first abscissa

// The sum of squared residuals of that curve.
double residual_squares(const Moments& moments, double least);
inline double residual_squares(const Projections& p, double least) {
    const double line = p.n > 1 ? p.squares - p.y1 * p.y1 / Projections::norm1(p.n) : 0;
    const double gain = p.n > 3 ? p.gain() : 0;
    return std::max(0.0, line - (gain > least * least ? gain : 0));
}

// The quadratic, or line, or constant through the given samples (one to three of them).
Curve fit_interpolating(const Moments& moments);

}  // namespace rangeedge
