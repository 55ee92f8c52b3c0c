// SPDX-License-Identifier: Apache-2.0
#include "regions/outlines.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/array.hpp"
#include "base/disjoint_sets.hpp"
#include "base/watch.hpp"
#include "regions/crossings.hpp"

namespace rangeedge {
namespace {

// Ways along the borders of pixels: east, south, west, north. A turn to the right is one more.
constexpr std::array<int, 4> step_x{1, 0, -1, 0}, step_y{0, 1, 0, -1};

// Connected regions 1, 2, ... of the labels > 0, in raster order, in a map with a margin of one pixel; 0 elsewhere.
class RegionMap {
public:
    RegionMap(const std::int32_t* labels, int rows, int cols, std::vector<std::int32_t>& names)
        : stride_(cols + 2), region_(static_cast<Array<std::int32_t>::Index>(rows + 2) * (cols + 2), 0) {
        DisjointSets parts(1);  // pixels that touch above or on the left; the first represents a region
        names.assign(1, 0);     // of parts, then of regions
        for (int row = 0; row < rows; ++row) {
            Watch::checkpoint();
            const std::int32_t* label = labels + static_cast<std::ptrdiff_t>(row) * cols;
            std::int32_t* part = &region_[static_cast<std::ptrdiff_t>(row + 1) * stride_ + 1];
            for (int col = 0; col < cols; ++col) {
                if (label[col] <= 0) continue;
                const std::int32_t left = col > 0 && label[col - 1] == label[col] ? part[col - 1] : 0;
                const std::int32_t above = row > 0 && label[col - cols] == label[col] ? part[col - stride_] : 0;
                part[col] = left ? left : above;
                if (!part[col]) {
                    part[col] = parts.add();
                    names.push_back(label[col]);
                } else if (left && above && left != above) {
                    const int i = parts.find(left), j = parts.find(above);
                    parts.link(std::max(i, j), std::min(i, j));
                }
            }
        }
        std::vector<std::int32_t> number(names.size(), 0);
        std::size_t count = 1;
        for (std::size_t part = 1; part < number.size(); ++part) {
            const int root = parts.find(static_cast<int>(part));
            if (root == static_cast<int>(part)) {
                number[part] = static_cast<std::int32_t>(count);
                names[count++] = names[part];
            } else {
                number[part] = number[static_cast<std::size_t>(root)];
            }
        }
        names.resize(count);
        for (std::int32_t& region : region_) region = number[static_cast<std::size_t>(region)];
    }

    // The region of the pixel behind a corner on the right of one who leaves it that way, and on the left.
    std::int32_t right_of(int x, int y, int way) const { return at(x - (way == 1 || way == 2), y - (way >= 2)); }
    std::int32_t left_of(int x, int y, int way) const { return at(x - (way >= 2), y - (way == 0 || way == 3)); }
    bool border(int x, int y, int way) const { return right_of(x, y, way) != left_of(x, y, way); }
    // Whether all four pixels around a corner are of one region.
    bool amid(int x, int y) const {
        const std::int32_t* above = &region_[static_cast<std::ptrdiff_t>(y) * stride_ + x];
        const std::int32_t* below = above + stride_;
        return above[0] == above[1] && above[0] == below[0] && above[0] == below[1];
    }

private:
    std::int32_t at(int col, int row) const { return region_[(row + 1) * stride_ + col + 1]; }

    int stride_;
    Array<std::int32_t> region_;
};

class Tracer {
public:
    Tracer(const std::int32_t* labels, int rows, int cols)
        : rows_(rows), cols_(cols), map_(labels, rows, cols, found_.labels),
          done_(static_cast<Array<std::uint8_t>::Index>(rows + 1) * (cols + 1), 0) {}

    Outlines trace() {
        std::vector<std::array<int, 2>> corners;
        for (int y = 0; y <= rows_; ++y) {
            Watch::checkpoint();
            for (int x = 0; x <= cols_; ++x)
                if (!map_.amid(x, y)) corners.push_back({x, y});
        }
        Checkpoints checkpoints;
        for (const auto& [x, y] : corners) {
            checkpoints.pass();
            if (ways_from(x, y) > 2)
                for (int way = 0; way < 4; ++way) follow(x, y, way);
        }
        for (const auto& [x, y] : corners) {  // what is left has no end; it goes east somewhere
            checkpoints.pass();
            follow(x, y, 0);
        }
        link();
        return std::move(found_);
    }

private:
    bool inside(int x, int y) const { return x >= 0 && y >= 0 && x <= cols_ && y <= rows_; }
    bool open(int x, int y, int way) const {
        const auto k = static_cast<std::size_t>(way);
        return inside(x + step_x[k], y + step_y[k]) && map_.border(x, y, way);
    }
    int ways_from(int x, int y) const {
        int count = 0;
        for (int way = 0; way < 4; ++way) count += open(x, y, way);
        return count;
    }
    std::uint8_t& done(int x, int y) { return done_[static_cast<std::ptrdiff_t>(y) * (cols_ + 1) + x]; }

