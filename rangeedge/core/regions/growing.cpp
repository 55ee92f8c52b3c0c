// Patches grow over tiles first: a tile of 8 x 8 pixels without an edge joins the neighbouring patch it fits best, by its
// power sums alone, tiles with the smallest misfit first. What is left are strips along edges and borders, which grow
// pixel by pixel in rounds: all pixels that touch a patch choose among the patches they touch, then all choices become
// true at once. So every round can be shared among threads, and its outcome does not depend on how.
// SPDX-License-Identifier: Apache-2.0
#include "growing.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace rangeedge {
namespace {

constexpr int levels = 32;               // of misfits in the queue of tiles
constexpr double tile_tolerance = 0.8;   // root mean square misfit of a tile, in tolerances of a pixel
constexpr int settled = 2000000;            // pixels that tell a surface; strips along edges add nothing
constexpr int rounds_between_tiles = 8;  // of pixels
constexpr int most_adjustments = 8;      // rounds at borders
constexpr int worth_threads = 2048;      // pixels

// Tiles by misfit, the smallest first, first come first served among equals.
class Queue {
public:
    struct Entry {
        int tile, patch;
    };

    void push(int level, Entry entry) {
        bucket_[static_cast<std::size_t>(level)].push_back(entry);
        lowest_ = std::min(lowest_, static_cast<std::size_t>(level));
    }
    bool pop(Entry& entry) {
        for (; lowest_ < levels; ++lowest_) {
            auto& bucket = bucket_[lowest_];
            std::size_t& head = head_[lowest_];
            if (head < bucket.size()) {
                entry = bucket[head++];
                return true;
            }
            bucket.clear();
            head = 0;
        }
        return false;
    }

private:
    std::array<std::vector<Entry>, levels> bucket_;
    std::array<std::size_t, levels> head_{};
    std::size_t lowest_ = levels;
};

// What the best of the neighbouring patches makes of a pixel.
struct Choice {
    int patch = 0;
    double residual = 0;
};

class Grower {
public:
    Grower(PatchMap& patches, PatchMap::Free reach, double tolerance)
        : patches_(patches), image_(patches.image()), reach_(reach), limit_(tolerance * tolerance),
          waiting_(static_cast<std::size_t>(image_.size()), 0) {}

    void start() {
        patches_.for_free(reach_, [&](int p) {
            for (const int step : image_.neighbours())
                if (patches_[p + step]) return wait(p);
        });
    }
    bool over_tiles(const Tiles& tiles);
    bool over_pixels(int rounds, bool refit);

private:
    void wait(int p) {
        if (waiting_[p]) return;
        waiting_[p] = 1;
        front_.push_back(p);
    }
    void wait_around(int p) {
        for (const int step : image_.neighbours())
            if (patches_.is_free(p + step, reach_)) wait(p + step);
    }
    Choice choose(int p) const {
        Choice best{0, limit_};
        int last = 0;
        for (const int step : image_.neighbours()) {
            const int i = patches_[p + step];
            if (!i || i == last) continue;
            last = i;
            const double r = image_.residual(p, patches_.patch(i).surface);
            if (r < best.residual) best = {i, r};
        }
        return best;
    }
    void refit_when_due(Patch& patch) {
        if (patch.count() < patch.refit_at) return;
        patch.surface = image_.surface_of(patch.sums);
        patch.refit_at = PatchMap::refit_after(patch.count());
    }
    bool is_free(const Tiles& tiles, int t) const {
        if (!tiles.is_open(t)) return false;
        for (int row = 0, p = tiles.first_pixel(t); row < tiles.side; ++row, p += image_.stride())
            if (!patches_.are_open(p, tiles.side)) return false;
        return true;
    }
    void offer(const Tiles& tiles, int t, int i) {
        if (!is_free(tiles, t)) return;
        const double limit = tile_tolerance * tile_tolerance * limit_;
        const double r = image_.residual(tiles.sums(t), patches_.patch(i).surface);
        if (r < limit) queue_.push(static_cast<int>(r / limit * levels), {t, i});
    }
    void take_tile(const Tiles& tiles, int t, int i);

