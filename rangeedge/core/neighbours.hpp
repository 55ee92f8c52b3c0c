// What the neighbours of an edge candidate, in other lines and directions, add to it.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "edges.hpp"
#include "parallel.hpp"

namespace rangeedge {

// Candidates by square cells of the image, row by row of cells, so that neighbours lie close to each other in memory.
class Cells {
public:
    static constexpr int size = 4;  // pixels

    Cells(int image_rows, int image_cols) : rows_(image_rows / size + 1), cols_(image_cols / size + 1) {}

    int rows() const { return rows_; }
    int cols() const { return cols_; }
    // The first candidate of a cell, and of the next one.
    int begin(int col, int row) const { return start_[index(col, row)]; }
    int end(int col, int row) const { return start_[index(col, row) + 1]; }

    // Sorts the candidates of all spans, in order, by cells.
    struct Span {
        const Candidate *first, *last;
    };
    std::vector<Candidate> sort(const std::vector<Span>& spans);

private:
    std::size_t index(int col, int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(cols_) + static_cast<std::size_t>(col);
    }
    std::size_t cell_of(const Candidate& c) const {
        const auto clamped = [](float at, int count) { return std::min(std::max(static_cast<int>(at) / size, 0), count - 1); };
        return index(clamped(c.x, cols_), clamped(c.y, rows_));
    }

    int rows_, cols_;
    std::vector<std::int32_t> start_;
};

// Joins the significance of candidates of one kind that lie close together, since a real edge goes on from line to
// line, and drops those below `min_significance`. Creases move onto the line that they form. With `normals`, the crease
// becomes the angle between the normals of the two surfaces, each found from the tangents that the neighbours have on
// its side. The candidates are sorted by `cells`, before and after.
template <class T>
void pool(std::vector<Candidate>& candidates, Cells& cells, const RangeImage<T>& image, const Parameters& parameters,
          Team& team);

}  // namespace rangeedge
