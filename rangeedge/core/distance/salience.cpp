// The multiplicative salience distance: D(p) = min over the sources q of |p - q| / s(q), exact.
//
// No axis can be treated before the other here, as what a source contributes depends on how far away it is. So this is
// branch and bound, over a quadtree of tiles (of pixels) and one of blocks (of sources), with w = 1 / s^2:
//
// 1. For a tile and a block, w_min (least distance)^2 is a lower bound of D^2, and w (largest distance)^2 of the block's
//    strongest source an upper one: a block whose lower bound exceeds the least upper bound has no say in the tile.
// 2. Tiles are split into four, and the blocks left into theirs, down to tiles of 8 x 8 pixels.
// 3. Where salience rises steadily over a wide area, a source that is farther away makes up for it by being stronger,
//    and the bounds of step 1 exclude little. Then blocks are compared with the source of the least upper bound, the
//    pivot: both distances are replaced by planes over the tile, the saliences of a block by the plane above them,
//    and of the difference only what the planes leave is lost.
// 4. In a tile of pixels a source goes that exceeds the pivot everywhere on the tile, and those left, about a dozen, are
//    compared pixel by pixel.
//
// All this is done in float. `slack` allows for its rounding in the bounds; where the two best sources of a pixel come
// too close to tell, the choice is made in double, and exactly where pixels are square.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <numeric>
#include <vector>

#include "base/parallel.hpp"
#include "base/simd.hpp"
#include "distance/distance.hpp"
#include "distance/source_tree.hpp"

namespace rangeedge {
namespace {

constexpr int tile_pixels = tile_size * tile_size;
constexpr float slack = 1.0f / (1 << 19);

std::size_t at(int index) { return static_cast<std::size_t>(index); }

struct Tile {
    int y, x;                        // its first pixel
    float left, right, top, bottom;  // its first and last columns and rows inside the image
};

// Groups of slots copied into flat arrays.
struct Candidates {
    std::vector<int> groups;
    std::vector<float> weight, x, y, left, right, top, bottom, peak, slope_x, slope_y;

    int count() const { return static_cast<int>(groups.size()) * group_size; }
    int slot(int i) const { return groups[at(i / group_size)] * group_size + i % group_size; }

    void gather(const Points& from) {
        gather(from.weight, weight);
        gather(from.x, x);
        gather(from.y, y);
    }

    void gather(const Blocks& from) {
        gather(static_cast<const Points&>(from));
        gather(from.left, left);
        gather(from.right, right);
        gather(from.top, top);
        gather(from.bottom, bottom);
        gather(from.peak, peak);
        gather(from.slope_x, slope_x);
        gather(from.slope_y, slope_y);
    }

private:
    void gather(const std::vector<float>& from, std::vector<float>& to) const {
        to.resize(at(count()));
        for (std::size_t i = 0; i < groups.size(); ++i)
            std::memcpy(&to[i * group_size], &from[at(groups[i]) * group_size], group_size * sizeof(float));
    }
};

std::int32_t bits(float value) {
    std::int32_t result;
    std::memcpy(&result, &value, sizeof result);
    return result;
}

float value_of(std::int32_t bits) {
    float result;
    std::memcpy(&result, &bits, sizeof result);
    return result;
}

// The number of a candidate takes the place of the last bits of a float: so a minimum finds its argument as well.
class Tag {
public:
    explicit Tag(int count) {
        while (~mask_ + 1 < count) mask_ *= 2;
    }

