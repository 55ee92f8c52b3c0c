// The salient pixels of a map in a quadtree of blocks, as the search for the nearest one in salience.cpp reads it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "base/array.hpp"
#include "base/parallel.hpp"
#include "distance/distance.hpp"

namespace rangeedge {

constexpr int tile_size = 8;   // pixels of the smallest block, across and down
constexpr int group_size = 4;  // slots that lie together in memory: the four parts of a block
constexpr float huge_weight = 0x1p64f, far_away = -0x1p25f;  // of an empty slot: bounds above all others, and finite

struct Source {
    float level;  // as in the map
    std::int32_t label;
};

// Sources, or the strongest ones of blocks: w = 1 / s^2 and position.
struct Points {
    Array<float> weight, x, y;

    int groups() const { return weight.count() / group_size; }
    void resize(int slots) {
        for (Array<float>* values : {&weight, &x, &y}) values->resize(slots);
    }
};

struct Sources : Points {
    Array<Source> exact;

    void resize(int slots) {
        Points::resize(slots);
        exact.resize(slots);
    }
    void set(int slot, float w, float col, float row, const Source& source) {
        weight[slot] = w;
        x[slot] = col;
        y[slot] = row;
        exact[slot] = source;
    }
    void clear(int slot) { set(slot, huge_weight, far_away, far_away, {}); }
};

// Sums over the sources of a block, for a plane through their saliences.
struct Moments {
    double n = 0, x = 0, y = 0, s = 0, xx = 0, xy = 0, yy = 0, xs = 0, ys = 0;

    void add(double px, double py, double ps) {
        n += 1, x += px, y += py, s += ps;
        xx += px * px, xy += px * py, yy += py * py, xs += px * ps, ys += py * ps;
    }
    void add(const Moments& o) {
        n += o.n, x += o.x, y += o.y, s += o.s;
        xx += o.xx, xy += o.xy, yy += o.yy, xs += o.xs, ys += o.ys;
    }
};

// A block of sources: its strongest one, the box around all of them, a plane that none exceeds, and the groups of its
// parts: s(q) <= peak + slope_x (x - middle of the box) + slope_y (y - middle of the box).
struct Block {
    float weight = huge_weight, x = far_away, y = far_away;
    float left = far_away, right = far_away, top = far_away, bottom = far_away;
    float peak = 0.0f, slope_x = 0.0f, slope_y = 0.0f;
    int begin = 0, end = 0;

    bool empty() const { return begin == end; }
    double middle_x() const { return 0.5 * (double(left) + right); }
    double middle_y() const { return 0.5 * (double(top) + bottom); }

    void add(const Block& part) {
        if (empty()) {
            *this = part;
            return;
        }
        if (part.weight < weight) {
            weight = part.weight;
            x = part.x;
            y = part.y;
        }
        left = std::min(left, part.left);
        right = std::max(right, part.right);
        top = std::min(top, part.top);
        bottom = std::max(bottom, part.bottom);
    }

    void fit_slopes(const Moments& m) {
        const double mx = m.x / m.n, my = m.y / m.n;
        const double xx = m.xx - m.n * mx * mx + 1.0, yy = m.yy - m.n * my * my + 1.0;  // + 1: flat where undetermined
        const double xy = m.xy - m.n * mx * my, xs = m.xs - mx * m.s, ys = m.ys - my * m.s;
        const double determinant = xx * yy - xy * xy;
        slope_x = static_cast<float>((xs * yy - ys * xy) / determinant);
        slope_y = static_cast<float>((ys * xx - xs * xy) / determinant);
    }
    // What the plane would have at (px, py) with a peak of 0.
    double rise(double px, double py) const { return slope_x * (px - middle_x()) + slope_y * (py - middle_y()); }
    void raise_to(double value) { peak = std::max(peak, static_cast<float>(value) * (1.0f + 0x1p-20f) + 0x1p-40f); }
};

struct Blocks : Points {
    Array<float> left, right, top, bottom, peak, slope_x, slope_y;
    Array<int> begin, end;

    void resize(int slots) {
        Points::resize(slots);
        for (Array<float>* values : {&left, &right, &top, &bottom, &peak, &slope_x, &slope_y}) values->resize(slots);
        begin.resize(slots);
        end.resize(slots);
    }
    void set(int slot, const Block& block) {
        weight[slot] = block.weight;
        x[slot] = block.x;
        y[slot] = block.y;
        left[slot] = block.left;
        right[slot] = block.right;
        top[slot] = block.top;
        bottom[slot] = block.bottom;
        peak[slot] = block.peak;
        slope_x[slot] = block.slope_x;
        slope_y[slot] = block.slope_y;
        begin[slot] = block.begin;
        end[slot] = block.end;
    }
};

// The sources of a map in blocks of tile_size << level pixels, four parts each. Where the image wraps around, half of
// it is repeated on either side.
template <class T>
class SourceTree {
public:
    SourceTree(const T* salience, const Grid& grid, int top, Team& team)
        : levels(at(top) + 1), salience_(salience), grid_(grid), beyond_(grid.wrap ? grid.cols / 2 : 0) {
        // The branches below the highest level are counted, and then grow, side by side.
        const int size = tile_size << top;
        const int across = (grid.cols + 2 * beyond_ - 1) / size + 1, down = (grid.rows - 1) / size + 1;
        std::vector<Slots> next(at(across) * at(down), Slots(at(top) + 1, 0));
        const auto for_branches = [&](auto&& visit) {
            parallel_each(across * down, team,
                          [&](int i, int) { visit(i, i / across * size, i % across * size - beyond_); });
        };
        for_branches([&](int i, int y, int x) { count(top, y, x, next[at(i)]); });
        Slots total(at(top) + 1, 0);
        for (Slots& slots : next)
            for (std::size_t kind = 0; kind < slots.size(); ++kind)
                total[kind] += std::exchange(slots[kind], total[kind]);
        sources.resize(total[0]);
        for (int level = 0; level < top; ++level) levels[at(level)].resize(total[at(level) + 1]);
        Blocks& roots = levels.back();
        const int branches = across * down, slots = (branches + group_size - 1) / group_size * group_size;
        roots.resize(slots);
        for_branches([&](int i, int y, int x) {
            Moments moments;
            roots.set(i, grow(top, y, x, next[at(i)], moments));
        });
        for (int i = branches; i < slots; ++i) roots.set(i, {});
    }

