// Sums over the samples of a segment, all that a least-squares fit needs of them. The sums of two adjacent segments
// give those of both together, so that a fit across a cut costs nothing more than a few products.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>

namespace rangeedge {

// Of samples anywhere: powers of x, counted from `origin`, and their products with y, counted from `base`.
struct PowerSums {
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
    PowerSums moved(double to) const {
        const double d = origin - to, d2 = d * d;
        PowerSums m = *this;
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
    PowerSums rebased(double to) const {
        const double d = base - to;
        PowerSums m = *this;
        m.base = to;
        m.y0 = y0 + d * n;
        m.y1 = y1 + d * x1;
        m.y2 = y2 + d * x2;
        m.yy = yy + 2 * d * y0 + d * d * n;
        return m;
    }
};

// Counted from the common mean of x, and from the base of the first.
inline PowerSums operator+(const PowerSums& a, const PowerSums& b) {
    PowerSums sum = a;
    const PowerSums o = b.rebased(a.base).moved(a.origin);
    sum.n += o.n, sum.x1 += o.x1, sum.x2 += o.x2, sum.x3 += o.x3, sum.x4 += o.x4;
    sum.y0 += o.y0, sum.y1 += o.y1, sum.y2 += o.y2, sum.yy += o.yy;
    return sum.moved(sum.origin + sum.x1 / sum.n);
}

// Of n samples one unit apart. The orthogonal polynomials over these depend on n alone: with t counted from the middle
// of the samples, p1 = t and p2 = t^2 - beta, beta = (n^2 - 1) / 12 being the mean of t^2. What is left are the mean of
// y and the sums of its products with p1 and p2.
struct OrthogonalSums {
    double n = 0, mean = 0, y1 = 0, y2 = 0;
    double squares = 0;  // of the distances from the mean

    static double beta(double n) { return (n * n - 1) / 12; }
    // The sums of p1^2 and p2^2.
    static double norm1(double n) { return n * beta(n); }
    static double norm2(double n) { return norm1(n) * (n * n - 4) / 15; }
    // By how much the quadratic term lowers the sum of squared residuals.
    double gain() const { return y2 * y2 / norm2(n); }
};

// Of the samples of a, and of b on their right. The common middle lies nb / 2 to the right of a's and na / 2 to the
// left of b's, so that p1 is p1a - nb / 2 on a and p1b + na / 2 on b; the common mean is mean + nb / n step on a and
// less na / n step on b. Multiplied out, with na nb / n step = moved, nothing but the following is left, since the sums
// of y - mean, p1 and p2 vanish on a and on b, and beta(nb) - beta(na) + (na^2 - nb^2) / 4 = (na - nb) n / 6.
inline OrthogonalSums operator+(const OrthogonalSums& a, const OrthogonalSums& b) {
    const double n = a.n + b.n, step = b.mean - a.mean, product = a.n * b.n;
    const double moved = product / n * step;  // b's sum of distances from the common mean, and less a's
    OrthogonalSums both;
    both.n = n;
    both.mean = a.mean + b.n / n * step;
    both.squares = a.squares + b.squares + moved * step;
    both.y1 = a.y1 + b.y1 + product / 2 * step;
    both.y2 = a.y2 + b.y2 + a.n * b.y1 - b.n * a.y1 + moved * (a.n - b.n) * n / 6;
    return both;
}

// Of n samples one unit apart as they are summed up: h = y - base, t counted from the first one.
struct RawSums {
    double h, ht, htt, hh;
};

inline OrthogonalSums orthogonal(double n, double base, const RawSums& s) {
    const double middle = (n - 1) / 2, mean = s.h / n;
    OrthogonalSums p;
    p.n = n;
    p.mean = base + mean;
    p.y1 = s.ht - middle * s.h;
    p.y2 = s.htt - 2 * middle * s.ht + (middle * middle - OrthogonalSums::beta(n)) * s.h;
    p.squares = std::max(0.0, s.hh - s.h * mean);
    return p;
}

}  // namespace rangeedge