    // The arc that leaves a corner that way, unless it is known.
    void follow(int x, int y, int way) {
        if (!open(x, y, way) || done(x, y) >> way & 1) return;
        const int x0 = x, y0 = y;
        const auto arc = static_cast<std::int32_t>(found_.arcs.size());
        const auto first = static_cast<std::int32_t>(found_.corners.size());
        found_.corners.push_back({x, y});
        starts_.push_back({x, y, way, arc});
        const std::int32_t right = map_.right_of(x, y, way), left = map_.left_of(x, y, way);
        for (;;) {
            const auto k = static_cast<std::size_t>(way);
            done(x, y) = static_cast<std::uint8_t>(done(x, y) | 1 << way);
            x += step_x[k], y += step_y[k];
            done(x, y) = static_cast<std::uint8_t>(done(x, y) | 1 << (way + 2) % 4);
            if (ways_from(x, y) > 2 || (x == x0 && y == y0)) break;
            int next = (way + 3) % 4;
            while (next == (way + 2) % 4 || !open(x, y, next)) next = (next + 1) % 4;
            if (next != way) found_.corners.push_back({x, y});
            way = next;
        }
        found_.corners.push_back({x, y});
        starts_.push_back({x, y, (way + 2) % 4, -arc - 1});
        found_.arcs.push_back({first, static_cast<std::int32_t>(found_.corners.size()) - first, right, left});
    }

    // Rings: an arc is followed by the one that goes round the same pixel, on its right, or straight on, or left.
    void link() {
        Checkpoints comparisons;
        std::sort(starts_.begin(), starts_.end(), [&](const Start& a, const Start& b) {
            comparisons.pass();
            return a.key() < b.key();
        });
        const auto arcs = static_cast<Array<char>::Index>(found_.arcs.size());
        Array<char> used(2 * arcs, 0);
        const auto place = [&](std::int32_t step) { return step >= 0 ? step : arcs - step - 1; };
        // The end of a step, and the way on which it comes there: back along the start of its reverse.
        Array<Start> reverse(2 * arcs, Start{});
        for (const Start& s : starts_) reverse[place(-s.step - 1)] = s;
        Checkpoints checkpoints(256);
        for (const Start& start : starts_) {
            checkpoints.pass();
            const std::int32_t region = on_right(start.step);
            if (region == 0 || used[place(start.step)]) continue;
            Outlines::Ring ring{static_cast<std::int32_t>(found_.steps.size()), 0, region, 0};
            for (std::int32_t step = start.step; !used[place(step)];) {
                used[place(step)] = 1;
                found_.steps.push_back(step);
                ++ring.count;
                ring.area += area(step);
                const Start& end = reverse[place(step)];
                for (int turn = 1; turn <= 4; ++turn) {  // from the way back: left of it is right of the way on
                    const auto next = find({end.x, end.y, (end.way + 4 - turn) % 4, 0});
                    if (next == nullptr) continue;
                    step = next->step;
                    break;
                }
            }
            found_.rings.push_back(ring);
        }
        std::stable_sort(found_.rings.begin(), found_.rings.end(),
                         [](const Outlines::Ring& a, const Outlines::Ring& b) {
                             return std::make_pair(a.region, a.area < 0) < std::make_pair(b.region, b.area < 0);
                         });
        std::vector<std::int32_t> ordered;
        ordered.reserve(found_.steps.size());
        for (Outlines::Ring& ring : found_.rings) {
            const auto first = found_.steps.begin() + ring.first;
            ring.first = static_cast<std::int32_t>(ordered.size());
            ordered.insert(ordered.end(), first, first + ring.count);
        }
        found_.steps.swap(ordered);
    }

