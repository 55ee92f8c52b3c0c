// Patches grow over tiles first: a tile of 8 x 8 pixels without an edge joins the neighbouring patch it fits best, by
// its power sums alone, tiles with the smallest misfit first; then tiles of 4 x 4. What is left are strips along edges
// and borders, which grow pixel by pixel in rounds: all pixels that touch a patch choose among the patches they touch,
// then all choices become true at once. So every round can be shared among threads, and its outcome does not depend on
// how.
// SPDX-License-Identifier: Apache-2.0
#include "regions/growing.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace rangeedge {
namespace {

constexpr double tile_tolerance = 0.8;       // root mean square misfit of a tile, in tolerances of a pixel
constexpr int rounds_between_tiles = 8;      // of pixels
constexpr int worth_tiles = 500;             // pixels that grew meanwhile
constexpr int most_adjustments = 8;          // rounds at borders
constexpr std::size_t prefetched = 12;       // pixels ahead
constexpr std::size_t worth_threads = 2048;  // pixels

}  // namespace

Grower::Grower(PatchMap& patches) : patches_(patches), image_(patches.image()), waiting_(image_.size(), 0) {}

void Grower::grow(double tolerance) {
    start(PatchMap::open_pixel, tolerance);
    // Tiles are worth another look where many pixels have come.
    do {
        over_tiles(patches_.tiles().large);
        over_tiles(patches_.tiles().small);
    } while (over_pixels(rounds_between_tiles, true) > worth_tiles);
    over_pixels(image_.size(), true);
    patches_.refit();
}

void Grower::fill(double tolerance) {
    start(PatchMap::edge_pixel, tolerance);
    over_pixels(image_.size(), false);
}

// The free pixels that touch a patch come to the front.
void Grower::start(PatchMap::Free reach, double tolerance) {
    reach_ = reach;
    limit_ = tolerance * tolerance;
    std::vector<std::vector<int>> found(static_cast<std::size_t>(patches_.team().size()));
    parallel_for(image_.rows(), patches_.team(), [&](int first, int last, int thread) {
        patches_.for_free(first, last, reach, [&](int p) {
            bool touches = false;
            for (const int step : image_.neighbours()) touches = touches || patches_[p + step];
            if (touches) found[static_cast<std::size_t>(thread)].push_back(p);
        });
    });
    front_.clear();
    for (const auto& of_thread : found)
        for (const int p : of_thread) wait(p);
}

void Grower::wait(int p) {
    if (waiting_[p]) return;
    waiting_[p] = 1;
    front_.push_back(p);
}

void Grower::refit_when_due(Patch& patch) {
    if (patch.count() < patch.refit_at) return;
    patch.surface = image_.surface_of(patch.sums);
    patch.refit_at = PatchMap::refit_after(patch.count());
}

bool Grower::is_free(const Tiles& tiles, int t) const {
    if (!tiles.is_open(t)) return false;
    for (int row = 0, p = tiles.first_pixel(t); row < tiles.side(); ++row, p += image_.stride())
        if (!patches_.are_open(p, tiles.side())) return false;
    return true;
}

// The misfit of a tile to a patch, as a level of the queue.
int Grower::level_of(const Tiles& tiles, int t, int i) const {
    const double limit = tile_tolerance * tile_tolerance * limit_;
    const double r = image_.residual(tiles.sums(t), patches_.patch(i).surface);
    return r < limit ? static_cast<int>(r / limit * TileQueue::levels) : TileQueue::levels;
}

void Grower::take_tile(const Tiles& tiles, int t, int i) {
    Patch& patch = patches_.patch(i);
    patch.sums.add(tiles.sums(t));
    refit_when_due(patch);
    for (int row = 0; row < tiles.side(); ++row)
        for (int p = tiles.first_pixel(t) + row * image_.stride(), end = p + tiles.side(); p < end; ++p)
            patches_.take(p, i);
    taken_.push_back(t);
}

