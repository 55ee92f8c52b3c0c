// Patches grow over tiles first: a tile of 8 x 8 pixels without an edge joins the neighbouring patch it fits best, by
// its power sums alone, those that fit well before all others; then tiles of 4 x 4. What is left are strips along edges
// and borders, which grow pixel by pixel. Both grow in rounds: all that touch a patch choose among the patches they
// touch, then all choices become true at once. So every round can be shared among threads, and its outcome does not
// depend on how.
// SPDX-License-Identifier: Apache-2.0
#include "regions/growing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace rangeedge {
namespace {

constexpr double tile_tolerance = 0.8;      // root mean square misfit of a tile, in tolerances of a pixel
constexpr double shares[]{0.5, 1};          // of the mean square misfit: tiles that fit well come first
constexpr int rounds_between_tiles = 8;     // of pixels
constexpr int worth_tiles = 600;            // one pixel in so many that grew meanwhile
constexpr int most_adjustments = 8;         // rounds at borders
constexpr std::size_t prefetched = 12;      // pixels ahead
constexpr std::size_t worth_threads = 256;  // pixels
constexpr std::size_t tiles_worth_threads = 16;

// Each once, in raster order.
void sort_out(std::vector<int>& tiles) {
    std::sort(tiles.begin(), tiles.end());
    tiles.erase(std::unique(tiles.begin(), tiles.end()), tiles.end());
}

// Visits the pixels around a tile.
template <class F>
void for_around(const Tiles& tiles, int t, int stride, F&& visit) {
    const int p = tiles.first_pixel(t), side = tiles.side();
    for (int k = 0; k < side; ++k) visit(p - stride + k);
    for (int k = 0; k < side; ++k) visit(p + side * stride + k);
    for (int k = 0; k < side; ++k) visit(p - 1 + k * stride);
    for (int k = 0; k < side; ++k) visit(p + side + k * stride);
}

}  // namespace

Grower::Grower(PatchMap& patches)
    : patches_(patches), image_(patches.image()), waiting_(image_.size(), 0), came_(image_.size(), 0),
      found_(static_cast<std::size_t>(patches.team().size())), offers_(found_.size() * found_.size()) {}

void Grower::grow(double tolerance) {
    start(PatchMap::open_pixel, tolerance);
    // Tiles are worth another look where many pixels have come.
    do {
        over_tiles(patches_.tiles().large);
        over_tiles(patches_.tiles().small);
    } while (over_pixels(rounds_between_tiles, true) > image_.size() / worth_tiles);
    over_pixels(image_.size(), true);
    patches_.refit();
}

void Grower::fill(double tolerance) {
    start(PatchMap::edge_pixel, tolerance);
    over_pixels(image_.size(), false);
}

// The pixels that for_rows(first, last, visit) finds in rows [first, last) become the front.
template <class F>
void Grower::start(F&& for_rows) {
    parallel_for(image_.rows(), patches_.team(), [&](int first, int last, int thread) {
        for_rows(first, last, [&](int p) {
            waiting_[p] = pixel_waits;
            found_[static_cast<std::size_t>(thread)].push_back(p);
        });
    });
    front_.clear();
    gather(front_);
}

// Likewise the free pixels that touch a patch.
void Grower::start(PatchMap::Free reach, double tolerance) {
    reach_ = reach;
    limit_ = tolerance * tolerance;
    start([&](int first, int last, auto&& visit) { patches_.for_touching(first, last, reach, visit); });
}

// Appends what the threads have found.
void Grower::gather(std::vector<int>& to) {
    for (std::vector<int>& of_thread : found_) {
        if (to.empty())
            to.swap(of_thread);
        else
            to.insert(to.end(), of_thread.begin(), of_thread.end());
        of_thread.clear();
    }
}

