// Uphill from every pixel, always to the highest neighbour, leads to a summit; the pixels that lead to it are a basin.
// Two neighbouring basins are linked by a pass: of the pairs of neighbouring pixels across their border, the one whose
// lower pixel is highest. The best way between two summits goes from basin to basin over passes, since within a basin
// it only goes up and down again. So a few summits and passes tell what all the pixels do. Passes are taken in falling
// order, as water that sinks uncovers them: each joins two islands, and the lower of their peaks counts by itself if
// the pass is low beside it.
// SPDX-License-Identifier: Apache-2.0
#include "regions/seeds.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "base/array.hpp"
#include "base/disjoint_sets.hpp"
#include "base/parallel.hpp"

namespace rangeedge {
namespace {

// The bits of floats >= 0 are ordered as their values are, and compared faster.
std::int32_t bits_of(float value) {
    std::int32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    return bits;
}
float value_of(std::int32_t bits) {
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

// Where a row of neighbours is higher than what was found so far, they and the step to them take its place.
void keep_highest(const std::int32_t* __restrict beside, std::int32_t step, int n, std::int32_t* __restrict highest,
                  std::int32_t* __restrict to) {
    for (int k = 0; k < n; ++k) {
        const std::int32_t better = -(beside[k] > highest[k]);
        highest[k] = (beside[k] & better) | (highest[k] & ~better);
        to[k] = (step & better) | (to[k] & ~better);
    }
}

struct Pass {
    std::int32_t level;  // bits of its distance
    int a, b;            // summits on either side, in order of index

    bool same_sides(const Pass& other) const { return a == other.a && b == other.b; }
};

// A distance map in an image with a margin of one pixel; 0 is no pixel. Where it wraps, the margin beside the first
// column is a copy of the last column and the other way round, and `own` tells the pixel itself.
class DistanceImage {
public:
    DistanceImage(const float* distance, const std::uint8_t* mask, int rows, int cols, bool wrap, float lowest,
                  Team& team)
        : rows_(rows), cols_(cols), wrap_(wrap), team_(team), level_((rows + 2) * stride(), 0) {
        parallel_for(rows, team, [&](int first, int last, int) {
            for (int row = first; row < last; ++row)
                for (int col = 0; col < cols; ++col) {
                    const int k = row * cols + col;
                    const bool exists = distance[k] > 0 && !(distance[k] < lowest) && (!mask || mask[k]);
                    level_[index(row, col)] = exists ? bits_of(distance[k]) : 0;
                }
        });
        copy_around(level_);
    }

    int stride() const { return cols_ + 2; }
    int index(int row, int col) const { return (row + 1) * stride() + col + 1; }
    int size() const { return level_.count(); }
    int own(int p) const {
        if (!wrap_) return p;
        const int col = p % stride();
        return col == 0 ? p + cols_ : col > cols_ ? p - cols_ : p;
    }
    float operator[](int p) const { return value_of(level_[p]); }
    bool reaches(int p, std::int32_t least) const { return level_[p] >= least; }
    std::array<int, 8> neighbours() const {
        const int s = stride();
        return {-s - 1, -s, -s + 1, -1, 1, s - 1, s, s + 1};
    }
    // Of two pixels of one distance, that of lower index is the higher.
    bool higher(int p, int q) const { return level_[p] > level_[q] || (level_[p] == level_[q] && p < q); }

    Array<int> basins() const;
    std::vector<Pass> passes(const Array<int>& summit) const;
    template <class F>
    void for_pixels(int first, int last, F&& visit) const {
        for (int row = first; row < last; ++row) {
            Watch::checkpoint();
            for (int p = index(row, 0), end = p + cols_; p < end; ++p)
                if (level_[p] > 0) visit(p);
        }
    }
    int rows() const { return rows_; }

private:
    void copy_around(Array<std::int32_t>& values) const {
        for (int row = 0; wrap_ && row < rows_; ++row) {
            const int first = index(row, 0), last = index(row, cols_ - 1);
            values[first - 1] = values[last], values[last + 1] = values[first];
        }
    }
    // The highest of a pixel and its neighbours.
    int highest_around(int p) const {
        int top = p;
        for (const int step : neighbours())
            if (const int q = own(p + step); higher(q, top)) top = q;
        return top;
    }

    int rows_, cols_;
    bool wrap_;
    Team& team_;
    Array<std::int32_t> level_;  // bits of distances
};

// The summit of every pixel.
Array<int> DistanceImage::basins() const {
    Array<int> uphill(level_.size(), 0);
    const auto around = neighbours();
    // A row at a time, without branches, so that many pixels are compared at once.
    parallel_for(rows_, team_, [&](int first, int last, int) {
        std::vector<std::int32_t> top(static_cast<std::size_t>(cols_));
        for (int row = first; row < last; ++row) {
            const int begin = index(row, 0);
            const std::int32_t* const own = &level_[begin];
            int* const to = &uphill[begin];
            std::fill(top.begin(), top.end(), -1);
            for (std::size_t k = 0; k < 4; ++k)
                keep_highest(own + around[k], around[k], cols_, top.data(), to);  // of lower index: higher where equal
            keep_highest(own, 0, cols_, top.data(), to);
            for (std::size_t k = 4; k < 8; ++k) keep_highest(own + around[k], around[k], cols_, top.data(), to);
            for (int k = 0; k < cols_; ++k) to[k] += begin + k;
            if (!wrap_) continue;
            for (const int k : {0, cols_ - 1}) to[k] = highest_around(begin + k);  // of copies the index is another
        }
    });
    // Ways are shortened while they are followed.
    for_pixels(0, rows_, [&](int p) {
        int q = p;
        while (uphill[q] != q) q = uphill[q] = uphill[uphill[q]];
        uphill[p] = q;
    });
    copy_around(uphill);
    return uphill;
}

// The highest pass between any two basins that touch, the highest first.
std::vector<Pass> DistanceImage::passes(const Array<int>& summit) const {
    std::vector<std::vector<Pass>> found(static_cast<std::size_t>(team_.size()));
    const std::array<int, 4> forward{1, stride() - 1, stride(), stride() + 1};
    parallel_for(rows_, team_, [&](int first, int last, int thread) {
        auto& passes = found[static_cast<std::size_t>(thread)];
        for_pixels(first, last, [&](int p) {
            if (((summit[p] ^ summit[p + 1]) | (summit[p] ^ summit[p + stride() - 1]) |
                 (summit[p] ^ summit[p + stride()]) | (summit[p] ^ summit[p + stride() + 1])) == 0)
                return;
            for (const int step : forward) {
                const int a = summit[p], b = summit[p + step];
                if (a == b || !(level_[p + step] > 0)) continue;
                const Pass pass{std::min(level_[p], level_[p + step]), std::min(a, b), std::max(a, b)};
                if (!passes.empty() && passes.back().same_sides(pass))
                    passes.back().level = std::max(passes.back().level, pass.level);
                else
                    passes.push_back(pass);
            }
        });
    });
    std::vector<Pass> all;
    for (const auto& passes : found) all.insert(all.end(), passes.begin(), passes.end());
    Checkpoints checkpoints;
    std::sort(all.begin(), all.end(), [&](const Pass& m, const Pass& n) {
        checkpoints.pass();
        return m.level != n.level ? m.level > n.level : std::make_pair(m.a, m.b) < std::make_pair(n.a, n.b);
    });
    return all;
}

// Summits that count by themselves.
std::vector<int> peaks(const DistanceImage& image, const Array<int>& summit, float separation) {
    std::vector<int> summits;
    image.for_pixels(0, image.rows(), [&](int p) {
        if (summit[p] == p) summits.push_back(p);
    });
    // Islands are known by the number of their highest summit, in raster order.
    DisjointSets islands(static_cast<int>(summits.size()));
    const auto number = [&](int p) {
        return static_cast<int>(std::lower_bound(summits.begin(), summits.end(), p) - summits.begin());
    };
    const auto at = [&](int i) { return summits[static_cast<std::size_t>(i)]; };
    std::vector<int> found;
    Checkpoints checkpoints;
    for (const Pass& pass : image.passes(summit)) {
        checkpoints.pass();
        int low = islands.find(number(pass.a)), high = islands.find(number(pass.b));
        if (low == high) continue;
        if (image.higher(at(low), at(high))) std::swap(low, high);
        if (value_of(pass.level) < separation * image[at(low)]) found.push_back(at(low));
        islands.link(low, high);
    }
    for (int i = 0; i < islands.size(); ++i)
        if (islands.is_root(i)) found.push_back(at(i));
    return found;
}

}  // namespace

int extract_seeds(const float* distance, const std::uint8_t* mask, int height, int width, bool wrap, float min_distance,
                  float separation, int threads, std::int32_t* markers) {
    Team team(threads);
    const DistanceImage image(distance, mask, height, width, wrap, separation * min_distance, team);
    // Flood every seed from its peak.
    Array<int> seed(image.size(), 0);
    std::vector<int> stack;
    int seeds = 0;
    Checkpoints checkpoints;
    for (const int peak : peaks(image, image.basins(), separation)) {
        if (image[peak] < min_distance) continue;
        // Where all is infinitely far, or `separation` vanishes in single precision, nothing but no pixel is too low.
        const float share = separation * image[peak];
        const std::int32_t least = bits_of(share > 0 ? share : std::numeric_limits<float>::denorm_min());
        seed[peak] = ++seeds;
        stack.assign(1, peak);
        while (!stack.empty()) {
            checkpoints.pass();
            const int p = stack.back();
            stack.pop_back();
            for (const int step : image.neighbours()) {
                const int q = image.own(p + step);
                if (!image.reaches(q, least) || seed[q]) continue;
                seed[q] = seeds;
                stack.push_back(q);
            }
        }
    }
    // Number them.
    Array<int> number(seeds + 1, 0);
    int count = 0;
    for (int row = 0; row < height; ++row)
        for (int col = 0; col < width; ++col) {
            const int own = seed[image.index(row, col)];
            if (own && !number[own]) number[own] = ++count;
            markers[row * width + col] = number[own];
        }
    return count;
}

}  // namespace rangeedge
