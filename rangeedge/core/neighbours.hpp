// What the neighbours of an edge candidate, in other lines and directions, add to it.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "edges.hpp"

namespace rangeedge {

// Which pixels have data: 1, else 0.
struct Pixels {
    int rows, cols;
    std::vector<std::uint8_t> valid;

    bool valid_at(int col, int row) const {
        return col >= 0 && row >= 0 && col < cols && row < rows &&
               valid[static_cast<std::size_t>(row) * static_cast<std::size_t>(cols) + static_cast<std::size_t>(col)];
    }
};

// Joins the significance of candidates of one kind that lie close together, since a real edge goes on from line to
// line, and drops those below `min_significance`. With `normals`, the crease becomes the angle between the normals of
// the two surfaces, each found from the tangents that the neighbours have on its side.
void pool(std::vector<Candidate>& candidates, const Pixels& pixels, bool projective, const Parameters& parameters);

}  // namespace rangeedge