    float set(float value, int number) const { return value_of((bits(value) & mask_) | number); }
    int number(float tagged) const { return bits(tagged) & ~mask_; }

private:
    std::int32_t mask_ = -1;
};

// Lower bounds of the blocks on a tile; returns the least upper bound. Floats that are not negative are ordered as
// their bits, and minima of integers may be taken in any order, so that the loop runs on several lanes; likewise below.
RANGEEDGE_WIDE float bound(const Candidates& from, const Tile& tile, float aspect, float* lower) {
    const float *weight = from.weight.data(), *x = from.x.data(), *y = from.y.data();
    const float *left = from.left.data(), *right = from.right.data();
    const float *top = from.top.data(), *bottom = from.bottom.data();
    std::int32_t least = std::numeric_limits<std::int32_t>::max();
    const int count = from.count();
    for (int k = 0; k < count; ++k) {
        const float near_x = std::max(std::max(left[k] - tile.right, tile.left - right[k]), 0.0f);
        const float near_y = std::max(std::max(top[k] - tile.bottom, tile.top - bottom[k]), 0.0f);
        const float far_x = std::max(x[k] - tile.left, tile.right - x[k]);
        const float far_y = std::max(y[k] - tile.top, tile.bottom - y[k]);
        lower[k] = weight[k] * (near_x * near_x + aspect * (near_y * near_y));
        least = std::min(least, bits(weight[k] * (far_x * far_x + aspect * (far_y * far_y))));
    }
    return value_of(least);
}

// Upper bounds of the sources, or the strongest ones of blocks, on a tile; returns the number of about the least one.
RANGEEDGE_WIDE int find_pivot(const Candidates& from, const Tile& tile, float aspect, float* upper) {
    const Tag tag(from.count());
    const float *weight = from.weight.data(), *x = from.x.data(), *y = from.y.data();
    std::int32_t least = std::numeric_limits<std::int32_t>::max();
    const int count = from.count();
    for (int k = 0; k < count; ++k) {
        const float far_x = std::max(x[k] - tile.left, tile.right - x[k]);
        const float far_y = std::max(y[k] - tile.top, tile.bottom - y[k]);
        upper[k] = weight[k] * (far_x * far_x + aspect * (far_y * far_y));
        least = std::min(least, bits(tag.set(upper[k], k)));
    }
    return tag.number(value_of(least));
}

// The least of w (t - x)^2 - pivot_w (t - pivot_x)^2 over t in [0, length].
inline float least_excess(float w, float x, float pivot_w, float pivot_x, float length) {
    const auto excess = [=](float t) { return w * ((t - x) * (t - x)) - pivot_w * ((t - pivot_x) * (t - pivot_x)); };
    const float vertex = (w * x - pivot_w * pivot_x) / (w - pivot_w);
    const float inside = std::min(std::max(0.0f, vertex), length);  // 0 where w = pivot_w and there is no vertex
    return std::min(std::min(excess(0.0f), excess(length)), excess(inside));
}

// By how much each source exceeds the pivot everywhere on the tile, less what rounding may amount to: one above 0 has
// no say there. Coordinates from the tile's corner keep the error of the vertex small.
RANGEEDGE_WIDE void exceed(const Candidates& from, int pivot, const Tile& tile, float aspect, const float* upper,
                           float* excess) {
    const float *weight = from.weight.data(), *x = from.x.data(), *y = from.y.data();
    const float left = tile.left, top = tile.top, width = tile.right - left, height = tile.bottom - top;
    const float pivot_w = weight[pivot], pivot_x = x[pivot] - left, pivot_y = y[pivot] - top;
    const float pivot_upper = upper[pivot];
    const int count = from.count();
    for (int k = 0; k < count; ++k)
        excess[k] = least_excess(weight[k], x[k] - left, pivot_w, pivot_x, width) +
                    least_excess(aspect * weight[k], y[k] - top, aspect * pivot_w, pivot_y, height) -
                    (upper[k] + pivot_upper) * slack;
}

// An upper bound of the pivot's distance over a tile, as a plane: at its middle and how it rises from there, per pixel
// width either way.
struct PivotPlane {
    float middle, rise_x, rise_y;
};

// `unit_y` is the height of a pixel in pixel widths.
PivotPlane plane_of_pivot(float weight, float x, float y, const Tile& tile, float unit_y) {
    const float s = 1.0f / std::sqrt(weight);
    const float dx = 0.5f * (tile.left + tile.right) - x, dy = unit_y * (0.5f * (tile.top + tile.bottom) - y);
    const float half_x = 0.5f * (tile.right - tile.left), half_y = unit_y * 0.5f * (tile.bottom - tile.top);
    const float radius = std::sqrt(half_x * half_x + half_y * half_y), distance = std::sqrt(dx * dx + dy * dy);
    if (distance < 2.0f * radius + 1.0f) return {(distance + radius) / s, 0.0f, 0.0f};
    // What a circle rises above its tangent within `radius`.
    const float bend = radius * radius / (2.0f * (distance - radius));
    return {(distance + bend) / s, dx / (distance * s), dy / (distance * s)};
}

// A lower bound of |p - q| - s(q) D(p) over the sources q of a block and the pixels p of a tile, where D is the pivot's
// distance: above 0 the block has no say there. With t = p - middle of the tile, r = q - middle of the block and u the
// direction from the latter to the former,
//     |p - q| >= |middle - middle| + u (t - r),   s(q) <= peak + slope r,   D(p) <= D_0 + rise t.
RANGEEDGE_WIDE void exceed_as_planes(const Candidates& from, const PivotPlane& pivot, const Tile& tile, float unit_y,
                                     float* excess) {
    const float *left = from.left.data(), *right = from.right.data();
    const float *top = from.top.data(), *bottom = from.bottom.data();
    const float *peak = from.peak.data(), *slope_x = from.slope_x.data(), *slope_y = from.slope_y.data();
    const float middle_x = 0.5f * (tile.left + tile.right), middle_y = 0.5f * (tile.top + tile.bottom);
    const float tile_x = 0.5f * (tile.right - tile.left), tile_y = unit_y * 0.5f * (tile.bottom - tile.top);
    const float pivot_reach = std::abs(pivot.rise_x) * tile_x + std::abs(pivot.rise_y) * tile_y;
    const float pivot_0 = pivot.middle, rise_x = pivot.rise_x, rise_y = pivot.rise_y, per_unit = 1.0f / unit_y;
    const int count = from.count();
    for (int k = 0; k < count; ++k) {
        const float half_x = 0.5f * (right[k] - left[k]), half_y = unit_y * 0.5f * (bottom[k] - top[k]);
        const float dx = middle_x - 0.5f * (left[k] + right[k]), dy = unit_y * (middle_y - 0.5f * (top[k] + bottom[k]));
        const float distance = std::sqrt(dx * dx + dy * dy), inverse = 1.0f / std::max(distance, 1e-3f);
        const float ux = dx * inverse, uy = dy * inverse, gx = slope_x[k], gy = slope_y[k] * per_unit, s = peak[k];
        const float by_tile = std::abs(ux - s * rise_x) * tile_x + std::abs(uy - s * rise_y) * tile_y;
        const float by_block = std::abs(ux + pivot_0 * gx) * half_x + std::abs(uy + pivot_0 * gy) * half_y;
        const float slope_reach = std::abs(gx) * half_x + std::abs(gy) * half_y;
        const float rounding = (distance + pivot_0 * (s + slope_reach)) * (8.0f * slack);
        excess[k] = distance - pivot_0 * s - by_tile - by_block - pivot_reach * slope_reach - rounding;
    }
}

// For every pixel of a tile the least w d^2, the number of its source, and the second least.
RANGEEDGE_WIDE void compare(int count, const float* weight, const float* x, const float* y, const Tile& tile,
                            float aspect, float* least, std::int32_t* number, float* second) {
    float column[tile_pixels], row[tile_pixels];
    for (int p = 0; p < tile_pixels; ++p) {
        column[p] = tile.left + static_cast<float>(p % tile_size);
        row[p] = tile.top + static_cast<float>(p / tile_size);
    }
    std::fill_n(least, tile_pixels, std::numeric_limits<float>::max());
    std::fill_n(second, tile_pixels, std::numeric_limits<float>::max());
    std::fill_n(number, tile_pixels, 0);
    for (int i = 0; i < count; ++i) {
        const float w = weight[i], xi = x[i], yi = y[i];
        for (int p = 0; p < tile_pixels; ++p) {
            const float dx = column[p] - xi, dy = row[p] - yi;
            const float value = w * (dx * dx + aspect * (dy * dy));
            second[p] = std::min(second[p], std::max(least[p], value));
            number[p] = value < least[p] ? i : number[p];
            least[p] = std::min(least[p], value);
        }
    }
}

// The sign of d2a / a^2 - d2b / b^2 without rounding, for integers d2a, d2b below 2^53 and a, b of 24 bits: squares of
// such are exact, and fma gives what rounding takes from a product.
int compare_exactly(double d2a, double a, double d2b, double b) {
    const double left = d2a * (b * b), right = d2b * (a * a);
    if (left != right) return left < right ? -1 : 1;
    const double left_rest = std::fma(d2a, b * b, -left), right_rest = std::fma(d2b, a * a, -right);
    return (left_rest > right_rest) - (left_rest < right_rest);
}

template <class T>
class Search {
public:
    Search(const SourceTree<T>& tree, const Grid& grid, float* distance, std::int32_t* labels)
        : tree_(tree), grid_(grid), aspect_(static_cast<float>(grid.aspect())),
          unit_y_(static_cast<float>(grid.height / grid.width)), distance_(distance), labels_(labels),
          blocks_(tree.levels.size()) {
        Candidates& all = blocks_.back();
        all.groups.resize(at(tree.levels.back().groups()));
        std::iota(all.groups.begin(), all.groups.end(), 0);
        all.gather(tree.levels.back());
    }