void Grower::wait(int p) {
    if (waiting_[p]) return;
    waiting_[p] = pixel_waits;
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

// Which of the patches around a tile it fits best.
Grower::Choice Grower::choose(const Tiles& tiles, int t, const SurfaceSums& sums) const {
    Choice best{0, HUGE_VAL};
    std::array<int, 4> known{};  // lately
    std::size_t next = 0;
    for_around(tiles, t, image_.stride(), [&](int q) {
        const int i = patches_[q];
        if (!i || std::find(known.begin(), known.end(), i) != known.end()) return;
        known[next++ % known.size()] = i;
        const double r = image_.residual(sums, patches_.patch(i).surface);
        if (r < best.residual) best = {i, r};
    });
    return best;
}

void Grower::take_tile(const Tiles& tiles, int t, int i, const SurfaceSums& sums) {
    Patch& patch = patches_.patch(i);
    patch.sums.add(sums);
    refit_when_due(patch);
    for (int row = 0; row < tiles.side(); ++row)
        for (int p = tiles.first_pixel(t) + row * image_.stride(), end = p + tiles.side(); p < end; ++p)
            patches_.take(p, i);
}

// How many threads share the patches: all, or one where there is little to do. Patch i belongs to owner i % owners.
int Grower::owner_count(bool shared) const { return shared ? patches_.team().size() : 1; }

// Calls body(owner) for every owner.
template <class F>
void Grower::for_owners(int owners, F&& body) {
    if (owners > 1)
        patches_.team().run(body);
    else
        body(0);
}

void Grower::over_tiles(const Tiles& tiles) {
    // Tiles of pixels that touch a patch, in raster order.
    for_front([&](int p, std::size_t thread) {
        std::vector<int>& found = found_[thread];
        const int t = tiles.at(p);
        if (t >= 0 && (found.empty() || t != found.back())) found.push_back(t);
    });
    tiles_.clear(), taken_.clear();
    gather(tiles_);
    sort_out(tiles_);
    const double limit = tile_tolerance * tile_tolerance * limit_;
    for (const double share : shares) over_tiles(tiles, share * limit);
    // The free pixels around those that were taken come to the front.
    parallel_for(static_cast<int>(taken_.size()), patches_.team(), [&](int begin, int end, int thread) {
        for (int k = begin; k < end; ++k)
            for_around(tiles, taken_[static_cast<std::size_t>(k)], image_.stride(), [&](int q) {
                if (patches_.is_free(q, reach_) && !waiting_[q]) found_[static_cast<std::size_t>(thread)].push_back(q);
            });
    });
    for (std::vector<int>& of_thread : found_) {
        for (const int p : of_thread) wait(p);
        of_thread.clear();
    }
}

// Takes tiles whose misfit is below `limit`, and those around them in turn. Others that were looked at are left in
// tiles_.
void Grower::over_tiles(const Tiles& tiles, double limit) {
    rejected_.clear();
    while (!tiles_.empty()) {
        const int count = static_cast<int>(tiles_.size());
        const bool shared = tiles_.size() >= tiles_worth_threads;
        const int owners = owner_count(shared);
        choices_.assign(tiles_.size(), {});
        sums_.resize(std::max(sums_.size(), tiles_.size()));
        const auto choose_all = [&](int begin, int end, int) {
            Checkpoints checkpoints(256);
            for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
                checkpoints.pass();
                if (!is_free(tiles, tiles_[k])) continue;
                sums_[k] = tiles.sums(tiles_[k]);
                choices_[k] = choose(tiles, tiles_[k], sums_[k]);
            }
        };
        if (shared)
            parallel_for(count, patches_.team(), choose_all);
        else
            choose_all(0, count, 0);
        for_owners(owners, [&](int owner) {
            Checkpoints checkpoints;
            for (std::size_t k = 0; k < tiles_.size(); ++k) {
                checkpoints.pass();
                if (choices_[k].patch && choices_[k].residual < limit && choices_[k].patch % owners == owner)
                    take_tile(tiles, tiles_[k], choices_[k].patch, sums_[k]);
            }
        });
        const std::size_t before = taken_.size();
        for (std::size_t k = 0; k < tiles_.size(); ++k) {
            waiting_[tiles.first_pixel(tiles_[k])] &= pixel_waits;
            if (choices_[k].patch) (choices_[k].residual < limit ? taken_ : rejected_).push_back(tiles_[k]);
        }
        tiles_.clear();
        for (std::size_t k = before; k < taken_.size(); ++k) {
            const int t = taken_[k], row = t / tiles.cols(), col = t % tiles.cols();
            for (const auto& [inside, beside] :
                 {std::make_pair(row > 0, t - tiles.cols()), std::make_pair(row + 1 < tiles.rows(), t + tiles.cols()),
                  std::make_pair(col > 0, t - 1), std::make_pair(col + 1 < tiles.cols(), t + 1)}) {
                if (!inside || !tiles.is_open(beside)) continue;
                std::uint8_t& waiting = waiting_[tiles.first_pixel(beside)];
                if (waiting & tile_waits || !patches_.is_free(tiles.first_pixel(beside), reach_)) continue;
                waiting |= tile_waits;
                tiles_.push_back(beside);
            }
        }
    }
    sort_out(rejected_);
    tiles_.swap(rejected_);
}

// Which of the neighbouring patches a free pixel fits best.
int Grower::choose(int p) const {
    Choice best{0, limit_};
    int last = 0;
    for (const int step : image_.neighbours()) {
        const int i = patches_[p + step];
        if (!i || i == last) continue;
        last = i;
        const double r = image_.residual(p, patches_.patch(i).surface);
        if (r < best.residual) best = {i, r};
    }
    return best.patch;
}

