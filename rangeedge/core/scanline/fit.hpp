// The curves of segments: by least squares over all samples, which gives the paper its best results (paper, 4.2, end),
// or through both end points and the midpoint, as splitting has them (paper, 4.1).
//
// Least squares give a straight line unless the quadratic term is significant: a term that noise alone makes bends
// curves where they are compared, beyond their ends.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>

#include "scanline/curve.hpp"
#include "scanline/sums.hpp"

namespace rangeedge {

// The quadratic term is kept only where it exceeds `least` of the standard deviations it has with samples of unit
// variance. Three samples fix a quadratic, but nothing then tells noise from curvature.
Curve fit_least_squares(const PowerSums& sums, double least);
Curve fit_least_squares(const OrthogonalSums& sums, double first, double least);  // `first`: the first abscissa

// The sum of squared residuals of that curve.
double residual_squares(const PowerSums& sums, double least);
inline double residual_squares(const OrthogonalSums& p, double least) {
    const double line = p.n > 1 ? p.squares - p.y1 * p.y1 / OrthogonalSums::norm1(p.n) : 0;
    const double gain = p.n > 3 ? p.gain() : 0;
    return std::max(0.0, line - (gain > least * least ? gain : 0));
}

// The quadratic, or line, or constant through the given samples (one to three of them).
Curve fit_interpolating(const PowerSums& sums);

}  // namespace rangeedge
