// Scan lines of a range image as plane curves: rows, columns and both diagonals.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "edges.hpp"

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

// A scan line in its plane. The abscissa of sample k is x[k] where given, else k; w = start + step * abscissa is its
// place on the line (a normalised image coordinate where projective, else a length).
template <class T>
struct Line {
    Path path{};
    std::vector<T> y, x, scale;
    bool irregular = false, scaled = false;
    bool projective = false;
    double start = 0, step = 1;
    double kappa = 1;   // in the plane, a point of inverse depth q lies at (w / q, kappa / q)
    double tolerance = 1;

    double abscissa(int k) const { return irregular ? static_cast<double>(x[static_cast<std::size_t>(k)]) : k; }
    double ordinate(int k) const { return static_cast<double>(y[static_cast<std::size_t>(k)]); }
    double depth(double ordinate) const { return projective ? 1 / ordinate : -ordinate; }

    // The tangent (s, r) of a curve, without its positive factor; r grows away from the viewer.
    struct Tangent {
        double s, r;
    };
    Tangent tangent(double abscissa, double value, double slope) const {
        const double m = slope / step;
        if (!projective) return {1, -m};
        return {value - (start + step * abscissa) * m, -kappa * m};
    }
    // How fast the tangent turns with the slope.
    double turn(const Tangent& t, double value) const {
        return (projective ? kappa * value : 1) / (step * (t.s * t.s + t.r * t.r));
    }
};

template <class T>
class LineReader {
public:
    LineReader(const RangeImage<T>& image, const Noise& noise, const Parameters& parameters)
        : image_(image), noise_(noise), parameters_(parameters) {}

    void read(const Path& path, Line<T>& line) const;

    // Standard deviation of an ordinate.
    double sigma(double ordinate, std::int64_t pixel) const {
        const double z = image_.projective ? 1 / ordinate : std::abs(ordinate);
        const double length = noise_.map ? static_cast<double>(noise_.map[pixel]) : noise_.a + (noise_.b + noise_.c * z) * z;
        return image_.projective ? length * ordinate * ordinate : length;
    }

private:
    bool constant_tolerance() const;
    double tolerance(double ordinate, std::int64_t pixel) const;
    void read_points(Line<T>& line) const;

    RangeImage<T> image_;
    Noise noise_;
    Parameters parameters_;
};

}  // namespace rangeedge
