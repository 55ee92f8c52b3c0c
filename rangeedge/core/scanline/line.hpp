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
//
// Where the rays of a line do not lie in a plane (rays.hpp), its points are P(w) / y, and what is said of tangents
// holds in the plane that touches the surface of the rays at w: with e = P / |P| and f = P' - (P' . e) e,
//
//     (ds/dw, dr/dw) ~ (|f| y, (P' . e) y - |P| m).
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/angle.hpp"
#include "image/frame.hpp"
#include "scanline/rays.hpp"
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
    bool bridged = false;  // whether some samples without data are interpolated (bridge.hpp)
    bool curved = false;   // by `rays`, in the axes of the plane of the image and along the view
    Rays rays{};

    double abscissa(int k) const { return x ? static_cast<double>(x[k]) : k; }
    double ordinate(int k) const { return static_cast<double>(y[k]); }
    // Inverse depths times this are ordinates.
    double stretch(double abscissa) const {
        if (!curved) return 1;
        const Vector p = rays.at(start + step * abscissa);
        return frame->ranges ? length(p) : p.z;
    }
    double depth(double ordinate, double abscissa) const {
        return frame->projective ? stretch(abscissa) / ordinate : -ordinate;
    }
    // Whether sample k is of the image.
    bool has_data(int k) const {
        return !bridged || frame->valid_at(path.col + k * path.dcol, path.row + k * path.drow);
    }
    // The pixel of the first sample that is, from sample k in steps of `by`.
    std::int64_t pixel_with_data(int k, int by) const {
        while (!has_data(k)) k += by;
        return pixel(k);
    }
    std::int64_t pixel(int k) const { return path.pixel(k, frame->cols); }
    // The noise of sample k, of the border between two samples, and of a segment.
    SampleNoise noise_at(int k) const {
        const std::int64_t p = pixel(k);
        if (frame->noise.map && !has_data(k)) {  // nor has the map there
            int left = k, right = k;
            while (!has_data(left)) --left;
            while (!has_data(right)) ++right;
            return noise_between(left, right);
        }
        if (curved) {
            const double by = stretch(abscissa(k)), q = ordinate(k) / by;
            return {by * frame->noise.sigma(q, p, true), by * frame->noise.waves_at(q, p, true)};
        }
        const double q = ordinate(k);
        return {frame->noise.sigma(q, p, frame->projective), frame->noise.waves_at(q, p, frame->projective)};
    }
    SampleNoise noise_between(int i, int k) const { return mean_of(noise_at(i), noise_at(k)); }
    SampleNoise noise_of(const Segment& s) const { return noise_between(s.left_middle(), s.right_middle()); }
    double tolerance_at(int k) const { return scale ? 1 / static_cast<double>(scale[k]) : tolerance; }

    // Of a curve that has this value and slope, by the abscissa, at an abscissa.
    Tangent tangent(double abscissa, double value, double slope) const {
        const double m = slope * per_step;
        if (!frame->projective) return {1, -m};
        if (curved) {
            const double w = start + step * abscissa;
            const Vector p = rays.at(w), turn = rays.slope(w);
            const double reach = length(p), outward = dot(p, turn) / reach;
            return {length(cross(p, turn)) / reach * value, outward * value - reach * m};
        }
        return {value - (start + step * abscissa) * m, -kappa * m};
    }
    // The angle at which the line of sight meets the straight line from sample i to sample k, in degrees.
    double grazing_angle(int i, int k) const {
        if (!frame->projective) {
            const double w = step * (abscissa(k) - abscissa(i)), r = ordinate(i) - ordinate(k);
            return angle_between(w, std::abs(r));
        }
        const Vector a = point(i), b = point(k), way = combination(b, -1, a), sight = combination(a, 1, b);
        return angle_between(length(rangeedge::cross(way, sight)), std::abs(rangeedge::dot(way, sight)));
    }
    // How fast the angle of that tangent changes with the slope.
    double angle_per_slope(const Tangent& t, double abscissa, double value) const {
        if (curved) return t.s * length(rays.at(start + step * abscissa)) * per_step / dot(t, t);
        return (frame->projective ? kappa * value : 1) * per_step / dot(t, t);
    }

private:
    // A sample in space, in the axes of its plane or in those of the rays.
    Vector point(int k) const {
        const double w = start + step * abscissa(k), far = 1 / ordinate(k);
        const Vector p = curved ? rays.at(w) : Vector{w, 0, kappa};
        return {p.x * far, p.y * far, p.z * far};
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
