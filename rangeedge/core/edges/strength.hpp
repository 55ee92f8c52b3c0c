// The strengths of an edge candidate and its type (paper, 4.2 and Fig. 4).
//
// Between the segments of curves f1 and f2, which end at the samples x1 and x2, the paper defines at x = (x1 + x2) / 2
//
//     jump    |f1(x) - f2(x)|
//     crease  the angle between the normals (-f1'(x), 1) and (-f2'(x), 1)
//     convex  f1'(x) > f2'(x), else concave
//
// or alternatively, extrapolating from the end points by z1 + f1'(x1) (x - x1) and z2 - f2'(x2) (x2 - x),
//
//     jump    |(z1 + f1'(x1) (x - x1)) - (z2 - f2'(x2) (x2 - x))|
//     crease  the angle between the normals (-f1'(x1), 1) and (-f2'(x2), 1)
//     convex  f1'(x1) > f2'(x2), else concave
//
// Here x is the position of the edge, the midpoint being the case without adaptation. Jumps are compared as depths,
// normals in the plane of the scan line (line.hpp), and every strength has a standard deviation, by which candidates of
// noise are told from edges.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>

#include "base/angle.hpp"
#include "scanline/curve.hpp"
#include "scanline/line.hpp"

namespace rangeedge {

// What one of the curves says of the edge.
struct EdgeSide {
    double ordinate;  // expected at the edge
    double slope;     // f'
    Tangent tangent;
    double value_variance, slope_variance;  // for samples of unit variance
    double angle_per_slope;
};

// The standard deviations of the value and the slope that a curve has by the noise, of one line and of neighbouring
// lines together.
struct SideDeviation {
    double value, slope, shared_value, shared_slope;
};

// Of a fit to n samples, beside sample k.
template <class T>
SideDeviation deviation_of(const Line<T>& line, const EdgeSide& f, int k, int n) {
    const FitNoise& noise = *line.noise;
    const double sigma = line.sigma_of_fit_at(k, n);
    const double value = sigma * std::sqrt(f.value_variance), slope = sigma * std::sqrt(f.slope_variance);
    return {noise.value[n] * value, noise.slope[n] * slope, noise.shared_value[n] * value,
            noise.shared_slope[n] * slope};
}

// First form: the curve at the position x of the edge.
template <class T>
EdgeSide at_midpoint(const Line<T>& line, const Curve& f, double x) {
    const double z = f.value(x), slope = f.slope(x);
    const Tangent tangent = line.tangent(x, z, slope);
    return {z, slope, tangent, f.value_variance(x), f.slope_variance(x), line.angle_per_slope(tangent, z)};
}

// Second form: extrapolated to x from an end point, the sample k, z1 + f'(x1) (x - x1).
template <class T>
EdgeSide from_endpoint(const Line<T>& line, const Curve& f, int k, double x) {
    const double x1 = line.abscissa(k), z1 = line.ordinate(k), slope = f.slope(x1);
    const Tangent tangent = line.tangent(x1, z1, slope);
    return {z1 + slope * (x - x1),
            slope,
            tangent,
            f.value_variance(x1),
            f.slope_variance(x1),
            line.angle_per_slope(tangent, z1)};
}

// |f1(x) - f2(x)|, a length.
template <class T>
double jump_strength(const Line<T>& line, const EdgeSide& f1, const EdgeSide& f2) {
    return std::abs(line.depth(f1.ordinate) - line.depth(f2.ordinate));
}

// The angle between the normals, in degrees: that between the tangents.
inline double crease_strength(const EdgeSide& f1, const EdgeSide& f2) {
    return angle_between(cross(f1.tangent, f2.tangent), dot(f1.tangent, f2.tangent));
}

// f1' > f2': on a grid, with the tangents (1, -f1') and (1, -f2'), their cross product is f1' - f2'.
inline bool is_convex(const EdgeSide& f1, const EdgeSide& f2) { return cross(f1.tangent, f2.tangent) > 0; }

// The standard deviations of f1(x) - f2(x), an ordinate, and of the crease in degrees, by those of either side.
inline double jump_deviation(double value1, double value2) { return std::hypot(value1, value2); }
inline double crease_deviation(const EdgeSide& f1, double slope1, const EdgeSide& f2, double slope2) {
    return degrees_per_radian * std::hypot(f1.angle_per_slope * slope1, f2.angle_per_slope * slope2);
}

}  // namespace rangeedge
