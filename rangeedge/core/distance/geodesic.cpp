// Distances around barriers: the shortest way from a pixel to an edge over pixels that are no barrier.
//
// Ways are polygons whose corners are middles of pixels. A side must not cross a barrier pixel, nor slip between two of
// them that touch at a corner; touching one at its corner is allowed.
//
// 1. The distance without barriers is found first. Where the nearest edge is in sight it is the answer, exactly.
// 2. From there on into the shadow pixels are settled in order of distance, as Dijkstra does it. A pixel hands to its
//    eight neighbours the corner at which its own way last bent: a neighbour in sight of that goes straight to it, any
//    other bends here (Theta*: Nash, Daniel, Koenig and Felner). So does one far away, since lines of sight take time.
//
// So no result is shorter than the shortest way, and none longer than the shortest of eight-neighbour steps, which is
// less than 8.24 % longer than any polygon where pixels are square.
//
// A. Nash, K. Daniel, S. Koenig and A. Felner, "Theta*: any-angle path planning on grids", AAAI 2007.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "distance/distance.hpp"

namespace rangeedge {
namespace {

struct Offset {
    int rows, cols;
};

class Terrain {
public:
    Terrain(const std::uint8_t* barrier, const Grid& grid, int threads)
        : grid_(grid), clearance_(grid.index(grid.rows, 0)) {
        const Grid unit{grid.rows, grid.cols, 1.0, 1.0, grid.wrap};
        distance_transform(barrier, unit, clearance_.data(), nullptr, threads);
    }

    const Grid& grid() const { return grid_; }
    bool is_free(int row, int col) const { return clearance_[grid_.index(row, column(col))] > 0.0f; }
    // `col`, which may lie up to one width outside an image that wraps around, as a column.
    int column(int col) const { return col < 0 ? col + grid_.cols : col < grid_.cols ? col : col - grid_.cols; }
    int row_of(std::int32_t p) const { return p / grid_.cols; }
    int col_of(std::int32_t p) const { return p % grid_.cols; }

    // The shorter way round.
    Offset offset(std::int32_t from, std::int32_t to) const {
        int cols = col_of(to) - col_of(from);
        if (grid_.wrap && std::abs(cols) > grid_.cols / 2) cols += cols > 0 ? -grid_.cols : grid_.cols;
        return {row_of(to) - row_of(from), cols};
    }
    double length(const Offset& way) const { return std::hypot(grid_.width * way.cols, grid_.height * way.rows); }

    // Whether a straight line between the middles of two pixels is free: where one is half the width away, either way
    // round.
    bool in_sight(std::int32_t from, std::int32_t to) const {
        const Offset way = offset(from, to);
        if (is_free(from, way)) return true;
        return grid_.wrap && 2 * std::abs(way.cols) == grid_.cols && is_free(from, {way.rows, -way.cols});
    }

private:
    bool is_free(std::int32_t from, const Offset& way) const {
        const bool steep = std::abs(way.rows) > std::abs(way.cols);
        const std::int64_t steps = steep ? std::abs(way.rows) : std::abs(way.cols);
        const std::int64_t aside = steep ? std::abs(way.cols) : std::abs(way.rows);
        const int down = way.rows < 0 ? -1 : 1, right = way.cols < 0 ? -1 : 1, y = row_of(from), x = col_of(from);
        const auto place = [&](std::int64_t along, std::int64_t across) {
            const auto rows = static_cast<int>(steep ? along : across), cols = static_cast<int>(steep ? across : along);
            return grid_.index(y + down * rows, column(x + right * cols));
        };
        // In step k the line runs from aside (2 k - 1) / (2 steps) to aside (2 k + 1) / (2 steps) across.
        for (std::int64_t k = 0; k <= steps; ++k) {
            const std::int64_t first = k == 0 ? 0 : (aside * (2 * k - 1) + steps) / (2 * steps);
            const std::int64_t last = k == steps ? aside : (aside * (2 * k + 1) + steps - 1) / (2 * steps);
            float clearance = clearance_[place(k, first)];
            if (last != first) clearance = std::min(clearance, clearance_[place(k, last)]);
            if (clearance == 0.0f) return false;
            if (k == steps) break;
            const bool through_corner = (aside * (2 * k + 1) + steps) % (2 * steps) == 0;
            if (through_corner && clearance_[place(k, last + 1)] == 0.0f && clearance_[place(k + 1, last)] == 0.0f)
                return false;
            // Within the clearance nothing is in the way; a step is at most sqrt(2) pixels long.
            const std::int64_t clear = static_cast<std::int64_t>(std::min(clearance, 0x1p24f) * 0.7f) - 2;
            k = std::min(k + std::max<std::int64_t>(clear, 0), steps - 1);
        }
        return true;
    }

    Grid grid_;
    LargeVector<float> clearance_;  // pixels to the nearest barrier
};

// The nearest source where it is in sight; of several as near also one that is nearest to a neighbour. Else -1.
std::int32_t nearest_in_sight(const Terrain& terrain, const LargeVector<std::int32_t>& nearest, int row, int col) {
    const Grid& grid = terrain.grid();
    const auto p = static_cast<std::int32_t>(grid.index(row, col));
    const std::int32_t source = nearest[static_cast<std::size_t>(p)];
    if (source < 0 || terrain.in_sight(p, source)) return source;
    const double length = terrain.length(terrain.offset(p, source));
    for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
            const int y = row + dy, x = grid.wrap ? terrain.column(col + dx) : col + dx;
            if (y < 0 || y >= grid.rows || x < 0 || x >= grid.cols) continue;
            const std::int32_t other = nearest[grid.index(y, x)];
            if (other == source || terrain.length(terrain.offset(p, other)) > length) continue;
            if (terrain.in_sight(p, other)) return other;
        }
    return -1;
}

class Shadows {
public:
    Shadows(const Terrain& terrain, const Grid& grid, LargeVector<std::int32_t>& labels)
        : terrain_(terrain), grid_(grid), labels_(labels), corner_(labels.size()), before_(labels.size()),
          length_(labels.size()) {}

