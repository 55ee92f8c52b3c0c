// Square cells of the image, by which candidates are sorted so that neighbours lie close together: a counting sort.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "base/watch.hpp"
#include "edges/candidate.hpp"

namespace rangeedge {

// Places for candidates, row by row of cells.
class Cells {
public:
    static constexpr int size = 4;  // pixels

    Cells(int image_rows, int image_cols)
        : rows_(image_rows / size + 1), cols_(image_cols / size + 1),
          end_(static_cast<std::size_t>(rows_) * static_cast<std::size_t>(cols_) + 1, 0) {}

    // All candidates are counted before the first one is assigned its place.
    void count(const std::vector<Candidate>& candidates) {
        Checkpoints checkpoints;
        for (const Candidate& c : candidates) {
            checkpoints.pass();
            ++end_[cell_of(c) + 1];
        }
    }
    // Calls visit(candidate, its place) for all, which in a cell are in the order they come.
    template <class Visit>
    void assign(const std::vector<Candidate>& candidates, Visit&& visit) {
        if (!counted_) std::partial_sum(end_.begin(), end_.end(), end_.begin());
        counted_ = true;
        Checkpoints checkpoints;
        for (const Candidate& c : candidates) {
            checkpoints.pass();
            visit(c, static_cast<std::size_t>(end_[cell_of(c)]++));
        }
    }

    int rows() const { return rows_; }
    int cols() const { return cols_; }
    // The places of a cell, once all candidates have theirs.
    int begin(int col, int row) const { return index(col, row) > 0 ? end_[index(col, row) - 1] : 0; }
    int end(int col, int row) const { return end_[index(col, row)]; }

private:
    std::size_t index(int col, int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(cols_) + static_cast<std::size_t>(col);
    }
    std::size_t cell_of(const Candidate& c) const {
        const auto clamped = [](float at, int count) {
            return std::min(std::max(static_cast<int>(at) / size, 0), count - 1);
        };
        return index(clamped(c.x, cols_), clamped(c.y, rows_));
    }

    int rows_, cols_;
    bool counted_ = false;           // and summed up: ends are places
    std::vector<std::int32_t> end_;  // of the places taken so far
};

}  // namespace rangeedge
