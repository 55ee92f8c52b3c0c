// Uphill from every pixel, always to the highest neighbour, leads to a summit; the pixels that lead to it are a basin.
// Two neighbouring basins are linked by a pass: of the pairs of neighbouring pixels across their border, the one whose
// lower pixel is highest. The best way between two summits goes from basin to basin over passes, since within a basin
// it only goes up and down again. So a few summits and passes tell what all the pixels do. Passes are taken in falling
// order, as water that sinks uncovers them: each joins two islands, and the lower of their peaks counts by itself if
// the pass is low beside it.
//
// Ways uphill are followed in bands of rows, in parallel: within its band first, then from band to band.
// SPDX-License-Identifier: Apache-2.0
#include "regions/seeds.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "base/array.hpp"
#include "base/disjoint_sets.hpp"
#include "base/parallel.hpp"
#include "base/simd.hpp"
#include "regions/marks.hpp"

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

// Bits of the distances of a row; 0 where there is no pixel.
RANGEEDGE_WIDE void keep_levels(const float* distance, const std::uint8_t* mask, int n, float lowest,
                                std::int32_t* level) {
    for (int k = 0; k < n; ++k) level[k] = distance[k] > 0 && !(distance[k] < lowest) ? bits_of(distance[k]) : 0;
    for (int k = 0; mask && k < n; ++k) level[k] = mask[k] ? level[k] : 0;
}

// Where a row of neighbours is higher than what was found so far, they and the step to them take its place.
RANGEEDGE_WIDE void keep_highest(const std::int32_t* __restrict beside, std::int32_t step, int n,
                                 std::int32_t* __restrict highest, std::int32_t* __restrict to) {
    for (int k = 0; k < n; ++k) {
        const std::int32_t better = -(beside[k] > highest[k]);
        highest[k] = (beside[k] & better) | (highest[k] & ~better);
        to[k] = (step & better) | (to[k] & ~better);
    }
}

// Marks the pixels of a row from which one of the four neighbours after it differs.
RANGEEDGE_WIDE void mark_borders(const int* __restrict own, int stride, int n, std::uint8_t* __restrict differ) {
    const int* const below = own + stride;
    for (int k = 0; k < n; ++k) {
        const int a = own[k];
        differ[k] = ((a ^ own[k + 1]) | (a ^ below[k - 1]) | (a ^ below[k]) | (a ^ below[k + 1])) != 0;
    }
}

