// SPDX-License-Identifier: Apache-2.0
#include "scanline/reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/simd.hpp"
#include "scanline/bridge.hpp"

namespace rangeedge {
namespace {

template <class T>
constexpr T nan = std::numeric_limits<T>::quiet_NaN();

template <class T>
T inverse(T tolerance) {
    constexpr T finest = static_cast<T>(Noise::finest);
    return 1 / (tolerance > finest ? tolerance : finest);
}

// 1 / (c0 + c1 |y| + c2 y^2 + c3 |y|^3) of lengths, y / (c3 + c2 y + c1 y^2 + c0 y^3) of inverse depths.
template <class T>
RANGEEDGE_INLINE void invert_deviations(const Deviation& of, bool projective, const T* y, int n, T* result) {
    const auto c0 = static_cast<T>(of.c0), c1 = static_cast<T>(of.c1), c2 = static_cast<T>(of.c2);
    const auto c3 = static_cast<T>(of.c3);
    if (projective)
        for (int k = 0; k < n; ++k) result[k] = inverse((((c0 * y[k] + c1) * y[k] + c2) * y[k] + c3) / y[k]);
    else
        for (int k = 0; k < n; ++k) {
            const T z = std::abs(y[k]);
            result[k] = inverse(((c3 * z + c2) * z + c1) * z + c0);
        }
}
void inverse_of(const Deviation& tolerance, bool projective, const double* y, int n, double* result) {
    invert_deviations(tolerance, projective, y, n, result);
}
RANGEEDGE_WIDE
void inverse_of(const Deviation& tolerance, bool projective, const float* y, int n, float* result) {
    invert_deviations(tolerance, projective, y, n, result);
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
void LineReader<T>::read(int direction, int first, int count, Strip<T>& strip) const {
    strip.lines.resize(static_cast<std::size_t>(count));
    int longest = 0;
    for (int j = 0; j < count; ++j) {
        Line<T>& line = strip.lines[static_cast<std::size_t>(j)];
        line = {};
        line.frame = &frame_;
        line.noise = &frame_.noise.along(direction);
        line.path = line_path(direction, first + j, frame_.rows, frame_.cols);
        longest = std::max(longest, line.path.size);
    }
    const auto size = static_cast<std::size_t>(longest) * strip.lines.size() + padding;
    std::size_t used = 0;
    if (frame_.points) {
        strip.x.resize(size), strip.y.resize(size);
        for (Line<T>& line : strip.lines) {
            T *x = strip.x.data() + used, *y = strip.y.data() + used;
            line.x = x, line.y = y;
            std::fill_n(x, line.path.size, nan<T>);
            std::fill_n(y, line.path.size, nan<T>);
            if (frame_.curved)
                read_curved(line, x, y);
            else
                read_points(line, x, y);
            used += static_cast<std::size_t>(line.path.size);
        }
    } else {
        for (Line<T>& line : strip.lines) locate(line);
        if (direction == rows_bit)
            take_rows(strip);
        else
            transpose(strip);
    }
    used = 0;
    strip.scale.resize(size);
    for (Line<T>& line : strip.lines) {
        set_tolerance(line, strip.scale.data() + used);
        used += static_cast<std::size_t>(line.path.size);
    }
    bridge(strip);
}

// Rows lie in the image as they are; the last ones are copied, since nothing may be read beyond the image.
template <class T>
void LineReader<T>::take_rows(Strip<T>& strip) const {
    const auto pitch = static_cast<std::size_t>(frame_.cols + padding);
    strip.y.resize(pitch * strip.lines.size());
    T* copy = strip.y.data();
    for (Line<T>& line : strip.lines) {
        line.y = frame_.ordinate + line.path.pixel(0, frame_.cols);
        if (static_cast<std::int64_t>(frame_.rows - 1 - line.path.row) * frame_.cols < padding)
            line.y = std::copy_n(line.y, frame_.cols, copy) - frame_.cols;
        copy += pitch;
    }
}

// Rows that lie in the image are copied first.
template <class T>
void LineReader<T>::bridge(Strip<T>& strip) const {
    const int most = std::min(most_bridged, options_.max_gap);
    const auto pitch = static_cast<std::size_t>(frame_.cols + padding);
    Array<Hole> holes;
    for (std::size_t j = 0; j < strip.lines.size(); ++j) {
        Line<T>& line = strip.lines[j];
        find_bridged(line, most, holes);
        line.bridged = !holes.empty();
        if (!line.bridged) continue;
        const T* in_image = frame_.ordinate ? frame_.ordinate + line.pixel(0) : nullptr;
        if (line.y == in_image) line.y = std::copy_n(line.y, frame_.cols, strip.y.data() + j * pitch) - frame_.cols;
        T* y = strip.y.data() + (line.y - strip.y.data());
        for (const Hole& hole : holes) {
            interpolate(hole, y);
            if (line.x) interpolate(hole, strip.x.data() + (line.x - strip.x.data()));
            if (line.scale) interpolate(hole, strip.scale.data() + (line.scale - strip.scale.data()));
        }
    }
}

constexpr int tile = 4;  // rows that are transposed at a time

// The samples of all lines of a strip in the rows of a tile. The rows, `step` apart, hold one of each line side by
// side; the lines, `pitch` apart, take one of each row side by side.
template <class T>
void transpose_tile(const T* source, std::ptrdiff_t step, T* lines, std::ptrdiff_t pitch) {
    typedef T Quad __attribute__((vector_size(tile * sizeof(T))));
    for (int j = 0; j < strip_lines; ++j) {
        const T* first = source + j;
        const Quad samples{first[0], first[step], first[2 * step], first[3 * step]};
        std::memcpy(lines + j * pitch, &samples, sizeof samples);
    }
}

// Copies the samples so that those of a line lie one after the other. A row of the image holds one sample of each
// line, side by side; on diagonals they are a column farther right in the next row.
template <class T>
void LineReader<T>::transpose(Strip<T>& strip) const {
    const Path& start = strip.lines.front().path;
    const int count = static_cast<int>(strip.lines.size()), slant = start.dcol, down = start.drow;
    // The first row that any of the lines has, and the column of line 0 there, which may lie outside of the image.
    int top = start.row;
    for (const Line<T>& line : strip.lines)
        top = down > 0 ? std::min(top, line.path.row) : std::max(top, line.path.row);
    const int left = start.col - slant * (start.row - top) * down;
    const int height = std::min(down > 0 ? frame_.rows - top : top + 1, slant ? frame_.cols - left : frame_.rows);
    // Next samples of all lines lie in different sets of any cache.
    const int pitch = (height + 1023) / 1024 * 1024 + 16;
    strip.y.resize(static_cast<std::size_t>(pitch) * strip.lines.size() + padding);
    for (int k = 0; k < height;) {
        const int col = left + slant * k;
        const auto source = static_cast<std::int64_t>(top + down * k) * frame_.cols + col;
        const std::ptrdiff_t step = static_cast<std::ptrdiff_t>(down) * frame_.cols + slant;  // to the next row
        T* lines = strip.y.data() + k;
        if (k + tile <= height && count == strip_lines && col >= 0 && col + slant * tile + strip_lines <= frame_.cols) {
            transpose_tile(frame_.ordinate + source, step, lines, pitch);
            k += tile;
        } else {
            const int end = std::min(count, frame_.cols - col);
            for (int j = std::max(0, -col); j < end; ++j) lines[j * pitch] = frame_.ordinate[source + j];
            ++k;
        }
    }
    for (int j = 0; j < count; ++j) {
        Line<T>& line = strip.lines[static_cast<std::size_t>(j)];
        line.y = strip.y.data() + static_cast<std::ptrdiff_t>(j) * pitch + (line.path.row - top) * down;
    }
}

template <class T>
void LineReader<T>::locate(Line<T>& line) const {
    const Path& path = line.path;
    // The line's direction and its first pixel, in the plane of the image.
    const double* p = frame_.to_plane;
    const double du = p[0] * path.dcol + p[1] * path.drow, dv = p[3] * path.dcol + p[4] * path.drow;
    const double u = p[0] * path.col + p[1] * path.row + p[2], v = p[3] * path.col + p[4] * path.row + p[5];
    line.step = std::hypot(du, dv);
    line.per_step = 1 / line.step;
    line.direction[0] = du * line.per_step, line.direction[1] = dv * line.per_step;
    line.start = u * line.direction[0] + v * line.direction[1];
    line.offset = v * line.direction[0] - u * line.direction[1];
    line.kappa = std::sqrt(1 + line.offset * line.offset);
}

template <class T>
void LineReader<T>::set_tolerance(Line<T>& line, T* scale) const {
    const Noise& noise = frame_.noise;
    const bool given = options_.eps > 0, mapped = noise.map && !given;
    const int size = line.path.size;
    const double factor = given ? options_.eps : options_.eps_factor * line.noise->residual;
    const Deviation tolerance = given ? Deviation{factor} : noise.waves.times(factor);
    if (line.curved && frame_.ranges) {
        for (int k = 0; k < size; ++k) {
            const double stretch = line.stretch(line.abscissa(k)), q = line.ordinate(k) / stretch;
            const double own = mapped ? factor * static_cast<double>(noise.map[line.pixel(k)]) * q * q
                                      : tolerance.of_ordinate(q, true);
            scale[k] = static_cast<T>(1 / (stretch * std::max(own, Noise::finest)));
        }
        line.scale = scale;
        return;
    }
    // The same everywhere: a length on a grid, or one that grows with the square of the depth.
    const double other = frame_.projective ? tolerance.c0 : tolerance.c2;
    if (!mapped && other == 0 && tolerance.c1 == 0 && tolerance.c3 == 0) {
        line.tolerance = std::max(frame_.projective ? tolerance.c2 : tolerance.c0, Noise::finest);
        return;
    }
    line.scale = scale;
    if (!mapped) {
        inverse_of(tolerance, frame_.projective, line.y, size, scale);
        return;
    }
    for (int k = 0; k < size; ++k) {
        const T own = static_cast<T>(factor) * static_cast<T>(noise.map[line.pixel(k)]);
        scale[k] = inverse(frame_.projective ? own * line.y[k] * line.y[k] : own);
    }
}

// The plane of a line of points holds its first and last point and the viewpoint (projective) or the viewing axis. Its
// axes are `away`, that of the view within the plane, and `sideways`, the way the samples run. Other points may lie
// somewhat beside it, and are projected onto it.
template <class T>
void LineReader<T>::read_points(Line<T>& line, T* x, T* y) const {
    const Path& path = line.path;
    const auto point = [&](int k) { return frame_.point(path.pixel(k, frame_.cols)); };
    int first = 0, last = path.size - 1;
    while (first < path.size && !is_finite(point(first))) ++first;
    while (last > first && !is_finite(point(last))) --last;
    if (first >= last) return;

    const Vector axis{frame_.axis[0], frame_.axis[1], frame_.axis[2]};
    const Vector a = point(first), b = point(last);
    Vector normal = frame_.projective ? cross(a, b) : cross(axis, combination(b, -1, a));
    if (!normalise(normal)) return;
    Vector away = combination(axis, -dot(axis, normal), normal);  // the axis within the plane
    const double foreshortened = std::sqrt(dot(away, away));
    if (!normalise(away)) return;
    line.kappa = 1 / foreshortened;
    Vector sideways = cross(normal, away);
    const double forward = frame_.projective ? dot(b, sideways) * dot(a, away) - dot(a, sideways) * dot(b, away)
                                             : dot(combination(b, -1, a), sideways);
    if (forward < 0) sideways = {-sideways.x, -sideways.y, -sideways.z};
    for (int k = first; k <= last; ++k) {
        const Vector p = point(k);
        if (!is_finite(p)) continue;
        const double r = dot(p, away);
        if (!frame_.projective) {
            x[k] = static_cast<T>(dot(p, sideways));
            y[k] = static_cast<T>(-r);
        } else if (r > 0) {
            const double z = r / line.kappa;  // along the axis, as with a camera
            x[k] = static_cast<T>(dot(p, sideways) / z);
            y[k] = static_cast<T>(1 / z);
        }
    }
    const Vector right = across(axis), down = cross(axis, right);
    line.direction[0] = dot(sideways, right), line.direction[1] = dot(sideways, down);
    const double scale = frame_.projective ? 1 / dot(a, axis) : 1;
    line.offset = scale * (dot(a, down) * line.direction[0] - dot(a, right) * line.direction[1]);
}

// The rays of a line need not lie in a plane.
template <class T>
void LineReader<T>::read_curved(Line<T>& line, T* x, T* y) const {
    const Vector axis{frame_.axis[0], frame_.axis[1], frame_.axis[2]};
    const auto point = [&](int k) { return frame_.point(line.pixel(k)); };
    RayFit rays(axis, frame_.ranges);
    Vector sum{0, 0, 0};
    int first = -1, last = -1;
    for (int k = 0; k < line.path.size; ++k)
        if (const Vector p = point(k); is_finite(p)) {
            first = first < 0 ? k : first, last = k;
            sum = combination(sum, 1, rays.ray(p));
        }
    if (first == last || !rays.orient(point(first), point(last), sum)) return;
    for (int k = first; k <= last; ++k)
        if (const Vector p = point(k); is_finite(p)) rays.add(p);
    const Rays fitted = rays.fit();
    for (int k = first; k <= last; ++k)
        if (const Vector p = point(k); is_finite(p)) {
            const double w = rays.place(p);
            const Vector direction = fitted.at(w);
            x[k] = static_cast<T>(w);
            y[k] = static_cast<T>(frame_.ranges ? length(direction) / length(p) : dot(direction, axis) / dot(p, axis));
        }
    // In the plane of the image.
    const Vector right = across(axis), down = cross(axis, right);
    const auto turned = [&](const Vector& v) { return Vector{dot(v, right), dot(v, down), dot(v, axis)}; };
    line.rays = {turned(fitted.c0), turned(fitted.c1), turned(fitted.c2)};
    line.curved = true;
}

template class LineReader<float>;
template class LineReader<double>;

}  // namespace rangeedge
