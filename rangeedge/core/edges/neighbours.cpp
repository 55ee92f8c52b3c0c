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

template <class T>
void join_neighbours(std::vector<Candidate>& candidates, const Frame<T>& frame, const ScanLineOptions& options,
                     Team& team, std::vector<Candidate>* weak_ones) {
    const auto least = static_cast<float>(options.min_significance);
    const bool aligned = options.max_shift > 0;
    if (!(least > 0 || aligned || options.normals)) return;
    Checkpoints checkpoints;
    const auto weak = [&](const Candidate& c) { return c.significance < least; };
    const auto goes = [&](const Candidate& c) {
        checkpoints.pass();
        return weak(c);
    };
    NeighbourGrid grid(frame.rows, frame.cols, team);
    grid.sort(candidates, evidence_field + 1);
    grid.for_each([&](std::size_t i, std::ptrdiff_t k) {
        const float s = std::min(candidates[i].significance, largest_share);
        grid.field(evidence_field)[k] = s * s;
    });
    grid.for_each_near([&](std::size_t i, const NeighbourGrid::Near& near) {
        Candidate& c = candidates[i];
        c.significance = std::max(std::sqrt(evidence(near)), c.significance * lone_share);
    });
    if (weak_ones) std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(*weak_ones), weak);
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(), goes), candidates.end());
    for (const double max_spreads : alignments) {
        if (!aligned) break;
        grid.sort(candidates, first_field);
        grid.for_each_near([&](std::size_t i, const NeighbourGrid::Near& near) {
            align(candidates[i], near, frame, options.max_shift, max_spreads);
        });
    }
    if (!options.normals) return;
    sort_with_tangents(candidates, grid);
    grid.for_each_near([&](std::size_t i, const NeighbourGrid::Near& near) {
        Candidate& c = candidates[i];
        const double angle = c.crease > 0 ? normal_angle(near, frame.projective) : -1;
        if (angle >= 0) c.crease = static_cast<float>(angle);
    });
}

template void join_neighbours(std::vector<Candidate>&, const Frame<float>&, const ScanLineOptions&, Team&,
                              std::vector<Candidate>*);
template void join_neighbours(std::vector<Candidate>&, const Frame<double>&, const ScanLineOptions&, Team&,
                              std::vector<Candidate>*);

}  // namespace rangeedge