struct Pass {
    std::int32_t level;  // bits of its distance
    int a, b;            // summits on either side, by number; a < b

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
            for (int row = first; row < last; ++row) {
                const std::ptrdiff_t begin = static_cast<std::ptrdiff_t>(row) * cols;
                keep_levels(distance + begin, mask ? mask + begin : nullptr, cols, lowest, &level_[index(row, 0)]);
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

    // The number of every pixel's summit, -1 of no pixel; and all summits in raster order.
    struct Basins {
        Array<int> summit;
        std::vector<int> summits;
    };
    Basins basins() const;
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

DistanceImage::Basins DistanceImage::basins() const {
    Basins basins{Array<int>(level_.size(), 0), {}};
    Array<int>& uphill = basins.summit;
    const auto around = neighbours();
    // Of every thread, in raster order: summits, and pixels from which the way leads into another band.
    struct Found {
        std::vector<int> summits, exits;
    };
    std::vector<Found> found(static_cast<std::size_t>(team_.size()));
    parallel_for(rows_, team_, [&](int first, int last, int thread) {
        // A row at a time, without branches, so that many pixels are compared at once.
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
        // Ways are shortened while they are followed.
        auto& [summits, exits] = found[static_cast<std::size_t>(thread)];
        const int band_begin = index(first, 0), band_end = index(last, 0);
        const auto leaves = [=](int q) { return q < band_begin || q >= band_end; };
        int* const up = uphill.data();
        for_pixels(first, last, [&, up](int p) {
            if (up[p] == p) {
                summits.push_back(p);
            } else if (leaves(up[p])) {
                exits.push_back(p);
            } else {
                int q = up[p];
                for (int next = up[q]; next != q && !leaves(next); next = up[q]) {
                    if (!leaves(up[next])) up[q] = up[next];
                    q = next;
                }
                up[p] = q;
            }
        });
    });
    for (const Found& of_thread : found) {
        basins.summits.insert(basins.summits.end(), of_thread.summits.begin(), of_thread.summits.end());
        for (const int p : of_thread.exits) {
            int q = p;
            while (uphill[q] != q) q = uphill[q] = uphill[uphill[q]];
            uphill[p] = q;
        }
    }
    const std::unique_ptr<int[]> number(new int[static_cast<std::size_t>(uphill.size())]);  // at summits alone
    for (std::size_t k = 0; k < basins.summits.size(); ++k)
        number[static_cast<std::size_t>(basins.summits[k])] = static_cast<int>(k);
    Array<int> summit(level_.size(), -1);
    parallel_for(rows_, team_, [&](int first, int last, int) {
        for_pixels(first, last, [&](int p) {
            int q = uphill[p];
            while (uphill[q] != q) q = uphill[q];
            summit[p] = number[static_cast<std::size_t>(q)];
        });
    });
    copy_around(summit);
    uphill.swap(summit);
    return basins;
}

// The highest pass between any two basins that touch, and some lower ones; the highest first.
std::vector<Pass> DistanceImage::passes(const Array<int>& summit) const {
    struct Found {
        std::vector<Pass> passes;
        std::array<std::size_t, 256> recent{};  // places of passes found lately, by their sides
    };
    std::vector<Found> found(static_cast<std::size_t>(team_.size()));
    const std::array<int, 4> forward{1, stride() - 1, stride(), stride() + 1};
    parallel_for(rows_, team_, [&](int first, int last, int thread) {
        auto& [passes, recent] = found[static_cast<std::size_t>(thread)];
        const auto add = [&passes = passes, &recent = recent](const Pass& pass) {
            const auto slot =
                (31 * static_cast<std::size_t>(pass.a) + static_cast<std::size_t>(pass.b)) % recent.size();
            const std::size_t k = recent[slot];
            if (k < passes.size() && passes[k].same_sides(pass)) {
                passes[k].level = std::max(passes[k].level, pass.level);
            } else {
                recent[slot] = passes.size();
                passes.push_back(pass);
            }
        };
        std::vector<std::uint8_t> differ(marks_size(cols_));
        for (int row = first; row < last; ++row) {
            Watch::checkpoint();
            const int begin = index(row, 0);
            mark_borders(&summit[begin], stride(), cols_, differ.data());
            for_marked(differ.data(), cols_, [&](int col) {
                const int p = begin + col, a = summit[p];
                if (a < 0) return;
                for (const int step : forward) {
                    const int b = summit[p + step];
                    if (a == b || b < 0) continue;
                    add({std::min(level_[p], level_[p + step]), std::min(a, b), std::max(a, b)});
                }
            });
        }
    });
    std::vector<Pass> all;
    for (const Found& of_thread : found) all.insert(all.end(), of_thread.passes.begin(), of_thread.passes.end());
    Checkpoints checkpoints;
    std::sort(all.begin(), all.end(), [&](const Pass& m, const Pass& n) {
        checkpoints.pass();
        return m.level != n.level ? m.level > n.level : std::make_pair(m.a, m.b) < std::make_pair(n.a, n.b);
    });
    return all;
}

// Summits that count by themselves.
std::vector<int> peaks(const DistanceImage& image, const DistanceImage::Basins& basins, float separation) {
    // Islands are known by the number of their highest summit, in raster order.
    const std::vector<int>& summits = basins.summits;
    DisjointSets islands(static_cast<int>(summits.size()));
    const auto at = [&](int i) { return summits[static_cast<std::size_t>(i)]; };
    std::vector<int> found;
    Checkpoints checkpoints;
    for (const Pass& pass : image.passes(basins.summit)) {
        checkpoints.pass();
        int low = islands.find(pass.a), high = islands.find(pass.b);
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
    std::vector<int> wanted;
    for (const int peak : peaks(image, image.basins(), separation))
        if (!(image[peak] < min_distance)) wanted.push_back(peak);
    const int seeds = static_cast<int>(wanted.size());
    // Flood every seed from its peak. As they never touch, this may happen at once.
    Array<int> seed(image.size(), 0), first(seeds);
    parallel_each(seeds, team, [&](int s, int) {
        const int peak = wanted[static_cast<std::size_t>(s)];
        // Where all is infinitely far, or `separation` vanishes in single precision, nothing but no pixel is too low.
        const float share = separation * image[peak];
        const std::int32_t least = bits_of(share > 0 ? share : std::numeric_limits<float>::denorm_min());
        const auto around = image.neighbours();
        seed[peak] = s + 1;
        std::vector<int> stack(1, peak);
        int lowest = peak;
        Checkpoints checkpoints;
        while (!stack.empty()) {
            checkpoints.pass();
            const int p = stack.back();
            stack.pop_back();
            lowest = std::min(lowest, p);
            for (const int step : around) {
                const int q = image.own(p + step);
                if (!image.reaches(q, least) || seed[q]) continue;
                seed[q] = s + 1;
                stack.push_back(q);
            }
        }
        first[s] = lowest;
    });
    // Number them by their first pixels.
    Array<int> number(seeds + 1, 0);
    std::vector<int> order(wanted.size());
    for (int s = 0; s < seeds; ++s) order[static_cast<std::size_t>(s)] = s;
    std::sort(order.begin(), order.end(), [&](int a, int b) { return first[a] < first[b]; });
    for (int n = 0; n < seeds; ++n) number[order[static_cast<std::size_t>(n)] + 1] = n + 1;
    parallel_for(height, team, [&](int begin, int end, int) {
        for (int row = begin; row < end; ++row) {
            const int* const own = &seed[image.index(row, 0)];
            std::int32_t* const to = markers + static_cast<std::ptrdiff_t>(row) * width;
            for (int col = 0; col < width; ++col) to[col] = number[own[col]];
        }
    });
    return seeds;
}

}  // namespace rangeedge
