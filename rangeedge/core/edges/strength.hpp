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
#include <algorithm>
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

// A standard deviation by the noise, of what one scan line tells, and of what it tells as one of several neighbours.
struct FitDeviation {
    double single, shared;
};

// Of the slope and of the value of a fit to n samples with noise of `sigma`, by their variances for white noise of unit
// variance.
inline FitDeviation slope_deviation(const FitNoise& noise, double sigma, int n, double variance) {
    const double white = sigma * std::sqrt(variance);
    return {noise.slope[n] * white, noise.shared_slope[n] * white};
}
inline FitDeviation value_deviation(const FitNoise& noise, double sigma, int n, double variance) {
    const double white = sigma * std::sqrt(variance);
    return {noise.value[n] * white, noise.shared_value[n] * white};
}

// First form: the curve at the position x of the edge.
template <class T>
EdgeSide at_position(const Line<T>& line, const Curve& f, double x) {
    const double z = f.value(x), slope = f.slope(x);
    const Tangent tangent = line.tangent(x, z, slope);
    return {z, slope, tangent, f.value_variance(x), f.slope_variance(x), line.angle_per_slope(tangent, x, z)};
}

// Second form: extrapolated to x from an end point, the sample k, z1 + f'(x1) (x - x1), on either side. Where the edge
// was moved it is the sample beside the edge.
template <class T>
EdgeSide from_endpoint(const Line<T>& line, const Curve& f, int k, double x) {
    const double x1 = line.abscissa(k), z1 = line.ordinate(k), slope = f.slope(x1);
    const Tangent tangent = line.tangent(x1, z1, slope);
    return {z1 + slope * (x - x1),
            slope,
            tangent,
            f.value_variance(x1),
            f.slope_variance(x1),
            line.angle_per_slope(tangent, x1, z1)};
}

// |f1(x) - f2(x)|, a length.
template <class T>
double jump_strength(const Line<T>& line, double x, const EdgeSide& f1, const EdgeSide& f2) {
    return std::abs(line.depth(f1.ordinate, x) - line.depth(f2.ordinate, x));
}

// The difference of depths between the samples around an edge, two on either side where there are. No jump is larger:
// over a wide gap, of few samples or close to the horizon, a curve runs away.
template <class T>
double largest_jump(const Line<T>& line, int before, int after) {
    double nearest = HUGE_VAL, farthest = -HUGE_VAL;
    for (const int k : {before - 1, before, after, after + 1}) {
        if (k < 0 || k >= line.path.size) continue;
        const double z = line.depth(line.ordinate(k), line.abscissa(k));
        if (z < nearest) nearest = z;
        if (z > farthest) farthest = z;
    }
    return farthest - nearest;
}

// The largest third difference of the samples from `before` to `after` and `margin` on either side; infinite where one
// of them has no data, or they are too few.
template <class T>
double largest_third_difference(const Line<T>& line, int before, int after, int margin) {
    const int first = std::max(before - margin, 0), last = std::min(after + margin, line.path.size - 1);
    if (last - first < 3) return HUGE_VAL;
    double largest = 0;
    for (int k = first; k + 3 <= last; ++k) {
        const double slopes = line.ordinate(k + 2) - line.ordinate(k + 1);
        const double third = std::abs(line.ordinate(k + 3) - 3 * slopes - line.ordinate(k));
        if (!(third <= HUGE_VAL)) return HUGE_VAL;
        largest = std::max(largest, third);
    }
    return largest;
}

// Whether samples run on too smoothly for a step of that size, which curves that do not quite follow them pretend. A
// sharp step has third differences of twice its size, an even ramp over n samples of step / 2n. At the end of a line
// half of them are to be seen.
template <class T>
bool is_smooth(const Line<T>& line, int before, int after, int n, double step) {
    constexpr int reach = 2;
    const bool whole = before >= reach && after + reach < line.path.size;
    return largest_third_difference(line, before, after, reach) < (whole ? 1 : 0.5) * step / (2.5 * n - 1.5);
}

// The same for a change of slope, from one sample to the next. A sharp one has a third difference of at least half its
// size, one that is spread evenly over n samples of 1 / n.
template <class T>
bool bends_smoothly(const Line<T>& line, int before, int after, double slope) {
    constexpr int reach = 4, most_samples = 8;
    return largest_third_difference(line, before, after, reach) * most_samples < slope;
}

// The angle between the normals, in degrees: that between the tangents.
inline double crease_strength(const EdgeSide& f1, const EdgeSide& f2) {
    return angle_between(cross(f1.tangent, f2.tangent), dot(f1.tangent, f2.tangent));
}

// False where that is plainly less than so many degrees: an angle is less than its tangent.
inline bool may_exceed(const EdgeSide& f1, const EdgeSide& f2, double degrees) {
    constexpr double rounding = 1.001;
    const double along = dot(f1.tangent, f2.tangent);
    return !(along > 0) ||
           !(std::abs(cross(f1.tangent, f2.tangent)) * (rounding * degrees_per_radian) < degrees * along);
}

// f1' > f2': on a grid, with the tangents (1, -f1') and (1, -f2'), their cross product is f1' - f2'.
inline bool is_convex(const EdgeSide& f1, const EdgeSide& f2) { return cross(f1.tangent, f2.tangent) > 0; }

inline double root_of_squares(double a, double b) { return std::sqrt(a * a + b * b); }

// The standard deviations of f1(x) - f2(x), an ordinate, and of the crease in degrees, by those of values and slopes.
inline FitDeviation jump_deviation(const FitDeviation& value1, const FitDeviation& value2) {
    return {root_of_squares(value1.single, value2.single), root_of_squares(value1.shared, value2.shared)};
}
inline FitDeviation crease_deviation(const EdgeSide& f1, const FitDeviation& slope1, const EdgeSide& f2,
                                     const FitDeviation& slope2) {
    const double a1 = degrees_per_radian * f1.angle_per_slope, a2 = degrees_per_radian * f2.angle_per_slope;
    return {root_of_squares(a1 * slope1.single, a2 * slope2.single),
            root_of_squares(a1 * slope1.shared, a2 * slope2.shared)};
}

}  // namespace rangeedge
