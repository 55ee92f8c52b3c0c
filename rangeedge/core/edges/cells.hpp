// Square cells of the image, by which candidates are sorted so that neighbours lie close together: a counting sort, of
// which every thread does a band of rows of cells.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "base/parallel.hpp"
#include "edges/candidate.hpp"

namespace rangeedge {

// Places for candidates, row by row of cells.
class Cells {
public:
    static constexpr int size = 4;  // pixels

    Cells(int image_rows, int image_cols) : rows_(image_rows / size + 1), cols_(image_cols / size + 1) {}

    // Calls visit(i, place) for all of `count` candidates, at(i) being the i-th; in a cell they are in the order of i.
    // Both are called on any thread.
    template <class At, class Visit>
    void sort(int count, At&& at, Team& team, Visit&& visit) {
        cell_.resize(static_cast<std::size_t>(count));
        end_.assign(static_cast<std::size_t>(rows_) * static_cast<std::size_t>(cols_) + 1, 0);
        parallel_for(count, team, [&](int begin, int end, int) {
            for (int i = begin; i < end; ++i) cell_[static_cast<std::size_t>(i)] = cell_of(at(i));
        });
        for_each_in_band(team, [&](std::int32_t, std::size_t cell) { ++end_[cell + 1]; });
        std::partial_sum(end_.begin(), end_.end(), end_.begin());
        for_each_in_band(team, [&](std::int32_t i, std::size_t cell) { visit(i, end_[cell]++); });
    }

    int rows() const { return rows_; }
    int cols() const { return cols_; }
    // The places of a cell, once candidates are sorted.
    int begin(int col, int row) const { return index(col, row) > 0 ? end_[index(col, row) - 1] : 0; }
    int end(int col, int row) const { return end_[index(col, row)]; }

private:
    std::size_t index(int col, int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(cols_) + static_cast<std::size_t>(col);
    }
    std::int32_t cell_of(const Candidate& c) const {
        const auto clamped = [](float at, int count) {
            return std::min(std::max(static_cast<int>(at) / size, 0), count - 1);
        };
        return static_cast<std::int32_t>(index(clamped(c.x, cols_), clamped(c.y, rows_)));
    }
    // Each thread visits the candidates of its own cells, in order.
    template <class Visit>
    void for_each_in_band(Team& team, Visit&& visit) {
        team.run([&](int thread) {
            const auto border = [&](int i) {
                return index(0, static_cast<int>(std::int64_t{rows_} * i / team.size()));
            };
            const auto first = static_cast<std::int32_t>(border(thread));
            const auto last = static_cast<std::int32_t>(border(thread + 1));
            Checkpoints checkpoints;
            const auto count = static_cast<std::int32_t>(cell_.size());
            for (std::int32_t i = 0; i < count; ++i) {
                checkpoints.pass();
                const std::int32_t cell = cell_[static_cast<std::size_t>(i)];
                if (cell >= first && cell < last) visit(i, static_cast<std::size_t>(cell));
            }
        });
    }

    int rows_, cols_;
    std::vector<std::int32_t> cell_;  // of each candidate
    std::vector<std::int32_t> end_;   // of the places taken so far
};

}  // namespace rangeedge