// Calls visit(p, thread) for all pixels p of the front, in parallel if they are many; every thread has its own stretch.
template <class F>
void Grower::for_front(F&& visit) {
    const auto visit_all = [&](int begin, int end, int thread) {
        Checkpoints checkpoints;
        for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
            checkpoints.pass();
            patches_.prefetch(front_[std::min(k + prefetched, front_.size() - 1)]);
            visit(front_[k], static_cast<std::size_t>(thread));
        }
    };
    const int size = static_cast<int>(front_.size());
    if (front_.size() >= worth_threads)
        parallel_for(size, patches_.team(), visit_all);
    else
        visit_all(0, size, 0);
}

// Offers become true. Every patch belongs to one owner, which adds its pixels in the order of the front.
void Grower::commit(int owners, bool refit) {
    for_owners(owners, [&](int owner) {
        Checkpoints checkpoints;
        for (int thread = 0; thread < owners; ++thread) {
            std::vector<Offer>& offers = offers_[static_cast<std::size_t>(thread * owners + owner)];
            for (std::size_t k = 0; k < offers.size(); ++k) {
                checkpoints.pass();
                patches_.prefetch(offers[std::min(k + prefetched, offers.size() - 1)].pixel);
                const auto [p, i] = offers[k];
                patches_.take(p, i);
                came_[p] = round_;
                if (!refit) continue;
                Patch& patch = patches_.patch(i);
                patch.sums.add(image_.sample(p));
                refit_when_due(patch);
            }
            offers.clear();
        }
    });
}

// One round: the pixels of the front go where they choose, all at once, and the pixels q beside one that went, p, for
// which concerns(p, q) holds, become the front. Returns how many went.
template <class Choose, class Concerns>
int Grower::over_front(Choose&& choose, Concerns&& concerns, bool refit) {
    if (++round_ == 0) {
        std::fill(came_.begin(), came_.end(), std::uint8_t{0});
        round_ = 1;
    }
    const int owners = owner_count(front_.size() >= worth_threads);
    for_front([&, every = static_cast<std::size_t>(owners)](int p, std::size_t thread) {
        waiting_[p] = 0;
        const int i = choose(p);
        if (i) offers_[thread * every + static_cast<std::size_t>(i) % every].push_back({p, i});
    });
    std::size_t went = 0;
    for (int k = 0; k < owners * owners; ++k) went += offers_[static_cast<std::size_t>(k)].size();
    commit(owners, refit);
    const std::array<int, 4> around = image_.neighbours();
    for_front([&](int p, std::size_t thread) {
        if (came_[p] != round_) return;
        for (std::size_t k = 0; k < around.size(); ++k) {
            const int q = p + around[k];
            if (!concerns(p, q)) continue;
            // Of all that came beside it, the first counts.
            bool found = false;
            for (std::size_t other = 0; other < k; ++other) {
                const int beside = q - around[other];
                found = found || (came_[beside] == round_ && concerns(beside, q));
            }
            if (found) continue;
            waiting_[q] = pixel_waits;
            found_[thread].push_back(q);
        }
    });
    front_.clear();
    gather(front_);
    return static_cast<int>(went);
}

// Returns how many pixels were taken.
int Grower::over_pixels(int rounds, bool refit) {
    int count = 0;
    for (int round = 0; round < rounds && !front_.empty(); ++round)
        count += over_front([&](int p) { return patches_.is_free(p, reach_) ? choose(p) : 0; },
                            [&](int, int q) { return patches_.is_free(q, reach_); }, refit);
    return count;
}

void Grower::adjust_borders() {
    start([&](int first, int last, auto&& visit) { patches_.for_rims(first, last, visit); });
    const auto choose_other = [&](int p) {
        const int own = patches_[p];
        Choice best{0, -1};
        for (const int step : image_.neighbours()) {
            const int other = patches_[p + step];
            if (!other || other == best.patch || other == own) continue;
            if (best.residual < 0) best.residual = image_.residual(p, patches_.patch(own).surface);
            const double r = image_.residual(p, patches_.patch(other).surface);
            if (r < best.residual) best = {other, r};
        }
        return best.patch;
    };
    for (int round = 0; round < most_adjustments && !front_.empty(); ++round)
        over_front(choose_other, [&](int p, int q) { return patches_[q] && patches_[q] != patches_[p]; }, false);
    for (const int p : front_) waiting_[p] = 0;
    front_.clear();
}

}  // namespace rangeedge
