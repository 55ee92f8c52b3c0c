// The multiplicative salience distance: D(p) = min over the sources q of |p - q| / s(q), exact.
//
// No axis can be treated before the other here, as what a source contributes depends on how far away it is. So this is
// branch and bound, over a quadtree of tiles (of pixels) and one of blocks (of sources), with w = 1 / s^2:
//
// 1. For a tile and a block, w_min (least distance)^2 is a lower bound of D^2, and w (largest distance)^2 of the
//    block's strongest source an upper one: a block whose lower bound exceeds the least upper bound has no say in the
//    tile.
// 2. Tiles are split into four, and the blocks left into theirs, down to tiles of 8 x 8 pixels.
// 3. Where salience rises steadily over a wide area, a source that is farther away makes up for it by being stronger,
//    and the bounds of step 1 exclude little. Then blocks are compared with the source of the least upper bound, the
//    pivot: both distances are replaced by planes over the tile, the saliences of a block by the plane above them,
//    and of the difference only what the planes leave is lost.
// 4. In a tile of pixels a source goes that exceeds the pivot everywhere on the tile, and those left, about a dozen,
//    are compared pixel by pixel.
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
#include "distance/distance.hpp"
#include "distance/salience_bounds.hpp"
#include "distance/source_tree.hpp"

namespace rangeedge {
namespace {

std::size_t at(int index) { return static_cast<std::size_t>(index); }

// The sign of d2a / a^2 - d2b / b^2 without rounding, for integers d2a, d2b below 2^53 and a, b of 24 bits: squares of
// such are exact, and fma gives what rounding takes from a product.
int compare_exactly(double d2a, double a, double d2b, double b) {
    if (a == b) return (d2a > d2b) - (d2a < d2b);
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
        Watch::checkpoint();
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
        constexpr std::size_t many = 16;
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
            const int slot = from.slot(i);
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
            salience[p] = contenders_[at(number)].level / salience_unit<T>;
            label[p] = contenders_[at(number)].label;
        }
        float distance[tile_pixels];
        weigh(squared, salience, grid_.width, distance);
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
        const std::size_t filled = (kept_.size() + lanes - 1) / lanes * lanes;
        contenders_.resize(kept_.size());
        weight_.assign(filled, huge_weight);
        x_.assign(filled, far_away);
        y_.assign(filled, far_away);
        marks_.resize(filled);
        for (std::size_t k = 0; k < kept_.size(); ++k) {
            const std::size_t i = at(kept_[k]);
            weight_[k] = sources_.weight[i];
            x_[k] = sources_.x[i];
            y_[k] = sources_.y[i];
            contenders_[k] = tree_.sources.exact[sources_.slot(kept_[k])];
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
    int nearest_exactly(double row, double col, float close) {
        const float limit = close * (1.0f + slack);
        mark_near(static_cast<int>(weight_.size()), weight_.data(), x_.data(), y_.data(), static_cast<float>(row),
                  static_cast<float>(col), aspect_, limit, marks_.data());
        int best = -1;
        double best_squared = 0.0;
        for (int i = 0; i < static_cast<int>(contenders_.size()); ++i) {
            if (!marks_[at(i)]) continue;
            const double squared = squared_distance(i, row, col);
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
    std::vector<float> weight_, x_, y_;  // of the contenders for a tile, and some that are far away
    std::vector<std::uint8_t> marks_;
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
