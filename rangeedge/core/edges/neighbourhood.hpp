// The neighbourhood of an edge candidate: the candidates of its kind within a few pixels, with weights that fall with
// their distance. Sums over it are what joins candidates; they are computed for several neighbours side by side.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/array.hpp"
#include "base/parallel.hpp"
#include "base/simd.hpp"
#include "edges/candidate.hpp"
#include "edges/cells.hpp"
#include "scanline/line.hpp"

namespace rangeedge {

constexpr float support = Cells::size;  // pixels; weights fall from 1 at the candidate itself to 0 there

// What neighbours are asked for, one array each: their places, and from `first_field` on what the task needs.
enum Field { x_field, y_field, first_field };

// What sums over neighbours need of candidates, by cells, in arrays that may be read a few lanes beyond their end.
class NeighbourGrid {
public:
    NeighbourGrid(int rows, int cols, Team& team) : cells_(rows, cols), team_(team) {}

    // Takes candidates in place of those before, with room for so many fields: `count` of them, at(i) being the i-th.
    // place(i, k) is called on any thread once it has its place, and returns the index by which it is visited.
    template <class At, class Place>
    void sort(int count, int fields, At&& at, Place&& place) {
        stride_ = count + lanes;
        order_.resize(count);
        kinds_.resize(stride_);
        fields_.resize(stride_ * fields);
        std::fill(kinds_.begin() + count, kinds_.end(), 0);
        for (int f = 0; f < fields; ++f) std::fill_n(field(f) + count, lanes, 0.0f);
        cells_.sort(count, at, team_, [&](std::int32_t i, std::int32_t k) {
            const Candidate& c = at(i);
            order_[k] = place(i, k);
            kinds_[k] = (c.kind & kinds) | c.direction << direction_shift;
            field(x_field)[k] = c.x;
            field(y_field)[k] = c.y;
        });
    }

    float* field(int f) { return fields_.data() + stride_ * f; }
    const float* field(int f) const { return fields_.data() + stride_ * f; }
    const int* kinds_of_all() const { return kinds_.data(); }
    // Calls visit(index of a candidate, its place in the arrays) for all, on any thread.
    template <class Visit>
    void for_each(Visit&& visit) const {
        parallel_for(order_.count(), team_, [&](int begin, int end, int) {
            for (int k = begin; k < end; ++k) visit(static_cast<std::size_t>(order_[k]), k);
        });
    }

    // A candidate and the places, in three rows of cells, where its neighbours are.
    struct Near {
        const NeighbourGrid* grid;
        float x, y;
        int kinds;
        int first[3], last[3];
    };

    // Calls visit(index, near) for all candidates, several rows of cells at a time.
    template <class Visit>
    void for_each_near(Visit&& visit) const {
        parallel_each(cells_.rows(), team_, [&](int row, int) {
            for (int col = 0; col < cells_.cols(); ++col) visit_cell(col, row, visit);
        });
    }

    static constexpr int direction_shift = 8;  // of the bit of a direction in the array of kinds

private:
    static constexpr int kinds = jump_bit | convex_bit | concave_bit;
    static constexpr int lanes = Floats<16>::count;

    template <class Visit>
    void visit_cell(int col, int row, Visit&& visit) const {
        const int begin = cells_.begin(col, row), end = cells_.end(col, row);
        if (begin == end) return;
        Near near{this, 0, 0, 0, {}, {}};
        const int left = std::max(0, col - 1), right = std::min(cells_.cols() - 1, col + 1);
        for (int i = 0; i < 3; ++i) {
            const int y = row + i - 1;
            if (y < 0 || y >= cells_.rows()) continue;
            near.first[i] = cells_.begin(left, y);
            near.last[i] = cells_.end(right, y);
        }
        for (int k = begin; k < end; ++k) {
            near.x = field(x_field)[k];
            near.y = field(y_field)[k];
            near.kinds = kinds_[k] & kinds;
            visit(static_cast<std::size_t>(order_[k]), near);
        }
    }

    Cells cells_;
    Team& team_;
    std::ptrdiff_t stride_ = 0;
    Array<std::int32_t> order_;
    Array<int> kinds_;
    Array<float> fields_;
};

// Calls visit(k, weights, dx, dy) for the candidates k, k + 1, ... several at a time: their distances from the one they
// are near, and weights (1 - d^2 / support^2)^2 that are 0 for those beyond it or of another kind.
template <int bytes, class Visit>
RANGEEDGE_INLINE void for_each_lanes(const NeighbourGrid::Near& near, Visit&& visit) {
    using F = Floats<bytes>;
    using I = Ints<bytes>;
    const float *x = near.grid->field(x_field), *y = near.grid->field(y_field);
    const int* kinds_there = near.grid->kinds_of_all();
    const F cx = F::all(near.x), cy = F::all(near.y), one = F::all(1), per_square = F::all(1 / (support * support));
    const F half = F::all(0.5f);
    const I own = I::all(near.kinds), none = I::all(0);
    for (int i = 0; i < 3; ++i)
        for (int k = near.first[i]; k < near.last[i]; k += F::count) {
            const F dx = F::load(x + k) - cx, dy = F::load(y + k) - cy;
            F rest = one - (dx * dx + dy * dy) * per_square;
            rest = half * (rest + abs(rest));  // 0 where negative
            const I alike = sign_mask(none - (I::load(kinds_there + k) & own));
            const I counts = alike & sign_mask(I::from(k) - I::all(near.last[i]));
            visit(k, from_bits(bits(rest * rest) & counts), dx, dy);
        }
}

// One step along a scan line.
struct Step {
    int dcol, drow;
};
inline Step step_of(int direction) {
    return {direction == cols_bit ? 0 : 1, direction == rows_bit ? 0 : direction == diag45_bit ? -1 : 1};
}

// The line on which a candidate and its neighbours lie: across it, their positions vary least.
struct CommonLine {
    double normal[2];  // of unit length
    double offset;     // of the line from the candidate, along the normal
    bool found;
};
CommonLine common_line(const NeighbourGrid::Near& near);

}  // namespace rangeedge
