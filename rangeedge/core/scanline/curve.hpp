// The curve of a segment, z = f(x) = a x^2 + b x + c (paper, 4.1), and where two of them intersect (paper, Fig. 5).
//
// It is written in polynomials that are orthogonal over the samples of the segment: each coefficient is then estimated
// by itself, and independent errors of the samples give the value and the slope of the curve variances that are sums of
// squares. These turn strengths into significances, which the paper does not have.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>

namespace rangeedge {

// f(x) = base + c0 + c1 p1 + c2 p2 with p1 = x - mean and p2 = p1^2 - alpha p1 - beta, and the variances of c0, c1 and
// c2 for samples of unit variance. A line has c2 = 0 and v2 = 0; a single sample has c1 = 0 and v1 = 0 as well.
struct Curve {
    double base = 0, mean = 0, alpha = 0, beta = 0;
    double c0 = 0, c1 = 0, c2 = 0;
    double v0 = 0, v1 = 0, v2 = 0;

    double value(double x) const {
        const double p1 = x - mean;
        return base + c0 + p1 * c1 + ((p1 - alpha) * p1 - beta) * c2;
    }
    double slope(double x) const { return c1 + (2 * (x - mean) - alpha) * c2; }
    // For samples of unit variance. The slope of a single sample may be anything.
    double value_variance(double x) const {
        const double p1 = x - mean, p2 = (p1 - alpha) * p1 - beta;
        return v0 + p1 * p1 * v1 + p2 * p2 * v2;
    }
    double slope_variance(double x) const {
        const double d = 2 * (x - mean) - alpha;
        return v1 > 0 ? v1 + d * d * v2 : HUGE_VAL;
    }
};

// A curve, and the number of samples to which it was fitted.
struct Fit {
    const Curve& curve;
    int samples;
};

// Where f and g intersect, the place nearest `near`; false where they do not. Places farther than `reach` are not
// sought, but may be found.
inline bool intersection(const Curve& f, const Curve& g, double near, double reach, double& x) {
    // f - g = c + b t + a t^2 with t = x - near; the root of smaller magnitude, without cancellation.
    const double c = f.value(near) - g.value(near), b = f.slope(near) - g.slope(near), a = f.c2 - g.c2;
    if (std::abs(c) > (std::abs(b) + std::abs(a) * reach) * reach) return false;
    const double discriminant = b * b - 4 * a * c;
    if (!(discriminant >= 0)) return false;
    const double denominator = std::abs(b) + std::sqrt(discriminant);
    if (!(denominator > 0)) return false;
    x = near - (b < 0 ? -2 : 2) * c / denominator;
    return std::isfinite(x);
}

}  // namespace rangeedge