    // Fills the tile of tile_size << level pixels at (y, x), for which blocks_[level] are the candidates.
    void fill(int level, int y, int x) {
        const int size = tile_size << level;
        const Tile tile{y,
                        x,
                        static_cast<float>(x),
                        static_cast<float>(std::min(x + size, grid_.cols) - 1),
                        static_cast<float>(y),
                        static_cast<float>(std::min(y + size, grid_.rows) - 1)};
        Candidates& parts = level > 0 ? blocks_[at(level - 1)] : sources_;
        expand(level, tile, parts.groups);
        if (level == 0) {
            sources_.gather(tree_.sources);
            fill_pixels(tile);
            return;
        }
        parts.gather(tree_.levels[at(level - 1)]);
        const int half = size / 2;
        for (int k = 0; k < group_size; ++k) {
            const int part_y = y + k / 2 * half, part_x = x + k % 2 * half;
            if (part_y < grid_.rows && part_x < grid_.cols) fill(level - 1, part_y, part_x);
        }
    }

private:
    // The parts of those blocks that have a say in the tile.
    void expand(int level, const Tile& tile, std::vector<int>& groups) {
        constexpr std::size_t many = 64;
        const Candidates& from = blocks_[at(level)];
        const Blocks& blocks = tree_.levels[at(level)];
        lower_.resize(at(from.count()));
        const float limit = bound(from, tile, aspect_, lower_.data()) * (1.0f + slack);
        keep_up_to(limit);
        if (kept_.size() > many) {
            upper_.resize(lower_.size());
            const auto pivot = at(find_pivot(from, tile, aspect_, upper_.data()));
            exceed_as_planes(from, plane_of_pivot(from.weight[pivot], from.x[pivot], from.y[pivot], tile, unit_y_),
                             tile, unit_y_, upper_.data());
            kept_.erase(std::remove_if(kept_.begin(), kept_.end(), [&](int i) { return upper_[at(i)] > 0.0f; }),
                        kept_.end());
        }
        groups.clear();
        for (const int i : kept_) {
            const std::size_t slot = at(from.slot(i));
            for (int group = blocks.begin[slot]; group < blocks.end[slot]; ++group) groups.push_back(group);
        }
    }

