// Uphill from every pixel, always to the highest neighbour, leads to a summit; the pixels that lead to it are a basin.
// Two neighbouring basins are linked by a pass: of the pairs of neighbouring pixels across their border, the one whose
// lower pixel is highest. The best way between two summits goes from basin to basin over passes, since within a basin
// it only goes up and down again. So a few summits and passes tell what all the pixels do. Passes are taken in falling
// order, as water that sinks uncovers them: each joins two islands, and the lower of their peaks counts by itself if
// the pass is low beside it. The seed of a peak is what rises above its share in the basins that have joined its
// island by then.
//
// Nothing is kept of a pixel but its marker, which is first the neighbour uphill, then the basin. Ways uphill are
// followed in bands of rows, in parallel: within its band first, then from band to band.
// SPDX-License-Identifier: Apache-2.0
#include "regions/seeds.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "base/array.hpp"
#include "base/disjoint_sets.hpp"
#include "base/parallel.hpp"
#include "base/simd.hpp"
#include "regions/marks.hpp"

namespace rangeedge {
namespace {

// The bits of floats >= 0 are ordered as their values are, and compared faster: the level of a pixel.
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

// A marker on the way: an index uphill; or `no_pixel`; or less than that, of a basin by number.
constexpr int no_pixel = -1;
constexpr bool is_basin(int marker) { return marker < no_pixel; }
constexpr int basin_of(int marker) { return -2 - marker; }
constexpr int marker_of(int basin) { return -2 - basin; }

// ---- Loops over the pixels of a row ----

// Levels of a row of distances; 0 where there is no pixel.
RANGEEDGE_WIDE void read_levels(const float* distance, const std::uint8_t* mask, int n, float lowest,
                                std::int32_t* level) {
    for (int k = 0; k < n; ++k) level[k] = distance[k] > 0 && !(distance[k] < lowest) ? bits_of(distance[k]) : 0;
    for (int k = 0; mask && k < n; ++k) level[k] = mask[k] ? level[k] : 0;
}

// Every pixel's highest neighbour, or itself; of equally high ones the first in raster order. `first` is the index of
// the row's first pixel, `cols` what lies between the indices of two rows.
RANGEEDGE_WIDE void look_uphill(const std::int32_t* above, const std::int32_t* own, const std::int32_t* below,
                                int first, int cols, int* __restrict uphill) {
    for (int k = 0; k < cols; ++k) {
        std::int32_t top = above[k - 1], step = -cols - 1;
        const auto see = [&](std::int32_t level, int to) RANGEEDGE_ALWAYS {
            step = level > top ? to : step;
            top = std::max(top, level);
        };
        see(above[k], -cols);
        see(above[k + 1], -cols + 1);
        see(own[k - 1], -1);
        see(own[k], 0);
        see(own[k + 1], 1);
        see(below[k - 1], cols - 1);
        see(below[k], cols);
        see(below[k + 1], cols + 1);
        uphill[k] = own[k] > 0 ? first + k + step : no_pixel;
    }
}

// Marks the pixels of basins in a row from which one of the four neighbours after it may differ.
RANGEEDGE_WIDE void mark_borders(const int* __restrict own, const int* __restrict below, int n,
                                 std::uint8_t* __restrict differ) {
    differ[0] = differ[n - 1] = 1;  // a neighbour may lie beyond the end of the row
    for (int k = 1; k < n - 1; ++k) {
        const int a = own[k];
        const bool alike = ((a ^ own[k + 1]) | (a ^ below[k - 1]) | (a ^ below[k]) | (a ^ below[k + 1])) == 0;
        differ[k] = !alike & is_basin(a);
    }
}

// ---- Distances as a landscape ----

struct Pass {
    std::int32_t level;
    int a, b;  // basins on either side, a < b

    bool same_sides(const Pass& other) const { return a == other.a && b == other.b; }
};

// What there is of a seed in a basin: the pixels that reach a level. Number 0 is none.
struct Seed {
    int number = 0;
    std::int32_t least = 0;
};

class Landscape {
public:
    Landscape(const float* distance, const std::uint8_t* mask, int rows, int cols, bool wrap, float lowest, Team& team,
              std::int32_t* markers)
        : distance_(distance), mask_(mask), rows_(rows), cols_(cols), wrap_(wrap), lowest_(lowest), team_(team),
          markers_(markers) {}

    // Markers become basins. Returns their summits, in raster order.
    Array<int> find_basins();
    // The highest pass between any two basins that touch, and some lower ones; the highest first. Those that are lower
    // than `share` of the summits on both sides are left out: a way over one of them leads to no peak that counts.
    std::vector<Pass> find_passes(const Array<float>& share) const;
    // Markers become numbers of seeds, of which there are `count`, by what there is of them in the basins; and these
    // are numbered anew, in raster order of their first pixels.
    void paint(const Array<Seed>& seeds, int count);