    PatchMap& patches_;
    const SurfaceImage& image_;
    PatchMap::Free reach_;
    double limit_;
    Queue queue_;
    Array<std::uint8_t> waiting_;  // whether a pixel is in front_
    std::vector<int> front_, taken_;
    std::vector<Choice> choices_;
};

void Grower::take_tile(const Tiles& tiles, int t, int i) {
    Patch& patch = patches_.patch(i);
    patch.sums.add(tiles.sums(t));
    refit_when_due(patch);
    const int stride = image_.stride(), side = tiles.side, first = tiles.first_pixel(t);
    for (int row = 0; row < side; ++row)
        for (int p = first + row * stride; p < first + row * stride + side; ++p) patches_.take(p, i);
    taken_.push_back(t);
}

// Offers every free tile to the patches that touch it; returns whether any was taken.
bool Grower::over_tiles(const Tiles& tiles) {
    const int stride = image_.stride(), side = tiles.side;
    const auto for_around = [&](int t, auto&& visit) {  // the pixels around a tile
        const int p = tiles.first_pixel(t);
        for (int k = 0; k < side; ++k) {
            visit(p - stride + k), visit(p + side * stride + k);
            visit(p - 1 + k * stride), visit(p + side + k * stride);
        }
    };
    taken_.clear();
    for (int t = 0; t < tiles.rows() * tiles.cols(); ++t) {
        if (!is_free(tiles, t)) continue;
        std::array<int, 4> offered{};  // lately
        std::size_t next = 0;
        for_around(t, [&](int q) {
            const int i = patches_[q];
            if (!i || std::find(offered.begin(), offered.end(), i) != offered.end()) return;
            offered[next++ % offered.size()] = i;
            offer(tiles, t, i);
        });
    }
    Queue::Entry entry{};
    while (queue_.pop(entry)) {
        const auto [t, i] = entry;
        if (!is_free(tiles, t)) continue;
        if (image_.residual(tiles.sums(t), patches_.patch(i).surface) >= tile_tolerance * tile_tolerance * limit_)
            continue;
        take_tile(tiles, t, i);
        const int row = t / tiles.cols(), col = t % tiles.cols();
        if (row > 0) offer(tiles, t - tiles.cols(), i);
        if (row + 1 < tiles.rows()) offer(tiles, t + tiles.cols(), i);
        if (col > 0) offer(tiles, t - 1, i);
        if (col + 1 < tiles.cols()) offer(tiles, t + 1, i);
    }
    for (const int t : taken_)
        for_around(t, [&](int q) {
            if (patches_.is_free(q, reach_)) wait(q);
        });
    return !taken_.empty();
}

// Returns whether any pixel was taken.
bool Grower::over_pixels(int rounds, bool refit) {
    bool any = false;
    for (int round = 0; round < rounds && !front_.empty(); ++round) {
        std::vector<int> front;
        front.swap(front_);
        const int size = static_cast<int>(front.size());
        choices_.resize(front.size());
        const auto choose_all = [&](int begin, int end, int) {
            for (int k = begin; k < end; ++k) {
                const auto at = static_cast<std::size_t>(k);
                choices_[at] = patches_.is_free(front[at], reach_) ? choose(front[at]) : Choice{};
            }
        };
        if (size >= worth_threads)
            parallel_for(size, patches_.team(), choose_all);
        else
            choose_all(0, size, 0);
        for (std::size_t k = 0; k < front.size(); ++k) {
            const int p = front[k], i = choices_[k].patch;
            waiting_[p] = 0;
            if (!i) continue;
            any = true;
            patches_.take(p, i);
            if (!refit) continue;
            Patch& patch = patches_.patch(i);
            if (patch.count() >= settled) continue;
            patch.sums.add(image_.sample(p));
            refit_when_due(patch);
        }
        for (std::size_t k = 0; k < front.size(); ++k)
            if (choices_[k].patch) wait_around(front[k]);
    }
    return any;
}

}  // namespace

Tiles::Tiles(const SurfaceImage& image, int size, Team& team)
    : side(size), rows_(image.rows() / side), cols_(image.cols() / side), sums_(static_cast<std::size_t>(rows_ * cols_)),
      first_(sums_.size()) {
    parallel_for(rows_, team, [&](int begin, int end, int) {
        for (int t = begin * cols_; t < end * cols_; ++t) {
            const int first = first_[t] = image.index(t / cols_ * side, t % cols_ * side);
            const auto for_all = [&](auto&& visit) {
                for (int row = 0; row < side; ++row)
                    for (int p = first + row * image.stride(), stop = p + side; p < stop; ++p) visit(p);
            };
            bool open = true;
            for_all([&](int p) { open = open && image.open(p); });
            if (!open) continue;
            const Sample middle = image.sample(first + (side / 2) * image.stride() + side / 2);
            SurfaceSums sums(middle.x, middle.y, middle.ordinate);
            for_all([&](int p) { sums.add(image.sample(p)); });
            sums_[t] = sums;
        }
    });
}

void grow(PatchMap& patches, const TilePyramid& tiles, double tolerance) {
    Grower grower(patches, PatchMap::open_pixel, tolerance);
    grower.start();
    for (bool grown = true; grown;) {
        grown = false;
        for (const Tiles* const level : {&tiles.large, &tiles.small}) grown |= grower.over_tiles(*level);
        grown |= grower.over_pixels(rounds_between_tiles, true);
    }
    patches.refit();
}

void fill(PatchMap& patches, PatchMap::Free reach, double tolerance) {
    Grower grower(patches, reach, tolerance);
    grower.start();
    grower.over_pixels(patches.image().size(), false);
}

void adjust_borders(PatchMap& patches) {
    const SurfaceImage& image = patches.image();
    const auto neighbours = image.neighbours();
    std::vector<int> moving;  // pixels that may
    const auto sorted = [&] {
        std::sort(moving.begin(), moving.end());
        moving.erase(std::unique(moving.begin(), moving.end()), moving.end());
    };
    patches.for_borders(0, image.rows(), [&](int p) {
        for (const int q : {p + 1, p + image.stride()})
            if (patches[p] && patches[q] && patches[p] != patches[q]) moving.push_back(p), moving.push_back(q);
    });
    sorted();
    std::vector<int> best;
    for (int round = 0; round < most_adjustments && !moving.empty(); ++round) {
        best.resize(moving.size());
        parallel_for(static_cast<int>(moving.size()), patches.team(), [&](int begin, int end, int) {
            for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
                const int p = moving[k], own = patches[p];
                best[k] = own;
                if (!own) continue;
                double least = -1;
                for (const int step : neighbours) {
                    const int other = patches[p + step];
                    if (!other || other == best[k] || other == own) continue;
                    if (least < 0) least = image.residual(p, patches.patch(own).surface);
                    const double r = image.residual(p, patches.patch(other).surface);
                    if (r < least) least = r, best[k] = other;
                }
            }
        });
        std::vector<int> moved;
        for (std::size_t k = 0; k < best.size(); ++k)
            if (best[k] != patches[moving[k]]) {
                patches.take(moving[k], best[k]);
                moved.push_back(moving[k]);
            }
        moving.clear();
        for (const int p : moved) {
            moving.push_back(p);
            for (const int step : neighbours) moving.push_back(p + step);
        }
        sorted();
    }
}

}  // namespace rangeedge