    Sources sources;
    std::vector<Blocks> levels;

private:
    // Of a branch: how many slots it takes for its sources, and for its blocks of every level below the highest; then
    // the next ones of them.
    using Slots = std::vector<int>;

    static std::size_t at(int index) { return static_cast<std::size_t>(index); }

    // Whether there are sources in a block.
    bool count(int level, int y, int x, Slots& slots) const {
        if (y >= grid_.rows || x >= grid_.cols + beyond_) return false;
        if (level == 0) {
            int found = 0;
            for_sources(y, x, [&](int, int, std::size_t) { ++found; });
            slots[0] += (found + group_size - 1) / group_size * group_size;
            return found > 0;
        }
        Watch::checkpoint();
        const int half = tile_size << (level - 1);
        bool any = false;
        for (int k = 0; k < group_size; ++k) any |= count(level - 1, y + k / 2 * half, x + k % 2 * half, slots);
        if (any) slots[at(level)] += group_size;
        return any;
    }

    Block grow(int level, int y, int x, Slots& next, Moments& moments) {
        if (y >= grid_.rows || x >= grid_.cols + beyond_) return {};
        if (level == 0) return smallest_block(y, x, next[0], moments);
        Watch::checkpoint();
        const int half = tile_size << (level - 1);
        Block whole, parts[group_size];
        for (int k = 0; k < group_size; ++k) {
            Moments own;
            parts[k] = grow(level - 1, y + k / 2 * half, x + k % 2 * half, next, own);
            if (parts[k].empty()) continue;
            whole.add(parts[k]);
            moments.add(own);
        }
        if (whole.empty()) return whole;
        whole.peak = 0.0f;
        whole.fit_slopes(moments);
        for (const Block& part : parts) {
            if (part.empty()) continue;
            const double reach =
                std::abs(double(part.slope_x) - whole.slope_x) * (0.5 * (double(part.right) - part.left)) +
                std::abs(double(part.slope_y) - whole.slope_y) * (0.5 * (double(part.bottom) - part.top));
            whole.raise_to(part.peak - whole.rise(part.middle_x(), part.middle_y()) + reach);
        }
        int& slot = next[at(level)];
        whole.begin = slot / group_size;
        whole.end = whole.begin + 1;
        for (const Block& part : parts) levels[at(level) - 1].set(slot++, part);
        return whole;
    }

    static bool is_blank(const T* values, int n) {
        static constexpr T none[tile_size] = {};
        return std::memcmp(values, none, sizeof(T) * static_cast<std::size_t>(n)) == 0;
    }

    // Calls visit(row, position, pixel) for the sources of a smallest block.
    template <class Visit>
    void for_sources(int y0, int x0, Visit&& visit) const {
        const int y1 = std::min(y0 + tile_size, grid_.rows), x1 = std::min(x0 + tile_size, grid_.cols + beyond_);
        for (int y = y0; y < y1; ++y) {
            if (x0 >= 0 && x1 <= grid_.cols && is_blank(salience_ + grid_.index(y, x0), x1 - x0)) continue;
            for (int position = x0; position < x1; ++position) {
                const std::size_t p = grid_.index(y, position < 0 ? position + grid_.cols : position % grid_.cols);
                if (static_cast<double>(salience_[p]) >= least_salience) visit(y, position, p);
            }
        }
    }

    Block smallest_block(int y0, int x0, int& slot, Moments& moments) {
        const int first = slot;
        Block whole;
        for_sources(y0, x0, [&](int y, int position, std::size_t p) {
            const double s = static_cast<double>(salience_[p]) / salience_unit<T>;
            const auto w = static_cast<float>(1.0 / (s * s)), col = static_cast<float>(position),
                       line = static_cast<float>(y);
            sources.set(slot++, w, col, line, {static_cast<float>(salience_[p]), static_cast<std::int32_t>(p)});
            Block source{w, col, line, col, col, line, line};
            source.end = 1;  // not empty
            whole.add(source);
            moments.add(position, y, s);
        });
        if (moments.n == 0) return {};
        whole.fit_slopes(moments);
        for (int i = first; i < slot; ++i)
            whole.raise_to(sources.exact[i].level / salience_unit<T> - whole.rise(sources.x[i], sources.y[i]));
        while (slot % group_size) sources.clear(slot++);
        whole.begin = first / group_size;
        whole.end = slot / group_size;
        return whole;
    }

    const T* salience_;
    Grid grid_;
    int beyond_;
};

}  // namespace rangeedge