    void fill_pixels(const Tile& tile) {
        keep_contenders(tile);
        const int count = static_cast<int>(contenders_.size());
        float least[tile_pixels], second[tile_pixels];
        std::int32_t numbers[tile_pixels];
        compare(count, weight_.data(), x_.data(), y_.data(), tile, aspect_, least, numbers, second);
        double squared[tile_pixels], salience[tile_pixels];
        std::int32_t label[tile_pixels];
        for (int p = 0; p < tile_pixels; ++p) {
            int number = numbers[p];
            const float close = least[p] * (1.0f + slack);
            const double row = tile.y + p / tile_size, col = tile.x + p % tile_size;
            if (second[p] <= close) number = nearest_exactly(row, col, close);
            squared[p] = squared_distance(number, row, col);
            salience[p] = contenders_[at(number)].salience;
            label[p] = contenders_[at(number)].label;
        }
        float distance[tile_pixels];
        for (int p = 0; p < tile_pixels; ++p)
            distance[p] = static_cast<float>(grid_.width * (std::sqrt(squared[p]) / salience[p]));
        const int cols = std::min(tile_size, grid_.cols - tile.x);
        for (int r = 0; r < std::min(tile_size, grid_.rows - tile.y); ++r) {
            std::copy_n(distance + r * tile_size, cols, distance_ + grid_.index(tile.y + r, tile.x));
            if (labels_) std::copy_n(label + r * tile_size, cols, labels_ + grid_.index(tile.y + r, tile.x));
        }
    }