    // Of two pixels of one distance, that of lower index is the higher.
    bool higher(int p, int q) const { return distance_[p] > distance_[q] || (distance_[p] == distance_[q] && p < q); }
    float operator[](int p) const { return distance_[p]; }

private:
    // Levels of the rows around one, with a margin of one pixel: 0, or where the image wraps a copy of the other side.
    class Levels {
    public:
        explicit Levels(const Landscape& of) : of_(of) {
            for (Array<std::int32_t>& row : rows_) row.resize(of.cols_ + 2);
        }
        void read(int row) {
            Array<std::int32_t>& levels = rows_[slot(row)];
            if (row < 0 || row >= of_.rows_) return levels.assign(levels.size(), 0);
            const std::ptrdiff_t begin = of_.index(row, 0);
            read_levels(of_.distance_ + begin, of_.mask_ ? of_.mask_ + begin : nullptr, of_.cols_, of_.lowest_,
                        &levels[1]);
            levels[0] = of_.wrap_ ? levels[of_.cols_] : 0;
            levels[of_.cols_ + 1] = of_.wrap_ ? levels[1] : 0;
        }
        const std::int32_t* operator[](int row) const { return &rows_[slot(row)][1]; }

    private:
        static std::size_t slot(int row) { return static_cast<std::size_t>(row + 3) % 3; }

        const Landscape& of_;
        std::array<Array<std::int32_t>, 3> rows_;
    };

    int index(int row, int col) const { return row * cols_ + col; }
    int around(int col) const { return col < 0 ? col + cols_ : col < cols_ ? col : col - cols_; }
    std::int32_t level(int p) const { return bits_of(distance_[p]); }

    void look_uphill_in(int first, int last) const;
    int highest_around(const Levels& levels, int row, int col) const;

