// Scan lines of a range image as plane curves: rows, columns and both diagonals.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "edges.hpp"
#include "simd.hpp"

namespace rangeedge {

// The pixels of one scan line: sample k lies at pixel (col + k dcol, row + k drow).
struct Path {
    int col, row, dcol, drow, size;
    std::int64_t pixel(int k, int cols) const {
        return static_cast<std::int64_t>(row + k * drow) * cols + col + k * dcol;
    }
};

// The lines of one direction (a DIR_* bit), and the i-th of them.
int line_count(int direction, int rows, int cols);
Path line_path(int direction, int i, int rows, int cols);

// Standard deviations of ordinates.
struct OrdinateNoise {
    Noise noise;
    bool projective;
    double sigma(double ordinate, std::int64_t pixel) const {
        const double z = std::abs(ordinate);  // a length, or where projective the inverse of one
        const double length = noise.map ? static_cast<double>(noise.map[pixel]) * (projective ? z * z : 1)
                              : projective ? (noise.a * z + noise.b) * z + noise.c
                                           : (noise.c * z + noise.b) * z + noise.a;
        return std::max(noise.correlation * length, 1e-30);
    }
};

// A scan line in its plane. The abscissa of sample k is x[k] where given, else k; w = start + step * abscissa is its
// place on the line (a normalised image coordinate where projective, else a length).
template <class T>
struct Line {
    Path path{};
    int cols = 0;
    const T* y = nullptr;      // `padding` more samples than the path has may be read
    const T* x = nullptr;      // null where samples are one unit apart
    const T* scale = nullptr;  // inverse tolerances, where they differ
    bool projective = false;
    double start = 0, step = 1, per_step = 1;
    double kappa = 1;  // in the plane, a point of inverse depth q lies at (w / q, kappa / q)
    double along[2] = {1, 0}, across = 0;  // the line in the plane of the image: direction, and distance from the origin
    double tolerance = 1;
    OrdinateNoise noise{};

    double abscissa(int k) const { return x ? static_cast<double>(x[k]) : k; }
    double ordinate(int k) const { return static_cast<double>(y[k]); }
    double depth(double ordinate) const { return projective ? 1 / ordinate : -ordinate; }
    double sigma_at(int k) const { return noise.sigma(ordinate(k), path.pixel(k, cols)); }
    double tolerance_at(int k) const { return scale ? 1 / static_cast<double>(scale[k]) : tolerance; }

    // The tangent (s, r) of a curve, without its positive factor; r grows away from the viewer.
    struct Tangent {
        double s, r;
    };
    Tangent tangent(double abscissa, double value, double slope) const {
        const double m = slope * per_step;
        if (!projective) return {1, -m};
        return {value - (start + step * abscissa) * m, -kappa * m};
    }
    // How fast the tangent turns with the slope.
    double turn(const Tangent& t, double value) const {
        return (projective ? kappa * value : 1) * per_step / (t.s * t.s + t.r * t.r);
    }
};

// The angle at which the viewing ray meets the straight line from sample i to sample k, in degrees, and up to which one
// a surface between them would hardly be seen.
template <class T>
double grazing_angle(const Line<T>& line, int i, int k);
constexpr double veil = 20;

constexpr int strip_lines = 32;  // at most, in a strip: samples of two cache lines

// Neighbouring lines of one direction, and their samples where those do not lie in the image one after the other;
// reused from strip to strip.
template <class T>
struct Strip {
    std::vector<Line<T>> lines;
    std::vector<T> y, x, scale;
};

// Reads the lines of one image.
template <class T>
class LineReader {
public:
    LineReader(const RangeImage<T>& image, const Noise& noise, const Parameters& parameters)
        : image_(image), noise_{noise, image.projective}, parameters_(parameters) {}

    // The lines first to first + count - 1 of a direction. Read together they share the cache lines of the image.
    void read(int direction, int first, int count, Strip<T>& strip) const;

private:
    void place(Line<T>& line) const;
    void take_rows(Strip<T>& strip) const;
    void turn_rows(Strip<T>& strip) const;
    void read_points(Line<T>& line, T* x, T* y) const;
    void set_tolerance(Line<T>& line, T* scale) const;

    RangeImage<T> image_;
    OrdinateNoise noise_;
    Parameters parameters_;
};

}  // namespace rangeedge