    // Moves those sources that the pivot does not beat all over the tile into weight_, x_, y_, contenders_.
    void keep_contenders(const Tile& tile) {
        const int count = sources_.count();
        upper_.resize(at(count));
        lower_.resize(at(count));
        exceed(sources_, find_pivot(sources_, tile, aspect_, upper_.data()), tile, aspect_, upper_.data(),
               lower_.data());
        keep_up_to(0.0f);
        contenders_.resize(kept_.size());
        weight_.resize(kept_.size());
        x_.resize(kept_.size());
        y_.resize(kept_.size());
        for (std::size_t k = 0; k < kept_.size(); ++k) {
            const std::size_t i = at(kept_[k]), slot = at(sources_.slot(kept_[k]));
            weight_[k] = sources_.weight[i];
            x_[k] = sources_.x[i];
            y_[k] = sources_.y[i];
            contenders_[k] = tree_.sources.exact[slot];
        }
    }

    // Into kept_ the numbers of the candidates with lower_ at most `limit`; no branch, as none could be predicted.
    void keep_up_to(float limit) {
        kept_.resize(lower_.size());
        std::size_t count = 0;
        for (std::size_t i = 0; i < lower_.size(); ++i) {
            kept_[count] = static_cast<int>(i);
            count += lower_[i] <= limit;
        }
        kept_.resize(count);
    }

    double squared_distance(int number, double row, double col) const {
        const double dy = row - double(y_[at(number)]), dx = col - double(x_[at(number)]);
        return grid_.aspect() * (dy * dy) + dx * dx;
    }

    // The nearest of the contenders whose w d^2 is at most about `close`, of the lowest label among equals.
    int nearest_exactly(double row, double col, float close) const {
        const double limit = double(close) * (1.0 + double(slack));
        int best = -1;
        double best_squared = 0.0;
        for (int i = 0; i < static_cast<int>(contenders_.size()); ++i) {
            const double squared = squared_distance(i, row, col);
            if (double(weight_[at(i)]) * squared > limit) continue;
            const auto nearer = [&](const Source& source, const Source& than) {
                const int sign = compare_exactly(squared, source.level, best_squared, than.level);
                return sign < 0 || (sign == 0 && source.label < than.label);
            };
            if (best >= 0 && !nearer(contenders_[at(i)], contenders_[at(best)])) continue;
            best = i;
            best_squared = squared;
        }
        return best;
    }

    const SourceTree<T>& tree_;
    Grid grid_;
    float aspect_, unit_y_;
    float* distance_;
    std::int32_t* labels_;
    std::vector<Candidates> blocks_;  // by level
    Candidates sources_;
    std::vector<float> lower_, upper_;
    std::vector<float> weight_, x_, y_;  // of the contenders for a tile
    std::vector<Source> contenders_;
    std::vector<int> kept_;
};

}  // namespace

template <class T>
void salience_multiplicative(const T* salience, const Grid& grid, float* distance, std::int32_t* labels, int threads) {
    constexpr int most_top_tiles = 256;
    const auto tiles = [](int length, int level) { return (length - 1) / (tile_size << level) + 1; };
    int top = 0;
    while (static_cast<long long>(tiles(grid.rows, top)) * tiles(grid.cols, top) > most_top_tiles) ++top;
    const int size = tile_size << top, across = tiles(grid.cols, top), count = across * tiles(grid.rows, top);
    Team team(std::min(threads, count));
    const SourceTree<T> tree(salience, grid, top, team);
    if (tree.sources.exact.empty()) {
        std::fill_n(distance, grid.index(grid.rows, 0), std::numeric_limits<float>::infinity());
        if (labels) std::fill_n(labels, grid.index(grid.rows, 0), -1);
        return;
    }
    std::vector<Search<T>> searches(static_cast<std::size_t>(team.size()), Search<T>(tree, grid, distance, labels));
    parallel_each(count, team, [&](int tile, int thread) {
        searches[at(thread)].fill(top, tile / across * size, tile % across * size);
    });
}

template void salience_multiplicative(const std::uint8_t*, const Grid&, float*, std::int32_t*, int);
template void salience_multiplicative(const float*, const Grid&, float*, std::int32_t*, int);

}  // namespace rangeedge