    // To be called for every pixel before `settle`; -1 is the label of those that see no source.
    void start_at(std::int32_t p) {
        const std::int32_t source = labels_[at(p)];
        corner_[at(p)] = source;
        before_[at(p)] = 0;
        length_[at(p)] =
            source < 0 ? std::numeric_limits<double>::infinity() : terrain_.length(terrain_.offset(p, source));
    }

    void settle() {
        Checkpoints checkpoints(256);
        for (std::int32_t p = 0; p < static_cast<std::int32_t>(length_.size()); ++p) {
            checkpoints.pass();
            if (std::isfinite(length_[at(p)]) && borders_on_shadow(p)) queue_.emplace(length_[at(p)], p);
        }
        while (!queue_.empty()) {
            checkpoints.pass();
            const auto [length, p] = queue_.top();
            queue_.pop();
            if (length > length_[at(p)]) continue;
            for_each_neighbour(p, [&, p = p](std::int32_t q, const Offset& step) { offer(p, q, step); });
        }
    }

    double length(std::int32_t p) const { return length_[at(p)]; }

private:
    static constexpr int farthest =
        128;  // pixels to a corner: longer sides bend, and get longer by about a part in 10^5

    static std::size_t at(std::int32_t p) { return static_cast<std::size_t>(p); }

    template <class F>
    void for_each_neighbour(std::int32_t p, F&& f) const {
        const int row = terrain_.row_of(p), col = terrain_.col_of(p);
        for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) {
                if ((dy == 0 && dx == 0) || row + dy < 0 || row + dy >= grid_.rows) continue;
                if (!grid_.wrap && (col + dx < 0 || col + dx >= grid_.cols)) continue;
                if (!terrain_.is_free(row + dy, col + dx)) continue;
                if (dy && dx && !terrain_.is_free(row + dy, col) && !terrain_.is_free(row, col + dx)) continue;
                f(static_cast<std::int32_t>(grid_.index(row + dy, terrain_.column(col + dx))), Offset{dy, dx});
            }
    }

    bool borders_on_shadow(std::int32_t p) const {
        bool result = false;
        for_each_neighbour(p, [&](std::int32_t q, const Offset&) { result |= !std::isfinite(length_[at(q)]); });
        return result;
    }

    // The way by p to its neighbour q.
    void offer(std::int32_t p, std::int32_t q, const Offset& step) {
        std::int32_t corner = corner_[at(p)];
        const Offset side = terrain_.offset(corner, q);
        double before = before_[at(p)], length = before + terrain_.length(side);
        if (length >= length_[at(q)]) return;  // the way by p is no shorter
        if (std::max(std::abs(side.rows), std::abs(side.cols)) > farthest || !terrain_.in_sight(corner, q)) {
            corner = p;
            before = length_[at(p)];
            length = before + terrain_.length(step);
            if (length >= length_[at(q)]) return;
        }
        length_[at(q)] = length;
        corner_[at(q)] = corner;
        before_[at(q)] = before;
        labels_[at(q)] = labels_[at(p)];
        queue_.emplace(length, q);
    }

    const Terrain& terrain_;
    Grid grid_;
    LargeVector<std::int32_t>& labels_;
    LargeVector<std::int32_t> corner_;  // where a pixel's way first bends, or ends
    LargeVector<double> before_;        // length of the way from there
    LargeVector<double> length_;
    using Entry = std::pair<double, std::int32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> queue_;
};

}  // namespace

void geodesic_transform(const std::uint8_t* edges, const std::uint8_t* barrier, const Grid& grid, float* distance,
                        std::int32_t* labels, int threads) {
    const auto count = static_cast<std::int32_t>(grid.index(grid.rows, 0));
    const auto at = [](std::int32_t p) { return static_cast<std::size_t>(p); };
    LargeVector<std::uint8_t> walls(at(count)), sources(at(count));
    LargeVector<std::int32_t> nearest(at(count));
    Team team(std::min(threads, grid.rows));
    const auto for_pixels = [&](auto&& visit) {
        parallel_for(count, team, [&](int begin, int end, int) {
            for (std::int32_t p = begin; p < end; ++p) visit(p);
        });
    };
    for_pixels([&](std::int32_t p) {
        walls[at(p)] = barrier[p] != 0;
        sources[at(p)] = edges[p] && !barrier[p];
    });
    distance_transform(sources.data(), grid, distance, nearest.data(), threads);

    const Terrain terrain(walls.data(), grid, threads);
    LargeVector<std::int32_t> seen(at(count));
    parallel_each(grid.rows, team, [&](int row, int) {
        for (int col = 0; col < grid.cols; ++col) {
            const std::size_t p = grid.index(row, col);
            seen[p] = walls[p] ? -1 : nearest_in_sight(terrain, nearest, row, col);
        }
    });
    for_pixels([&](std::int32_t p) { nearest[at(p)] = seen[at(p)]; });
    Shadows shadows(terrain, grid, nearest);
    for_pixels([&](std::int32_t p) { shadows.start_at(p); });
    shadows.settle();
    for_pixels([&](std::int32_t p) {
        if (seen[at(p)] < 0) distance[p] = static_cast<float>(shadows.length(p));
        if (labels) labels[p] = nearest[at(p)];
    });
}

}  // namespace rangeedge