// Offers every free tile to the patches that touch it, and those around it in turn.
void Grower::over_tiles(const Tiles& tiles) {
    const int stride = image_.stride(), side = tiles.side();
    const auto for_around = [&](int t, auto&& visit) {  // the pixels around a tile
        const int p = tiles.first_pixel(t);
        for (int k = 0; k < side; ++k) visit(p - stride + k);
        for (int k = 0; k < side; ++k) visit(p + side * stride + k);
        for (int k = 0; k < side; ++k) visit(p - 1 + k * stride);
        for (int k = 0; k < side; ++k) visit(p + side + k * stride);
    };
    // Those that touch a patch, in parallel; each thread keeps the order, and so does the queue.
    std::vector<std::vector<std::pair<int, TileQueue::Entry>>> offers(static_cast<std::size_t>(patches_.team().size()));
    parallel_for(tiles.count(), patches_.team(), [&](int begin, int end, int thread) {
        for (int t = begin; t < end; ++t) {
            if (!is_free(tiles, t)) continue;
            std::array<int, 4> offered{};  // lately
            std::size_t next = 0;
            for_around(t, [&](int q) {
                const int i = patches_[q];
                if (!i || std::find(offered.begin(), offered.end(), i) != offered.end()) return;
                offered[next++ % offered.size()] = i;
                const int level = level_of(tiles, t, i);
                if (level < TileQueue::levels) offers[static_cast<std::size_t>(thread)].push_back({level, {t, i}});
            });
        }
    });
    for (const auto& of_thread : offers)
        for (const auto& [level, entry] : of_thread) queue_.push(level, entry);
    taken_.clear();
    TileQueue::Entry entry{};
    Checkpoints checkpoints(256);
    while (queue_.pop(entry)) {
        checkpoints.pass();
        const auto [t, i] = entry;
        if (!is_free(tiles, t)) continue;
        if (level_of(tiles, t, i) == TileQueue::levels) continue;  // the surface has changed meanwhile
        take_tile(tiles, t, i);
        const int row = t / tiles.cols(), col = t % tiles.cols();
        for (const auto& [inside, beside] :
             {std::make_pair(row > 0, t - tiles.cols()), std::make_pair(row + 1 < tiles.rows(), t + tiles.cols()),
              std::make_pair(col > 0, t - 1), std::make_pair(col + 1 < tiles.cols(), t + 1)})
            if (inside && is_free(tiles, beside)) {
                const int level = level_of(tiles, beside, i);
                if (level < TileQueue::levels) queue_.push(level, {beside, i});
            }
    }
    for (const int t : taken_)
        for_around(t, [&](int q) {
            if (patches_.is_free(q, reach_)) wait(q);
        });
}

Grower::Choice Grower::choose(int p) const {
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

// Calls visit(k) for all k of front_, in parallel if they are many.
template <class F>
void Grower::for_front(F&& visit) {
    const auto visit_all = [&](int begin, int end, int) {
        Checkpoints checkpoints;
        for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
            checkpoints.pass();
            patches_.prefetch(front_[std::min(k + prefetched, front_.size() - 1)]);
            visit(k);
        }
    };
    const int size = static_cast<int>(front_.size());
    if (front_.size() >= worth_threads)
        parallel_for(size, patches_.team(), visit_all);
    else
        visit_all(0, size, 0);
}

// Choices become true. Every patch belongs to one thread, which adds its pixels in order.
void Grower::commit(bool refit) {
    const int threads = front_.size() >= worth_threads ? patches_.team().size() : 1;
    const auto of_thread = [&](int thread) {
        Checkpoints checkpoints;
        for (std::size_t k = 0; k < front_.size(); ++k) {
            checkpoints.pass();
            const int p = front_[k], i = choices_[k].patch;
            patches_.prefetch(front_[std::min(k + prefetched, front_.size() - 1)]);
            if (i % threads != thread) continue;
            waiting_[p] = 0;
            if (!i) continue;
            patches_.take(p, i);
            if (!refit) continue;
            Patch& patch = patches_.patch(i);
            patch.sums.add(image_.sample(p));
            refit_when_due(patch);
        }
    };
    if (threads > 1)
        patches_.team().run(of_thread);
    else
        of_thread(0);
}

// Returns how many pixels were taken.
int Grower::over_pixels(int rounds, bool refit) {
    int count = 0;
    for (int round = 0; round < rounds && !front_.empty(); ++round) {
        choices_.resize(front_.size());
        for_front(
            [&](std::size_t k) { choices_[k] = patches_.is_free(front_[k], reach_) ? choose(front_[k]) : Choice{}; });
        commit(refit);
        next_.swap(front_);
        front_.clear();
        Checkpoints checkpoints;
        for (std::size_t k = 0; k < next_.size(); ++k) {
            checkpoints.pass();
            if (choices_[k].patch) {
                ++count;
                for (const int step : image_.neighbours())
                    if (patches_.is_free(next_[k] + step, reach_)) wait(next_[k] + step);
            }
        }
    }
    return count;
}

void Grower::adjust_borders() {
    front_.clear();
    patches_.for_borders(0, image_.rows(), [&](int p) {
        for (const int q : {p + 1, p + image_.stride()})
            if (patches_[p] && patches_[q] && patches_[p] != patches_[q]) wait(p), wait(q);
    });
    for (int round = 0; round < most_adjustments && !front_.empty(); ++round) {
        choices_.resize(front_.size());
        for_front([&](std::size_t k) {
            const int p = front_[k], own = patches_[p];
            Choice best{own, -1};
            for (const int step : image_.neighbours()) {
                const int other = patches_[p + step];
                if (!own || !other || other == best.patch || other == own) continue;
                if (best.residual < 0) best.residual = image_.residual(p, patches_.patch(own).surface);
                const double r = image_.residual(p, patches_.patch(other).surface);
                if (r < best.residual) best = {other, r};
            }
            choices_[k] = best;
        });
        next_.swap(front_);
        front_.clear();
        for (const int p : next_) waiting_[p] = 0;
        Checkpoints checkpoints;
        for (std::size_t k = 0; k < next_.size(); ++k) {
            checkpoints.pass();
            const int p = next_[k];
            if (choices_[k].patch == patches_[p]) continue;
            patches_.take(p, choices_[k].patch);
            wait(p);
            for (const int step : image_.neighbours())
                if (patches_[p + step]) wait(p + step);
        }
    }
    for (const int p : front_) waiting_[p] = 0;
    front_.clear();
}

}  // namespace rangeedge
