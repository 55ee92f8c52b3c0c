// What the neighbours of an edge candidate, in other lines and directions, add to it.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "edges.hpp"
#include "parallel.hpp"

namespace rangeedge {

// Joins the significance of candidates of one kind that lie close together, since a real edge goes on from line to
// line, and drops those below `min_significance`. With `normals`, the crease becomes the angle between the normals of
// the two surfaces, each found from the tangents that the neighbours have on its side.
template <class T>
void pool(std::vector<Candidate>& candidates, const RangeImage<T>& image, const Parameters& parameters, Team& team);

}  // namespace rangeedge
