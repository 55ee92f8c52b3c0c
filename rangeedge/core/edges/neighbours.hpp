// What the neighbours of an edge candidate, in other lines and directions, add to it.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "edges/candidate.hpp"
#include "base/parallel.hpp"

namespace rangeedge {

// Places for candidates by square cells of the image, row by row of cells, so that neighbours lie close together.
class Cells {
public:
    static constexpr int size = 4;  // pixels

    Cells(int image_rows, int image_cols)
        : rows_(image_rows / size + 1), cols_(image_cols / size + 1),
          end_(static_cast<std::size_t>(rows_) * static_cast<std::size_t>(cols_) + 1, 0) {}

    // All candidates are counted before the first one is placed.
    void count(const std::vector<Candidate>& candidates) {
        for (const Candidate& c : candidates) ++end_[cell_of(c) + 1];
    }
    // Calls visit(candidate, its place) for all, which in a cell are in the order they come.
    template <class Visit>
    void place(const std::vector<Candidate>& candidates, Visit&& visit) {
        if (!summed_) std::partial_sum(end_.begin(), end_.end(), end_.begin());
        summed_ = true;
        for (const Candidate& c : candidates) visit(c, static_cast<std::size_t>(end_[cell_of(c)]++));
    }

    int rows() const { return rows_; }
    int cols() const { return cols_; }
    // The places of a cell, once all candidates are placed.
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
    bool summed_ = false;
    std::vector<std::int32_t> end_;  // of the places taken so far
};

// Joins the significance of candidates of one kind that lie close together, since a real edge goes on from line to
// line, and drops those below `min_significance`. Creases move onto the line that they form. With `normals`, the crease
// becomes the angle between the normals of the two surfaces, each found from the tangents that the neighbours have on
// its side.
template <class T>
void pool(std::vector<Candidate>& candidates, const RangeImage<T>& image, const Parameters& parameters, Team& team);

}  // namespace rangeedge
