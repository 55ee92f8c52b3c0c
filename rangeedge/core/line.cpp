// SPDX-License-Identifier: Apache-2.0
#include "line.hpp"

#include <algorithm>

namespace rangeedge {
namespace {

template <class T>
constexpr T nan = std::numeric_limits<T>::quiet_NaN();

template <class T>
constexpr T least = static_cast<T>(1e-30);  // no tolerance is finer

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
void LineReader<T>::read(int direction, int first, std::vector<Line<T>>& lines) const {
    const bool irregular = image_.points != nullptr;
    for (std::size_t j = 0; j < lines.size(); ++j) {
        Line<T>& line = lines[j];
        line.path = line_path(direction, first + static_cast<int>(j), image_.rows, image_.cols);
        line.cols = image_.cols;
        line.projective = image_.projective;
        line.irregular = irregular;
        line.noise = noise_;
        line.y.resize(static_cast<std::size_t>(line.path.size));
        if (irregular)
            read_points(line);
        else
            place(line);
    }
    if (!irregular) gather(lines);
    for (Line<T>& line : lines) set_tolerance(line);
}

// A strip of some rows after the other, and in it line by line.
template <class T>
void LineReader<T>::gather(std::vector<Line<T>>& lines) const {
    constexpr int strip = 16, ahead = 2 * strip;
    for (int top = 0; top < image_.rows; top += strip)
        for (Line<T>& line : lines) {
            const Path& path = line.path;
            const std::int64_t stride = static_cast<std::int64_t>(path.drow) * image_.cols + path.dcol;
            int first = 0, last = path.size;  // of the samples within the strip
            if (path.drow == 0) {
                if (path.row < top || path.row >= top + strip) continue;
            } else {
                const int k = path.drow > 0 ? top - path.row : path.row - (top + strip - 1);
                first = std::max(first, k), last = std::min(last, k + strip);
            }
            const T* source = image_.ordinate + path.pixel(0, image_.cols);
            T* y = line.y.data();
            for (int k = first; k < last; ++k) {
                if (path.drow != 0) __builtin_prefetch(source + std::min(k + ahead, path.size - 1) * stride);
                y[k] = source[k * stride];
            }
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
    line.along[0] = du / line.step, line.along[1] = dv / line.step;
    line.start = u * line.along[0] + v * line.along[1];
    line.across = v * line.along[0] - u * line.along[1];
    line.kappa = std::sqrt(1 + line.across * line.across);
}

template <class T>
void LineReader<T>::set_tolerance(Line<T>& line) const {
    const Noise& n = noise_.noise;
    const bool given = parameters_.eps > 0;
    // One tolerance for the whole line: a length on a grid, or a noise that does not change with the ordinate.
    line.scaled = given ? image_.projective : n.map || n.b != 0 || (image_.projective ? n.a != 0 : n.c != 0);
    const double factor = given ? parameters_.eps : parameters_.eps_factor * n.correlation;
    if (!line.scaled) {
        line.tolerance = given ? factor : parameters_.eps_factor * noise_.sigma(1, 0);
        return;
    }
    line.tolerance = 1;
    line.scale.resize(line.y.size());
    const auto inverse = [](T tolerance) { return 1 / (tolerance > least<T> ? tolerance : least<T>); };
    const auto f = static_cast<T>(factor);
    if (n.map && !given) {
        for (int k = 0; k < line.path.size; ++k) {
            const auto i = static_cast<std::size_t>(k);
            const T length = f * static_cast<T>(n.map[line.path.pixel(k, image_.cols)]);
            line.scale[i] = inverse(image_.projective ? length * line.y[i] * line.y[i] : length);
        }
        return;
    }
    // As a polynomial of the ordinate: sigma(1 / q) q^2 = a q^2 + b q + c.
    const T a = given ? f : f * static_cast<T>(n.a), b = given ? 0 : f * static_cast<T>(n.b);
    const T c = given ? 0 : f * static_cast<T>(n.c);
    if (image_.projective)
        for (std::size_t k = 0; k < line.y.size(); ++k) line.scale[k] = inverse((a * line.y[k] + b) * line.y[k] + c);
    else
        for (std::size_t k = 0; k < line.y.size(); ++k)
            line.scale[k] = inverse(a + (b + c * std::abs(line.y[k])) * std::abs(line.y[k]));
}

// The plane of a line of points holds its first and last point and the viewpoint (projective) or the viewing axis.
template <class T>
void LineReader<T>::read_points(Line<T>& line) const {
    const Path& path = line.path;
    const auto point = [&](int k) {
        const T* p = image_.points + 3 * path.pixel(k, image_.cols);
        return Vector{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
    };
    const auto valid = [](const Vector& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); };
    line.start = 0, line.step = 1, line.kappa = 1;
    line.x.resize(line.y.size());
    std::fill(line.y.begin(), line.y.end(), nan<T>);
    std::fill(line.x.begin(), line.x.end(), nan<T>);
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
        const auto i = static_cast<std::size_t>(k);
        const double r = dot(p, away);
        if (!image_.projective) {
            line.x[i] = static_cast<T>(dot(p, along));
            line.y[i] = static_cast<T>(-r);
        } else if (r > 0) {
            const double z = r / line.kappa;  // along the axis, as with a camera
            line.x[i] = static_cast<T>(dot(p, along) / z);
            line.y[i] = static_cast<T>(1 / z);
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
