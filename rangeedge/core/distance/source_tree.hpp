// The salient pixels of a map in a quadtree of blocks, as the search for the nearest one in salience.cpp reads it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "base/parallel.hpp"
#include "distance/distance.hpp"

namespace rangeedge {

constexpr int tile_size = 8;   // pixels of the smallest block, across and down
constexpr int group_size = 4;  // slots that lie together in memory: the four parts of a block
constexpr float huge_weight = 0x1p64f, far_away = -0x1p25f;  // of an empty slot: bounds above all others, and finite

template <class T>
void append(std::vector<T>& to, const std::vector<T>& more) {
    to.insert(to.end(), more.begin(), more.end());
}

struct Source {
    float level;  // as in the map
    std::int32_t label;
};

// Sources, or the strongest ones of blocks: w = 1 / s^2 and position.
struct Points {
    std::vector<float> weight, x, y;

    int groups() const { return static_cast<int>(weight.size()) / group_size; }
    void append(const Points& more) {
        rangeedge::append(weight, more.weight);
        rangeedge::append(x, more.x);
        rangeedge::append(y, more.y);
    }
};

struct Sources : Points {
    std::vector<Source> exact;

    void push(float w, float col, float row, const Source& source) {
        weight.push_back(w);
        x.push_back(col);
        y.push_back(row);
        exact.push_back(source);
    }
    void fill_group() {
        while (weight.size() % group_size) push(huge_weight, far_away, far_away, {});
    }
    void append(const Sources& more) {
        Points::append(more);
        rangeedge::append(exact, more.exact);
    }
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
    std::vector<float> left, right, top, bottom, peak, slope_x, slope_y;
    std::vector<int> begin, end;

    void push(const Block& block) {
        weight.push_back(block.weight);
        x.push_back(block.x);
        y.push_back(block.y);
        left.push_back(block.left);
        right.push_back(block.right);
        top.push_back(block.top);
        bottom.push_back(block.bottom);
        peak.push_back(block.peak);
        slope_x.push_back(block.slope_x);
        slope_y.push_back(block.slope_y);
        begin.push_back(block.begin);
        end.push_back(block.end);
    }
    // `parts` groups of parts come before those of `more`.
    void append(const Blocks& more, int parts) {
        Points::append(more);
        rangeedge::append(left, more.left);
        rangeedge::append(right, more.right);
        rangeedge::append(top, more.top);
        rangeedge::append(bottom, more.bottom);
        rangeedge::append(peak, more.peak);
        rangeedge::append(slope_x, more.slope_x);
        rangeedge::append(slope_y, more.slope_y);
        for (const int group : more.begin) begin.push_back(group + parts);
        for (const int group : more.end) end.push_back(group + parts);
    }
};

// The sources of a map in blocks of tile_size << level pixels, four parts each. Where the image wraps around, half of
// it is repeated on either side.
template <class T>
class SourceTree {
public:
    SourceTree(const T* salience, const Grid& grid, int top, Team& team)
        : levels(static_cast<std::size_t>(top) + 1), salience_(salience), grid_(grid),
          beyond_(grid.wrap ? grid.cols / 2 : 0) {
        // The branches below the highest level grow side by side.
        const int size = tile_size << top;
        const int across = (grid.cols + 2 * beyond_ - 1) / size + 1, down = (grid.rows - 1) / size + 1;
        std::vector<Branch> branches(static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
        parallel_each(across * down, team, [&](int i, int) {
            Branch& branch = branches[static_cast<std::size_t>(i)];
            branch.levels.resize(static_cast<std::size_t>(top));
            Moments moments;
            branch.root = grow(branch, top, i / across * size, i % across * size - beyond_, moments);
        });
        for (Branch& branch : branches) {
            const auto parts_before = [&](std::size_t level) {
                return level > 0 ? levels[level - 1].groups() : sources.groups();
            };
            Blocks root;
            root.push(branch.root);
            levels.back().append(root, parts_before(levels.size() - 1));
            for (std::size_t level = levels.size() - 1; level-- > 0;)
                levels[level].append(branch.levels[level], parts_before(level));
            sources.append(branch.sources);
            branch = {};
        }
        while (levels.back().weight.size() % group_size) levels.back().push({});
    }

    Sources sources;
    std::vector<Blocks> levels;

private:
    struct Branch {
        Block root;
        std::vector<Blocks> levels;
        Sources sources;
    };

    Block grow(Branch& branch, int level, int y, int x, Moments& moments) const {
        if (y >= grid_.rows || x >= grid_.cols + beyond_) return {};
        if (level == 0) return smallest_block(branch.sources, y, x, moments);
        Watch::checkpoint();
        const int half = tile_size << (level - 1);
        Block whole, parts[group_size];
        for (int k = 0; k < group_size; ++k) {
            Moments own;
            parts[k] = grow(branch, level - 1, y + k / 2 * half, x + k % 2 * half, own);
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
        Blocks& finer = branch.levels[static_cast<std::size_t>(level) - 1];
        whole.begin = finer.groups();
        whole.end = whole.begin + 1;
        for (const Block& part : parts) finer.push(part);
        return whole;
    }

    static bool is_blank(const T* values, int n) {
        static constexpr T none[tile_size] = {};
        return std::memcmp(values, none, sizeof(T) * static_cast<std::size_t>(n)) == 0;
    }

    Block smallest_block(Sources& found, int y0, int x0, Moments& moments) const {
        const int y1 = std::min(y0 + tile_size, grid_.rows), x1 = std::min(x0 + tile_size, grid_.cols + beyond_);
        const int begin = found.groups();
        const std::size_t first = found.weight.size();
        Block whole;
        for (int y = y0; y < y1; ++y) {
            if (x0 >= 0 && x1 <= grid_.cols && is_blank(salience_ + grid_.index(y, x0), x1 - x0)) continue;
            for (int position = x0; position < x1; ++position) {
                const int x = position < 0 ? position + grid_.cols : position % grid_.cols;
                const std::size_t p = grid_.index(y, x);
                const double level = static_cast<double>(salience_[p]);
                if (level < least_salience) continue;
                const double s = level / salience_unit<T>;
                const auto w = static_cast<float>(1.0 / (s * s)), col = static_cast<float>(position),
                           line = static_cast<float>(y);
                found.push(w, col, line, {static_cast<float>(salience_[p]), static_cast<std::int32_t>(p)});
                Block source{w, col, line, col, col, line, line};
                source.end = 1;  // not empty
                whole.add(source);
                moments.add(position, y, s);
            }
        }
        if (moments.n == 0) return {};
        whole.fit_slopes(moments);
        for (std::size_t i = first; i < found.weight.size(); ++i)
            whole.raise_to(found.exact[i].level / salience_unit<T> - whole.rise(found.x[i], found.y[i]));
        found.fill_group();
        whole.begin = begin;
        whole.end = found.groups();
        return whole;
    }

    const T* salience_;
    Grid grid_;
    int beyond_;
};

}  // namespace rangeedge