    const float* distance_;
    const std::uint8_t* mask_;
    int rows_, cols_;
    bool wrap_;
    float lowest_;
    Team& team_;
    std::int32_t* markers_;
};

void Landscape::look_uphill_in(int first, int last) const {
    Levels levels(*this);
    levels.read(first - 1);
    levels.read(first);
    for (int row = first; row < last; ++row) {
        levels.read(row + 1);
        int* const uphill = markers_ + index(row, 0);
        look_uphill(levels[row - 1], levels[row], levels[row + 1], index(row, 0), cols_, uphill);
        if (!wrap_) continue;
        for (const int col : {0, cols_ - 1})
            if (levels[row][col] > 0) uphill[col] = highest_around(levels, row, col);
    }
}

// The highest of a pixel and its neighbours, some of them at the other side of the image.
int Landscape::highest_around(const Levels& levels, int row, int col) const {
    int top = index(row, col);
    for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
            if (levels[row + dy][col + dx] > 0)
                if (const int q = index(row + dy, around(col + dx)); higher(q, top)) top = q;
    return top;
}

Array<int> Landscape::find_basins() {
    struct Found {
        std::vector<int> summits, exits;  // exits: pixels from where the way leaves the band
    };
    std::vector<Found> found(static_cast<std::size_t>(team_.size()));
    parallel_for(rows_, team_, [&](int first, int last, int thread) {
        look_uphill_in(first, last);
        // Ways are shortened once they are followed: they lead to a summit or an exit at once.
        auto& [summits, exits] = found[static_cast<std::size_t>(thread)];
        const int begin = index(first, 0), end = index(last, 0);
        const auto leaves = [=](int q) { return q < begin || q >= end; };
        int* const up = markers_;
        Checkpoints checkpoints;
        for (int p = begin; p < end; ++p) {
            checkpoints.pass();
            int q = up[p];
            if (q == no_pixel) continue;
            if (q == p) {
                summits.push_back(p);
            } else if (leaves(q)) {
                exits.push_back(p);
            } else {
                for (int next = up[q]; next != q && !leaves(next); next = up[q]) q = next;
                for (int r = p; r != q;) r = std::exchange(up[r], q);
            }
        }
    });
    Array<int> summits;
    for (const Found& of_thread : found)
        for (const int p : of_thread.summits) {
            markers_[p] = marker_of(summits.count());
            summits.push_back(p);
        }
    Checkpoints checkpoints;
    for (const Found& of_thread : found)
        for (const int p : of_thread.exits) {
            checkpoints.pass();
            int q = p;
            while (!is_basin(markers_[q])) q = markers_[q];
            markers_[p] = markers_[q];
        }
    parallel_for(rows_, team_, [&](int first, int last, int) {
        int* const own = markers_;
        RANGEEDGE_INDEPENDENT  // of what is neither summit nor exit
            for (int p = index(first, 0); p < index(last, 0); ++p) if (own[p] >= 0) own[p] = own[own[p]];
    });
    return summits;
}

std::vector<Pass> Landscape::find_passes(const Array<float>& share) const {
    struct Found {
        std::vector<Pass> passes;
        std::array<std::size_t, 256> recent{};  // places of passes found lately, by their sides
    };
    std::vector<Found> found(static_cast<std::size_t>(team_.size()));
    parallel_for(rows_, team_, [&](int first, int last, int thread) {
        auto& [passes, recent] = found[static_cast<std::size_t>(thread)];
        const auto see = [&, this, &passes = passes, &recent = recent](int p, int q) {
            if (markers_[p] == markers_[q] || !is_basin(markers_[q])) return;
            const auto [a, b] = std::minmax({basin_of(markers_[p]), basin_of(markers_[q])});
            const Pass pass{std::min(level(p), level(q)), a, b};
            if (value_of(pass.level) < std::min(share[a], share[b])) return;
            const std::size_t slot = (31 * static_cast<std::size_t>(a) + static_cast<std::size_t>(b)) % recent.size();
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
            const int *const own = markers_ + index(row, 0), *const below = row + 1 < rows_ ? own + cols_ : own;
            mark_borders(own, below, cols_, differ.data());
            for_marked(differ.data(), cols_, [&](int col) {
                const int p = index(row, col);
                if (!is_basin(own[col])) return;
                const bool left = wrap_ || col > 0, right = wrap_ || col + 1 < cols_;
                if (right) see(p, index(row, around(col + 1)));
                if (row + 1 == rows_) return;
                if (left) see(p, index(row + 1, around(col - 1)));
                see(p, p + cols_);
                if (right) see(p, index(row + 1, around(col + 1)));
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

// What is the least so far becomes the least of that and a value.
void lower(std::atomic<int>& least, int value) {
    int known = least.load(std::memory_order_relaxed);
    while (value < known && !least.compare_exchange_weak(known, value, std::memory_order_relaxed)) {
    }
}

void Landscape::paint(const Array<Seed>& seeds, int count) {
    std::vector<std::atomic<int>> first_pixel(static_cast<std::size_t>(count) + 1);
    for (auto& p : first_pixel) p.store(std::numeric_limits<int>::max(), std::memory_order_relaxed);
    parallel_for(rows_, team_, [&](int first, int last, int) {
        int before = 0;
        for (int p = index(first, 0); p < index(last, 0); ++p) {
            int own = 0;
            if (is_basin(markers_[p])) {
                const Seed& seed = seeds[basin_of(markers_[p])];
                own = level(p) >= seed.least ? seed.number : 0;
            }
            markers_[p] = own;
            if (own != before) lower(first_pixel[static_cast<std::size_t>(own)], p);
            before = own;
        }
    });
    std::vector<int> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), 1);
    std::sort(order.begin(), order.end(), [&](int a, int b) {
        return first_pixel[static_cast<std::size_t>(a)] < first_pixel[static_cast<std::size_t>(b)];
    });
    Array<int> number(count + 1, 0);
    for (int n = 0; n < count; ++n) number[order[static_cast<std::size_t>(n)]] = n + 1;
    parallel_for(rows_, team_, [&](int first, int last, int) {
        for (int p = index(first, 0); p < index(last, 0); ++p) markers_[p] = number[markers_[p]];
    });
}

}  // namespace

int extract_seeds(const float* distance, const std::uint8_t* mask, int height, int width, bool wrap, float min_distance,
                  float separation, int threads, std::int32_t* markers) {
    Team team(threads);
    Landscape landscape(distance, mask, height, width, wrap, separation * min_distance, team, markers);
    const Array<int> summits = landscape.find_basins();
    const int count = summits.count();
    Array<float> share(count);
    // Zero times infinity is no share, where all is infinitely far and `separation` vanishes in single precision.
    for (int i = 0; i < count; ++i) share[i] = separation > 0 ? separation * landscape[summits[i]] : 0;

    // Islands are known by the number of their highest summit.
    struct Join {
        int low, high;
        std::int32_t level;
    };
    std::vector<Join> joins;
    DisjointSets islands(count);
    Checkpoints checkpoints;
    for (const Pass& pass : landscape.find_passes(share)) {
        checkpoints.pass();
        int low = islands.find(pass.a), high = islands.find(pass.b);
        if (low == high) continue;
        if (landscape.higher(summits[low], summits[high])) std::swap(low, high);
        islands.link(low, high);
        joins.push_back({low, high, pass.level});
    }

    // An island joined another one after all that had joined itself.
    Array<Seed> seeds(count);
    int found = 0;
    const auto found_peak = [&](int summit) {
        if (landscape[summits[summit]] < min_distance) return;
        seeds[summit] = {++found, bits_of(share[summit])};
    };
    for (int i = 0; i < count; ++i)
        if (islands.is_root(i)) found_peak(i);
    for (std::size_t k = joins.size(); k-- > 0;) {
        const auto [low, high, level] = joins[k];
        if (value_of(level) < share[low])
            found_peak(low);
        else if (level >= seeds[high].least)
            seeds[low] = seeds[high];
    }
    landscape.paint(seeds, found);
    return found;
}

}  // namespace rangeedge
