// SPDX-License-Identifier: Apache-2.0
#include "regions/patches.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "base/simd.hpp"
#include "regions/roof.hpp"

namespace rangeedge {
namespace {

constexpr int max_cuts = 4;    // of one set of pixels into planes
constexpr double grown = 1.1;  // a patch that may have become a roof, in pixels it had when it was none

// A row of n pixels each; rows are `stride` apart.
RANGEEDGE_WIDE void mark_changes(const int* __restrict label, int stride, int n, std::uint8_t* __restrict marks) {
    const int* const below = label + stride;
    for (int k = 0; k < n; ++k) marks[k] = ((label[k] ^ label[k + 1]) | (label[k] ^ below[k])) != 0;
}

RANGEEDGE_WIDE void mark_contacts(const int* __restrict label, int stride, int n, std::uint8_t* __restrict marks) {
    const int *const above = label - stride, *const below = label + stride;
    for (int k = 0; k < n; ++k) {
        const int own = label[k], a = above[k], b = below[k], c = label[k - 1], d = label[k + 1];
        const int differ =
            ((a != 0) & (a != own)) | ((b != 0) & (b != own)) | ((c != 0) & (c != own)) | ((d != 0) & (d != own));
        marks[k] = static_cast<std::uint8_t>(differ & (own != 0));
    }
}

RANGEEDGE_WIDE void mark_up_to(const std::uint8_t* __restrict state, int n, std::uint8_t reach,
                               std::uint8_t* __restrict marks) {
    for (int k = 0; k < n; ++k) marks[k] = static_cast<std::uint8_t>((state[k] != 0) & (state[k] <= reach));
}

RANGEEDGE_WIDE void keep_beside(const int* __restrict label, int stride, int n, std::uint8_t* __restrict marks) {
    const int *const above = label - stride, *const below = label + stride;
    for (int k = 0; k < n; ++k)
        marks[k] = static_cast<std::uint8_t>(marks[k] & ((above[k] | below[k] | label[k - 1] | label[k + 1]) != 0));
}

}  // namespace

PatchMap::PatchMap(const RangeMap& map, Team& team)
    : image_(map, lateral_deviation, team), tiles_(image_, team), team_(team), label_(image_.size(), 0),
      free_(image_.states()) {
    create({});
    const TileNoise noise = tile_noise(tiles_);
    image_.set_correlation(std::min(noise.deviation, correlation_max), noise.area);
}

void PatchMap::mark_borders(int p, std::uint8_t* marks) const {
    mark_changes(&label_[p], image_.stride(), image_.cols(), marks);
}

void PatchMap::mark_rims(int p, std::uint8_t* marks) const {
    mark_contacts(&label_[p], image_.stride(), image_.cols(), marks);
}

void PatchMap::mark_free(int p, Free reach, std::uint8_t* marks) const {
    mark_up_to(&free_[p], image_.cols(), reach, marks);
}

void PatchMap::mark_touching(int p, Free reach, std::uint8_t* marks) const {
    mark_free(p, reach, marks);
    keep_beside(&label_[p], image_.stride(), image_.cols(), marks);
}

void PatchMap::create(const Piece& piece) {
    const int i = surfaces_.add();
    regions_.add();
    patches_.push_back({piece.sums, piece.surface, refit_after(piece.sums.count())});
    for (const int p : piece.pixels) take(p, i);
}

void PatchMap::join_surfaces(int a, int b) {
    Patch& joint = patch(a);
    joint.sums = joint.sums.joined(patch(b).sums);
    joint.surface = image_.surface_of(joint.sums);
    surfaces_.link(b, a);
}

void PatchMap::flatten() {
    Array<int> of(count());
    for (int i = 0; i < count(); ++i) of[i] = surface(i);
    parallel_for(label_.count(), team_, [&](int begin, int end, int) {
        for (int p = begin; p < end; ++p) label_[p] = of[label_[p]];
    });
}

void PatchMap::refit() {
    parallel_for(count(), team_, [&](int begin, int end, int) {
        for (int i = begin; i < end; ++i)
            if (patch(i).count()) patch(i).surface = image_.surface_of(patch(i).sums);
    });
}

std::vector<SurfaceSums> PatchMap::sums_of(const std::vector<Pixels>& sets) const {
    std::vector<SurfaceSums> sums(sets.size());
    parallel_each(static_cast<int>(sets.size()), team_, [&](int i, int) {
        const auto k = static_cast<std::size_t>(i);
        sums[k] = image_.sums_of(sets[k]);
    });
    return sums;
}

void PatchMap::add_markers(const std::int32_t* markers) {
    // Runs of equal markers, by marker.
    struct Run {
        std::int32_t marker;
        int begin, end;
    };
    std::vector<std::vector<Run>> found(static_cast<std::size_t>(team_.size()));
    parallel_for(image_.rows(), team_, [&](int first, int last, int thread) {
        for (int row = first; row < last; ++row)
            for (int col = 0; col < image_.cols();) {
                const std::int32_t* const m = markers + std::ptrdiff_t{row} * image_.cols();
                const std::int32_t marker = m[col];
                const int begin = col;
                while (col < image_.cols() && m[col] == marker) ++col;
                if (marker <= 0) continue;
                found[static_cast<std::size_t>(thread)].push_back(
                    {marker, image_.index(row, begin), image_.index(row, col)});
            }
    });
    std::vector<Run> runs;
    for (const auto& of_thread : found) runs.insert(runs.end(), of_thread.begin(), of_thread.end());
    std::stable_sort(runs.begin(), runs.end(), [](const Run& a, const Run& b) { return a.marker < b.marker; });
    std::vector<std::size_t> start;  // of every marker
    for (std::size_t k = 0; k < runs.size(); ++k)
        if (k == 0 || runs[k].marker != runs[k - 1].marker) start.push_back(k);
    std::vector<Pixels> sets(start.size());
    start.push_back(runs.size());
    parallel_each(static_cast<int>(sets.size()), team_, [&](int i, int) {
        const auto n = static_cast<std::size_t>(i);
        Checkpoints checkpoints;
        for (std::size_t k = start[n]; k < start[n + 1]; ++k) {
            checkpoints.pass();
            for (int p = runs[k].begin; p < runs[k].end; ++p)
                if (image_.open(p)) sets[n].push_back(p);
        }
    });
    const std::vector<SurfaceSums> sums = sums_of(sets);
    estimate_correlation(sums);
    add_patches(sets, sums, HUGE_VAL);
}

bool PatchMap::add_patches(const std::vector<Pixels>& sets, double limit) {
    return add_patches(sets, sums_of(sets), limit);
}

bool PatchMap::add_patches(const std::vector<Pixels>& sets, const std::vector<SurfaceSums>& sums, double limit) {
    std::vector<std::vector<Piece>> pieces(sets.size());
    parallel_each(static_cast<int>(sets.size()), team_, [&](int i, int) {
        const auto k = static_cast<std::size_t>(i);
        divide(sets[k], sums[k], 0, pieces[k]);
    });
    const int before = count();
    Checkpoints checkpoints(64);
    for (const auto& of_set : pieces)
        for (const Piece& piece : of_set) {
            checkpoints.pass();
            if (image_.residual(piece.sums, piece.surface) < limit * limit) create(piece);
        }
    return count() > before;
}

void PatchMap::divide(const Pixels& pixels, const SurfaceSums& sums, int cuts, std::vector<Piece>& pieces) const {
    if (sums.count() < least_pixels) return;
    const Surface surface = image_.surface_of(sums);
    Pixels first, second;
    if (cuts < max_cuts && !image_.is_flat(surface) && split_roof(image_, pixels, sums.quadratic(), first, second)) {
        divide(first, image_.sums_of(first), cuts + 1, pieces);
        divide(second, image_.sums_of(second), cuts + 1, pieces);
    } else {
        pieces.push_back({pixels, sums, surface});
    }
}

// Noise correlated over several pixels moves surfaces more than its deviation between neighbours tells. The noise of
// tiles says how much at least, the typical misfit of a quadratic to one of the sets how much where sets are large.
void PatchMap::estimate_correlation(const std::vector<SurfaceSums>& sums) {
    std::vector<std::pair<double, int>> misfits;
    double total = 0, sum = 0;
    for (const SurfaceSums& s : sums)
        if (s.count() >= least_curved) {
            misfits.emplace_back(s.quadratic().rms, s.count());
            total += s.count();
        }
    std::sort(misfits.begin(), misfits.end());
    for (const auto& [rms, count] : misfits) {
        sum += count;
        if (2 * sum < total) continue;
        image_.set_correlation(std::clamp(rms, image_.correlation(), correlation_max), image_.correlation_area());
        return;
    }
}

// Runs first; every thread has its own rows.
std::vector<Pixels> PatchMap::pixels_of(const Array<int>& number, int count) const {
    struct Run {
        int begin, end;
    };
    const auto n = static_cast<std::size_t>(count);
    std::vector<std::vector<std::vector<Run>>> found(static_cast<std::size_t>(team_.size()),
                                                     std::vector<std::vector<Run>>(n));
    parallel_for(image_.rows(), team_, [&](int first, int last, int thread) {
        auto& own = found[static_cast<std::size_t>(thread)];
        for (int row = first; row < last; ++row) {
            Watch::checkpoint();
            for (int p = image_.index(row, 0), end = p + image_.cols(), next = p; p < end; p = next) {
                const int label = label_[p];
                while (next < end && label_[next] == label) ++next;
                if (const int k = number[label]) own[static_cast<std::size_t>(k - 1)].push_back({p, next});
            }
        }
    });
    std::vector<Pixels> sets(n);
    parallel_each(count, team_, [&](int i, int) {
        const auto k = static_cast<std::size_t>(i);
        std::size_t size = 0;
        for (const auto& of_thread : found)
            for (const Run& run : of_thread[k]) size += static_cast<std::size_t>(run.end - run.begin);
        sets[k].resize(size);
        auto to = sets[k].begin();
        for (const auto& of_thread : found)
            for (const Run& run : of_thread[k]) {
                std::iota(to, to + (run.end - run.begin), run.begin);
                to += run.end - run.begin;
            }
    });
    return sets;
}

bool PatchMap::cut_roofs() {
    // What has hardly grown since it was found to be no roof is none.
    Array<int> number(count(), 0);  // among the patches to test, from 1
    int candidates = 0;
    for (int i = 1; i < count(); ++i) {
        const Patch& p = patch(i);
        if (p.surface.curved && p.count() >= least_curved && p.count() > grown * p.whole) number[i] = ++candidates;
    }
    if (!candidates) return false;
    const std::vector<Pixels> sets = pixels_of(number, candidates);
    std::vector<std::vector<Piece>> pieces(sets.size());
    Array<int> owner(candidates);
    for (int i = 1; i < count(); ++i)
        if (number[i]) owner[number[i] - 1] = i;
    parallel_each(candidates, team_, [&](int i, int) {
        const auto k = static_cast<std::size_t>(i);
        Pixels first, second;
        if (!split_roof(image_, sets[k], patch(owner[i]).sums.quadratic(), first, second)) return;
        divide(first, image_.sums_of(first), 1, pieces[k]);
        divide(second, image_.sums_of(second), 1, pieces[k]);
    });
    bool any = false;
    for (int i = 0; i < candidates; ++i) {
        const auto k = static_cast<std::size_t>(i);
        Patch& p = patch(owner[i]);
        p.whole = p.count();
        if (pieces[k].empty()) continue;
        any = true;
        for (const int pixel : sets[k]) release(pixel);
        p.sums = SurfaceSums();
        for (const Piece& piece : pieces[k]) create(piece);
    }
    return any;
}

}  // namespace rangeedge