    struct Start {
        int x = 0, y = 0, way = 0;
        std::int32_t step = 0;
        std::array<int, 3> key() const { return {y, x, way}; }
    };
    const Start* find(const Start& wanted) const {
        const auto at = std::lower_bound(starts_.begin(), starts_.end(), wanted,
                                         [](const Start& a, const Start& b) { return a.key() < b.key(); });
        return at != starts_.end() && at->key() == wanted.key() ? &*at : nullptr;
    }
    // What lies between an arc and the row 0, below it where it goes east.
    std::int64_t area(std::int32_t step) const {
        const Outlines::Arc& arc = found_.arcs[static_cast<std::size_t>(step >= 0 ? step : -step - 1)];
        std::int64_t sum = 0;
        for (auto k = static_cast<std::size_t>(arc.first); k + 1 < static_cast<std::size_t>(arc.first + arc.count); ++k)
            sum -= static_cast<std::int64_t>(found_.corners[k + 1][0] - found_.corners[k][0]) * found_.corners[k][1];
        return step >= 0 ? sum : -sum;
    }
    std::int32_t on_right(std::int32_t step) const {
        return step >= 0 ? found_.arcs[static_cast<std::size_t>(step)].right
                         : found_.arcs[static_cast<std::size_t>(-step - 1)].left;
    }

    int rows_, cols_;
    Outlines found_;
    RegionMap map_;
    Array<std::uint8_t> done_;   // bits of the ways that were gone, from every corner
    std::vector<Start> starts_;  // of every arc, forwards and backwards
};

double squared_distance(const double* p, const double* a, const double* b) {
    const double x = b[0] - a[0], y = b[1] - a[1], u = p[0] - a[0], v = p[1] - a[1];
    const double square = x * x + y * y;
    const double along = square > 0 ? std::min(1.0, std::max(0.0, (u * x + v * y) / square)) : 0;
    return (u - along * x) * (u - along * x) + (v - along * y) * (v - along * y);
}

// Of the points between two, the one farthest from the line through these; the first of them if all lie on it.
struct Farthest {
    std::int64_t index;
    double square;  // of its distance
};
Farthest farthest(const double* points, std::int64_t first, std::int64_t last) {
    Farthest worst{first + 1, 0};
    for (std::int64_t k = first + 1; k < last; ++k) {
        const double d = squared_distance(points + 2 * k, points + 2 * first, points + 2 * last);
        if (d > worst.square) worst = {k, d};
    }
    return worst;
}

void simplify(const double* points, const Polyline& line, std::uint8_t* kept) {
    const std::int64_t end = line.first + line.count - 1;
    const double *const first = points + 2 * line.first, *const last = points + 2 * end;
    kept[line.first] = kept[end] = 1;
    std::vector<std::array<std::int64_t, 2>> open{{line.first, end}};
    int needed = first[0] == last[0] && first[1] == last[1] ? 3 : 0;
    Checkpoints checkpoints;
    while (!open.empty()) {
        const auto [a, b] = open.back();
        open.pop_back();
        checkpoints.pass();
        const Farthest worst = farthest(points, a, b);
        if (worst.square == 0 || (worst.square <= line.tolerance * line.tolerance && needed <= 0)) continue;
        --needed;
        kept[worst.index] = 1;
        open.push_back({a, worst.index});
        open.push_back({worst.index, b});
    }
}

}  // namespace

Outlines trace_outlines(const std::int32_t* labels, int rows, int cols) { return Tracer(labels, rows, cols).trace(); }

void simplify_lines(const double* points, const std::vector<Polyline>& lines, std::uint8_t* kept) {
    for (const Polyline& line : lines) simplify(points, line, kept);
    // Whatever gets in the way of something else comes a step closer to what it replaces, which does not.
    for (bool changed = true; changed;) {
        std::vector<PlaneSegment> segments;
        std::vector<std::array<std::int64_t, 2>> ends;
        for (const Polyline& line : lines)
            for (std::int64_t k = line.first + 1, before = line.first; k < line.first + line.count; ++k) {
                if (!kept[k]) continue;
                const double *const from = points + 2 * before, *const to = points + 2 * k;
                segments.push_back({{from[0], from[1]}, {to[0], to[1]}});
                ends.push_back({before, k});
                before = k;
            }
        const std::vector<std::uint8_t> crossing = find_crossings(segments);
        changed = false;
        for (std::size_t i = 0; i < ends.size(); ++i)
            if (crossing[i] && ends[i][1] > ends[i][0] + 1) {
                kept[farthest(points, ends[i][0], ends[i][1]).index] = 1;
                changed = true;
            }
    }
}

}  // namespace rangeedge
