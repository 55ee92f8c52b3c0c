// SPDX-License-Identifier: Apache-2.0
#include "line.hpp"

#include <algorithm>
#include <limits>

#include "simd.hpp"

namespace rangeedge {
namespace {

template <class T>
constexpr T nan = std::numeric_limits<T>::quiet_NaN();

template <class T>
T inverse(T tolerance) {
    constexpr T least = static_cast<T>(1e-30);  // no tolerance is finer
    return 1 / (tolerance > least ? tolerance : least);
}

// 1 / (c0 + c1 |y| + c2 y^2) of n ordinates.
void inverse_polynomial(const double* y, int n, double c0, double c1, double c2, double* result) {
    for (int k = 0; k < n; ++k) result[k] = inverse(c0 + (c1 + c2 * std::abs(y[k])) * std::abs(y[k]));
}
RANGEEDGE_WIDE
void inverse_polynomial(const float* y, int n, float c0, float c1, float c2, float* result) {
    for (int k = 0; k < n; ++k) result[k] = inverse(c0 + (c1 + c2 * std::abs(y[k])) * std::abs(y[k]));
}

struct Vector {
    double x, y, z;
};
double dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vector cross(const Vector& a, const Vector& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Vector combination(const Vector& a, double k, const Vector& b) { return {a.x + k * b.x, a.y + k * b.y, a.z + k * b.z}; }
bool normalise(Vector& a) {
    const double length = std::sqrt(dot(a, a));
    if (!(length > 0) || !std::isfinite(length)) return false;
    a = {a.x / length, a.y / length, a.z / length};
    return true;
}

}  // namespace

int line_count(int direction, int rows, int cols) {
    return direction == rows_bit ? rows : direction == cols_bit ? cols : rows + cols - 1;
}

Path line_path(int direction, int i, int rows, int cols) {
    if (direction == rows_bit) return {0, i, 1, 0, cols};
    if (direction == cols_bit) return {i, 0, 0, 1, rows};
    // Diagonals run to the right, from the left border or from the lower (45) or upper (135) one.
    const int col = std::max(0, i - rows + 1);
    if (direction == diag45_bit) {
        const int row = std::min(i, rows - 1);
        return {col, row, 1, -1, std::min(row + 1, cols - col)};
    }
    const int row = std::max(0, rows - 1 - i);
    return {col, row, 1, 1, std::min(rows - row, cols - col)};
}

template <class T>
double grazing_angle(const Line<T>& line, int i, int k) {
    struct Point {
        double s, r;
    };
    const auto point = [&](int j) {
        const double w = line.start + line.step * line.abscissa(j), z = line.depth(line.ordinate(j));
        return line.projective ? Point{w * z, line.kappa * z} : Point{w, z};
    };
    const Point a = point(i), b = point(k), ray = line.projective ? Point{a.s + b.s, a.r + b.r} : Point{0, 1};
    const Point way{b.s - a.s, b.r - a.r};
    return degrees_of(way.s * ray.r - way.r * ray.s, std::abs(way.s * ray.s + way.r * ray.r));
}

template double grazing_angle(const Line<float>&, int, int);
template double grazing_angle(const Line<double>&, int, int);

template <class T>
void LineReader<T>::read(int direction, int first, int count, Strip<T>& strip) const {
    strip.lines.resize(static_cast<std::size_t>(count));
    int longest = 0;
    for (int j = 0; j < count; ++j) {
        Line<T>& line = strip.lines[static_cast<std::size_t>(j)];
        line = {};
        line.path = line_path(direction, first + j, image_.rows, image_.cols);
        line.cols = image_.cols;
        line.projective = image_.projective;
        line.noise = noise_;
        longest = std::max(longest, line.path.size);
    }
    const auto size = static_cast<std::size_t>(longest) * strip.lines.size() + padding;
    std::size_t used = 0;
    if (image_.points) {
        strip.x.resize(size), strip.y.resize(size);
        for (Line<T>& line : strip.lines) {
            read_points(line, strip.x.data() + used, strip.y.data() + used);
            used += static_cast<std::size_t>(line.path.size);
        }
    } else {
        for (Line<T>& line : strip.lines) place(line);
        if (direction == rows_bit)
            take_rows(strip);
        else
            turn_rows(strip);
    }
    used = 0;
    strip.scale.resize(size);
    for (Line<T>& line : strip.lines) {
        set_tolerance(line, strip.scale.data() + used);
        used += static_cast<std::size_t>(line.path.size);
    }
}

// Rows lie in the image as they are; the last ones are copied, since nothing may be read beyond the image.
template <class T>
void LineReader<T>::take_rows(Strip<T>& strip) const {
    const auto pitch = static_cast<std::size_t>(image_.cols + padding);
    strip.y.resize(pitch * strip.lines.size());
    T* copy = strip.y.data();
    for (Line<T>& line : strip.lines) {
        line.y = image_.ordinate + line.path.pixel(0, image_.cols);
        if (static_cast<std::int64_t>(image_.rows - 1 - line.path.row) * image_.cols >= padding) continue;
        line.y = std::copy_n(line.y, image_.cols, copy) - image_.cols;
        copy += pitch;
    }
}

constexpr int tile = 4;  // rows that are turned at a time

// A sample of each row of a tile for all lines of a strip; rows are `step` apart, and have one side by side for each.
template <class T>
void turn_tile(const T* source, std::ptrdiff_t step, T* turned, std::ptrdiff_t pitch) {
    typedef T Quad __attribute__((vector_size(tile * sizeof(T))));
    for (int j = 0; j < strip_lines; ++j) {
        const T* first = source + j;
        const Quad samples{first[0], first[step], first[2 * step], first[3 * step]};
        std::memcpy(turned + j * pitch, &samples, sizeof samples);
    }
}

// Copies the samples so that those of a line lie one after the other. A row of the image holds one sample of each
// line, side by side; on diagonals they are a column farther right in the next row.
template <class T>
void LineReader<T>::turn_rows(Strip<T>& strip) const {
    const Path& start = strip.lines.front().path;
    const int count = static_cast<int>(strip.lines.size()), slant = start.dcol, down = start.drow;
    // The first row that any of the lines has, and the column of line 0 there, which may lie outside of the image.
    int top = start.row;
    for (const Line<T>& line : strip.lines)
        top = down > 0 ? std::min(top, line.path.row) : std::max(top, line.path.row);
    const int left = start.col - slant * (start.row - top) * down;
    const int height = std::min(down > 0 ? image_.rows - top : top + 1, slant ? image_.cols - left : image_.rows);
    // Next samples of all lines lie in different sets of any cache.
    const int pitch = (height + 1023) / 1024 * 1024 + 16;
    strip.y.resize(static_cast<std::size_t>(pitch) * strip.lines.size() + padding);
    for (int k = 0; k < height;) {
        const int col = left + slant * k;
        const auto source = static_cast<std::int64_t>(top + down * k) * image_.cols + col;
        const std::ptrdiff_t step = static_cast<std::ptrdiff_t>(down) * image_.cols + slant;  // to the next row
        T* turned = strip.y.data() + k;
        if (k + tile <= height && count == strip_lines && col >= 0 && col + slant * tile + strip_lines <= image_.cols) {
            turn_tile(image_.ordinate + source, step, turned, pitch);
            k += tile;
        } else {
            const int end = std::min(count, image_.cols - col);
            for (int j = std::max(0, -col); j < end; ++j) turned[j * pitch] = image_.ordinate[source + j];
            ++k;
        }
    }
    for (int j = 0; j < count; ++j) {
        Line<T>& line = strip.lines[static_cast<std::size_t>(j)];
        line.y = strip.y.data() + static_cast<std::ptrdiff_t>(j) * pitch + (line.path.row - top) * down;
    }
}

template <class T>
void LineReader<T>::place(Line<T>& line) const {
    const Path& path = line.path;
    // The line's direction and the place of its first pixel, in the plane of the image.
    const double* p = image_.to_plane;
    const double du = p[0] * path.dcol + p[1] * path.drow, dv = p[3] * path.dcol + p[4] * path.drow;
    const double u = p[0] * path.col + p[1] * path.row + p[2], v = p[3] * path.col + p[4] * path.row + p[5];
    line.step = std::hypot(du, dv);
    line.per_step = 1 / line.step;
    line.along[0] = du * line.per_step, line.along[1] = dv * line.per_step;
    line.start = u * line.along[0] + v * line.along[1];
    line.across = v * line.along[0] - u * line.along[1];
    line.kappa = std::sqrt(1 + line.across * line.across);
}

template <class T>
void LineReader<T>::set_tolerance(Line<T>& line, T* scale) const {
    const Noise& n = noise_.noise;
    const bool given = parameters_.eps > 0;
    const double factor = given ? parameters_.eps : parameters_.eps_factor * n.correlation;
    // One tolerance for the whole line: a length on a grid, or a noise that does not change with the ordinate.
    if (!(given ? image_.projective : n.map || n.b != 0 || (image_.projective ? n.a != 0 : n.c != 0))) {
        line.tolerance = given ? factor : parameters_.eps_factor * noise_.sigma(1, 0);
        return;
    }
    line.scale = scale;
    const int size = line.path.size;
    if (n.map && !given) {
        for (int k = 0; k < size; ++k) {
            const T length = static_cast<T>(factor) * static_cast<T>(n.map[line.path.pixel(k, image_.cols)]);
            scale[k] = inverse(image_.projective ? length * line.y[k] * line.y[k] : length);
        }
        return;
    }
    // As a polynomial of the ordinate: sigma(1 / q) q^2 = a q^2 + b q + c.
    const auto a = static_cast<T>(given ? factor : factor * n.a), b = static_cast<T>(given ? 0 : factor * n.b);
    const auto c = static_cast<T>(given ? 0 : factor * n.c);
    if (image_.projective)
        inverse_polynomial(line.y, size, c, b, a, scale);
    else
        inverse_polynomial(line.y, size, a, b, c, scale);
}

// The plane of a line of points holds its first and last point and the viewpoint (projective) or the viewing axis.
template <class T>
void LineReader<T>::read_points(Line<T>& line, T* x, T* y) const {
    const Path& path = line.path;
    const auto point = [&](int k) {
        const T* p = image_.points + 3 * path.pixel(k, image_.cols);
        return Vector{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
    };
    const auto valid = [](const Vector& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); };
    line.x = x, line.y = y;
    std::fill_n(x, path.size, nan<T>);
    std::fill_n(y, path.size, nan<T>);
    int first = 0, last = path.size - 1;
    while (first < path.size && !valid(point(first))) ++first;
    while (last > first && !valid(point(last))) --last;
    if (first >= last) return;

    const Vector axis{image_.axis[0], image_.axis[1], image_.axis[2]};
    const Vector a = point(first), b = point(last);
    Vector normal = image_.projective ? cross(a, b) : cross(axis, combination(b, -1, a));
    if (!normalise(normal)) return;
    Vector away = combination(axis, -dot(axis, normal), normal);  // the axis within the plane
    const double foreshortened = std::sqrt(dot(away, away));
    if (!normalise(away)) return;
    line.kappa = 1 / foreshortened;
    // Across the viewing direction, the way the samples run.
    Vector along = cross(normal, away);
    const double turn = image_.projective ? dot(b, along) * dot(a, away) - dot(a, along) * dot(b, away)
                                          : dot(combination(b, -1, a), along);
    if (turn < 0) along = {-along.x, -along.y, -along.z};
    for (int k = first; k <= last; ++k) {
        const Vector p = point(k);
        if (!valid(p)) continue;
        const double r = dot(p, away);
        if (!image_.projective) {
            x[k] = static_cast<T>(dot(p, along));
            y[k] = static_cast<T>(-r);
        } else if (r > 0) {
            const double z = r / line.kappa;  // along the axis, as with a camera
            x[k] = static_cast<T>(dot(p, along) / z);
            y[k] = static_cast<T>(1 / z);
        }
    }
    // In the plane of the image, of which the axis is the normal.
    Vector right{1, 0, 0};
    right = combination(right, -dot(axis, right), axis);
    if (!normalise(right)) right = {0, 1, 0};
    const Vector down = cross(axis, right);
    line.along[0] = dot(along, right), line.along[1] = dot(along, down);
    const Vector& p = a;
    const double scale = image_.projective ? 1 / dot(p, axis) : 1;
    line.across = scale * (dot(p, down) * line.along[0] - dot(p, right) * line.along[1]);
}

template class LineReader<float>;
template class LineReader<double>;

}  // namespace rangeedge
