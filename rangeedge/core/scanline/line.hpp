// A scan line, a row, column or diagonal of pixels, as a curve in a plane (paper, 4.1).
//
// On a regular grid the plane holds the line and the viewing direction. The curve is y(w): the height y over the place
// w on the line, both lengths.
//
// With a camera the plane holds the line's pixels and the focal point (paper, 4.1, last paragraph). In the image plane
// z = 1 let d be the direction of the line, n its normal, both of unit length, and `offset` its distance from the
// origin along n: its pixels lie at w d + offset n. The line of sight of such a pixel has the direction
//
//     (w d + offset n, 1) = w (d, 0) + kappa e,   kappa = |(offset n, 1)| = sqrt(1 + offset^2),
//
// where e = (offset n, 1) / kappa is a unit vector orthogonal to (d, 0). The two span the plane, and the point of
// inverse depth q on that line of sight has the coordinates
//
//     s = w / q,   r = kappa / q
//
// in it, across the view and away from the viewer. The curve is q(w), which we approximate by quadratics instead of
// the paper's z(x): straight lines of the scene remain straight, the noise of triangulation is even, and w is known of
// pixels without data.
//
// The tangent of a curve y(w) of slope m = dy/dw is, without a positive factor,
//
//     (ds/dw, dr/dw) ~ (1, -m)                on the grid, where r = -y,
//     (ds/dw, dr/dw) ~ (q - w m, -kappa m)    with a camera, by the quotient rule, times q^2.
//
// Its angle phi changes with m by |dphi/dm| = |s r' - r s'| / (s^2 + r^2), primes for derivatives of the tangent's
// coordinates by m, which is 1 / (s^2 + r^2) on the grid and kappa q / (s^2 + r^2) with a camera.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/angle.hpp"
#include "image/frame.hpp"
#include "scanline/segment.hpp"

namespace rangeedge {

// The pixels of one scan line: sample k lies at pixel (col + k dcol, row + k drow).
struct Path {
    int col, row, dcol, drow, size;
    std::int64_t pixel(int k, int cols) const {
        return static_cast<std::int64_t>(row + k * drow) * cols + col + k * dcol;
    }
};

// The lines of one direction, and the i-th of them.
int line_count(int direction, int rows, int cols);
Path line_path(int direction, int i, int rows, int cols);

// A vector in the plane of a scan line.
struct Tangent {
    double s, r;
};
inline double cross(const Tangent& a, const Tangent& b) { return a.s * b.r - a.r * b.s; }
inline double dot(const Tangent& a, const Tangent& b) { return a.s * b.s + a.r * b.r; }

// The abscissa of sample k, in which curves are approximated, is x[k] where given, else k; w = start + step * abscissa.
template <class T>
struct Line {
    const Frame<T>* frame = nullptr;
    const FitNoise* noise = nullptr;  // of fits along the line
    Path path{};
    const T* y = nullptr;      // ordinates; `padding` more samples than the path has may be read
    const T* x = nullptr;      // null where samples are one unit apart
    const T* scale = nullptr;  // inverse tolerances, where they differ
    double tolerance = 1;      // of splitting, where they do not
    double start = 0, step = 1, per_step = 1;
    double direction[2] = {1, 0}, offset = 0;  // d and the distance along n in the plane of the image
    double kappa = 1;

    double abscissa(int k) const { return x ? static_cast<double>(x[k]) : k; }
    double ordinate(int k) const { return static_cast<double>(y[k]); }
    double depth(double ordinate) const { return frame->projective ? 1 / ordinate : -ordinate; }
    std::int64_t pixel(int k) const { return path.pixel(k, frame->cols); }
    // The noise of sample k, of the border between two samples, and of a segment.
    SampleNoise noise_at(int k) const {
        const double q = ordinate(k);
        const std::int64_t p = pixel(k);
        return {frame->noise.sigma(q, p, frame->projective), frame->noise.waves_at(q, p, frame->projective)};
    }
    SampleNoise noise_between(int i, int k) const { return mean(noise_at(i), noise_at(k)); }
    SampleNoise noise_of(const Segment& s) const { return noise_between(s.left_middle(), s.right_middle()); }
    double tolerance_at(int k) const { return scale ? 1 / static_cast<double>(scale[k]) : tolerance; }

    // Of a curve that has this value and slope, by the abscissa, at an abscissa.
    Tangent tangent(double abscissa, double value, double slope) const {
        const double m = slope * per_step;
        if (!frame->projective) return {1, -m};
        return {value - (start + step * abscissa) * m, -kappa * m};
    }
    // The angle at which the line of sight meets the straight line from sample i to sample k, in degrees.
    double grazing_angle(int i, int k) const {
        const Tangent a = point(i), b = point(k), way{b.s - a.s, b.r - a.r};
        const Tangent sight = frame->projective ? Tangent{a.s + b.s, a.r + b.r} : Tangent{0, 1};
        return angle_between(cross(way, sight), std::abs(dot(way, sight)));
    }
    // How fast the angle of that tangent changes with the slope.
    double angle_per_slope(const Tangent& t, double value) const {
        return (frame->projective ? kappa * value : 1) * per_step / dot(t, t);
    }

private:
    // The coordinates (s, r) of a sample.
    Tangent point(int k) const {
        const double w = start + step * abscissa(k), z = depth(ordinate(k));
        return frame->projective ? Tangent{w * z, kappa * z} : Tangent{w, z};
    }
};

constexpr int strip_lines = 32;  // at most, in a strip: samples of two cache lines

// Neighbouring lines of one direction, and their samples where those do not lie in the image one after the other;
// reused from strip to strip.
template <class T>
struct Strip {
    std::vector<Line<T>> lines;
    std::vector<T> y, x, scale;
};

}  // namespace rangeedge
