// SPDX-License-Identifier: Apache-2.0
#include "edges/neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

#include "edges/align.hpp"
#include "edges/neighbourhood.hpp"
#include "edges/normals.hpp"

namespace rangeedge {
namespace {

constexpr float largest_share = 8;      // standard deviations: at most so much evidence is a single candidate
constexpr float lone_share = 1 / 3.0f;  // of its significance, is what a candidate without neighbours is worth
constexpr int evidence_field = first_field;
// Standard deviations by which creases move at the most when they are aligned, and then again, with neighbours that are
// in line already: only as far as the noise explains it.
constexpr double alignments[] = {HUGE_VAL, 4};

// The weighted sum of squared significances.
template <int bytes>
RANGEEDGE_INLINE float evidence_in(const NeighbourGrid::Near& near) {
    using F = Floats<bytes>;
    const float* evidence = near.grid->field(evidence_field);
    F sum = F::all(0);
    for_each_lanes<bytes>(
        near, [&](int k, const F& w, const F&, const F&) RANGEEDGE_ALWAYS { sum += w * F::load(evidence + k); });
    return sum.sum();
}
RANGEEDGE_VERSIONS(float, evidence, (const NeighbourGrid::Near& near), (near))

}  // namespace

CandidateList in_place(const std::vector<const Candidate*>& found, NeighbourGrid& grid) {
    CandidateList candidates(found.size());
    const auto at = [&](int i) -> const Candidate& { return *found[static_cast<std::size_t>(i)]; };
    grid.sort(static_cast<int>(found.size()), evidence_field + 1, at, [&](std::int32_t i, std::int32_t k) {
        Candidate& c = candidates[static_cast<std::size_t>(k)];
        c = at(i);
        c.order = i;
        return k;
    });
    return candidates;
}

template <class T>
void join_neighbours(CandidateList& candidates, NeighbourGrid& grid, const Frame<T>& frame,
                     const ScanLineOptions& options, CandidateList* weak_ones) {
    const auto least = static_cast<float>(options.min_significance);
    const bool aligned = options.max_shift > 0;
    if (!(least > 0 || aligned || options.normals)) return;
    grid.for_each([&](std::size_t i, std::ptrdiff_t k) {
        const float s = std::min(candidates[i].significance, largest_share);
        grid.field(evidence_field)[k] = s * s;
    });
    grid.for_each_near([&](std::size_t i, const NeighbourGrid::Near& near) {
        Candidate& c = candidates[i];
        c.significance = std::max(std::sqrt(evidence(near)), c.significance * lone_share);
    });
    Checkpoints checkpoints;
    const auto weak = [&](const Candidate& c) { return c.significance < least; };
    const auto goes = [&](const Candidate& c) {
        checkpoints.pass();
        return weak(c);
    };
    if (weak_ones) std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(*weak_ones), weak);
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(), goes), candidates.end());

    // Jumps have no more to do with each other.
    std::vector<std::int32_t> creases;
    for (std::size_t i = 0; i < candidates.size(); ++i)
        if (candidates[i].crease > 0) creases.push_back(static_cast<std::int32_t>(i));
    const auto crease = [&](int i) { return creases[static_cast<std::size_t>(i)]; };
    const auto at = [&](int i) -> const Candidate& { return candidates[static_cast<std::size_t>(crease(i))]; };
    const auto sort = [&](int fields) {
        grid.sort(static_cast<int>(creases.size()), fields, at,
                  [&](std::int32_t i, std::int32_t) { return crease(i); });
    };
    for (const double max_spreads : alignments) {
        if (!aligned) break;
        sort(first_field);
        grid.for_each_near([&](std::size_t i, const NeighbourGrid::Near& near) {
            align(candidates[i], near, frame, options.max_shift, max_spreads);
        });
    }
    if (!options.normals) return;
    sort(tangent_fields);
    fill_tangents(candidates, grid);
    grid.for_each_near([&](std::size_t i, const NeighbourGrid::Near& near) {
        const double angle = normal_angle(near, frame.projective);
        if (angle >= 0) candidates[i].crease = static_cast<float>(angle);
    });
}

#define RANGEEDGE_INSTANTIATE(T)                                                                           \
    template void join_neighbours(CandidateList&, NeighbourGrid&, const Frame<T>&, const ScanLineOptions&, \
                                  CandidateList*);
RANGEEDGE_INSTANTIATE(float)
RANGEEDGE_INSTANTIATE(double)

}  // namespace rangeedge
