// SPDX-License-Identifier: Apache-2.0
#include "regions/crossings.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/array.hpp"
#include "base/watch.hpp"

namespace rangeedge {
namespace {

using Point = std::array<double, 2>;

// Twice the area of a triangle, positive where c is on the right of a to b, y pointing down.
double area(const Point& a, const Point& b, const Point& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

bool between(const Point& a, const Point& b, const Point& c) {
    return std::min(a[0], b[0]) <= c[0] && c[0] <= std::max(a[0], b[0]) && std::min(a[1], b[1]) <= c[1] &&
           c[1] <= std::max(a[1], b[1]);
}

// Whether segments that leave one point for a and b run along each other.
bool along(const Point& from, const Point& a, const Point& b) {
    return area(from, a, b) == 0 && (a[0] - from[0]) * (b[0] - from[0]) + (a[1] - from[1]) * (b[1] - from[1]) > 0;
}

bool cross(const PlaneSegment& s, const PlaneSegment& t) {
    if (s.from == t.from) return along(s.from, s.to, t.to);
    if (s.from == t.to) return along(s.from, s.to, t.from);
    if (s.to == t.from) return along(s.to, s.from, t.to);
    if (s.to == t.to) return along(s.to, s.from, t.from);
    const double a = area(s.from, s.to, t.from), b = area(s.from, s.to, t.to);
    const double c = area(t.from, t.to, s.from), d = area(t.from, t.to, s.to);
    if (((a > 0 && b < 0) || (a < 0 && b > 0)) && ((c > 0 && d < 0) || (c < 0 && d > 0))) return true;
    return (a == 0 && between(s.from, s.to, t.from)) || (b == 0 && between(s.from, s.to, t.to)) ||
           (c == 0 && between(t.from, t.to, s.from)) || (d == 0 && between(t.from, t.to, s.to));
}

// Square cells, about as many as segments, so that only segments that share a cell need be compared.
class Grid {
public:
    explicit Grid(const std::vector<PlaneSegment>& segments) : segments_(segments) {
        Point high{-HUGE_VAL, -HUGE_VAL};
        for (const PlaneSegment& s : segments)
            for (std::size_t k = 0; k < 2; ++k) {
                low_[k] = std::min({low_[k], s.from[k], s.to[k]});
                high[k] = std::max({high[k], s.from[k], s.to[k]});
            }
        const double width = high[0] - low_[0], height = high[1] - low_[1];
        side_ = std::max({1.0, std::sqrt(width * height / static_cast<double>(segments.size())),
                          std::max(width, height) / static_cast<double>(segments.size())});
        cols_ = static_cast<int>(width / side_) + 1;
        const int rows = static_cast<int>(height / side_) + 1;
        first_.assign(static_cast<Array<int>::Index>(cols_) * rows + 1, 0);
        for (std::size_t i = 0; i < segments.size(); ++i) for_cells(i, [&](int cell) { ++first_[cell + 1]; });
        for (int cell = 1; cell < first_.count(); ++cell) first_[cell] += first_[cell - 1];
        Array<int> next = first_;
        members_.resize(first_.back());
        for (std::size_t i = 0; i < segments.size(); ++i)
            for_cells(i, [&](int cell) { members_[next[cell]++] = static_cast<int>(i); });
    }

    std::vector<std::uint8_t> crossings() const {
        std::vector<std::uint8_t> found(segments_.size(), 0);
        Checkpoints checkpoints;
        for (int cell = 0; cell + 1 < first_.count(); ++cell)
            for (int i = first_[cell]; i < first_[cell + 1]; ++i) {
                checkpoints.pass();
                for (int j = i + 1; j < first_[cell + 1]; ++j) {
                    const auto a = static_cast<std::size_t>(members_[i]), b = static_cast<std::size_t>(members_[j]);
                    if (cross(segments_[a], segments_[b])) found[a] = found[b] = 1;
                }
            }
        return found;
    }

private:
    // The cells that a segment passes, and perhaps some that it comes close to.
    template <class F>
    void for_cells(std::size_t i, F&& visit) const {
        Point a = segments_[i].from, b = segments_[i].to;
        if (a[1] > b[1]) std::swap(a, b);
        const int top = index(a[1], 1), bottom = index(b[1], 1);
        for (int row = top; row <= bottom; ++row) {
            const auto at = [&](int border) {  // where the segment passes the border of a row of cells
                const double share = (low_[1] + border * side_ - a[1]) / (b[1] - a[1]);
                return a[0] + share * (b[0] - a[0]);
            };
            const double from = row == top ? a[0] : at(row), to = row == bottom ? b[0] : at(row + 1);
            const double slack = 1e-6 * side_;
            const int last = std::min(cols_ - 1, index(std::max(from, to) + slack, 0));
            for (int col = std::max(0, index(std::min(from, to) - slack, 0)); col <= last; ++col)
                visit(row * cols_ + col);
        }
    }
    int index(double at, std::size_t axis) const { return static_cast<int>(std::floor((at - low_[axis]) / side_)); }

    const std::vector<PlaneSegment>& segments_;
    Point low_{HUGE_VAL, HUGE_VAL};
    double side_ = 1;
    int cols_ = 0;
    Array<int> first_, members_;  // of every cell
};

}  // namespace

std::vector<std::uint8_t> find_crossings(const std::vector<PlaneSegment>& segments) {
    return segments.empty() ? std::vector<std::uint8_t>() : Grid(segments).crossings();
}

}  // namespace rangeedge
