// Scan lines of a range image as plane curves: rows, columns and both diagonals.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
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

// Standard deviations of ordinates.
struct OrdinateNoise {
    Noise noise;
    bool projective;
    double sigma(double ordinate, std::int64_t pixel) const {
        const double z = projective ? 1 / ordinate : std::abs(ordinate);
        const double length =
            noise.correlation * (noise.map ? static_cast<double>(noise.map[pixel]) : noise.a + (noise.b + noise.c * z) * z);
        return std::max(projective ? length * ordinate * ordinate : length, 1e-30);
    }
};

// A scan line in its plane. The abscissa of sample k is x[k] where given, else k; w = start + step * abscissa is its
// place on the line (a normalised image coordinate where projective, else a length).
template <class T>
struct Line {
    Path path{};
    int cols = 0;
    std::vector<T> y, x, scale;  // scale: inverse tolerances, where they differ
    bool irregular = false, scaled = false, projective = false;
    double start = 0, step = 1;
    double kappa = 1;  // in the plane, a point of inverse depth q lies at (w / q, kappa / q)
    double along[2] = {1, 0}, across = 0;  // the line in the plane of the image: direction, and distance from the origin
    double tolerance = 1;
    OrdinateNoise noise{};

    double abscissa(int k) const { return irregular ? static_cast<double>(x[static_cast<std::size_t>(k)]) : k; }
    double ordinate(int k) const { return static_cast<double>(y[static_cast<std::size_t>(k)]); }
    double depth(double ordinate) const { return projective ? 1 / ordinate : -ordinate; }
    double sigma_at(int k) const { return noise.sigma(ordinate(k), path.pixel(k, cols)); }
    double tolerance_at(int k) const {
        return scaled ? 1 / static_cast<double>(scale[static_cast<std::size_t>(k)]) : tolerance;
    }

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

// Reads the lines of one image.
template <class T>
class LineReader {
public:
    LineReader(const RangeImage<T>& image, const Noise& noise, const Parameters& parameters)
        : image_(image), noise_{noise, image.projective}, parameters_(parameters) {}

    // Makes lines[0] the line `first` of a direction, and so on with the next. Neighbouring lines that are read
    // together share the cache lines of the image.
    void read(int direction, int first, std::vector<Line<T>>& lines) const;

private:
    void gather(std::vector<Line<T>>& lines) const;
    void place(Line<T>& line) const;
    void read_points(Line<T>& line) const;
    void set_tolerance(Line<T>& line) const;

    RangeImage<T> image_;
    OrdinateNoise noise_;
    Parameters parameters_;
};

}  // namespace rangeedge
