// The angle between the normals of the two surfaces that meet at a crease (paper, 2, formula 1).
//
// The paper takes the largest of the angles in four directions, each of them that between two lines in the plane of a
// scan line: never more than the angle between the surfaces, and less where no scan line crosses the crease at a right
// angle (paper, 5). But the tangents of several directions give the normals themselves: on either side of the edge the
// ordinate has, locally, one gradient, of which every scan line in the neighbourhood has measured one component. It is
// found by least squares, slopes counting by the inverse of their variances.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "edges/candidate.hpp"
#include "edges/neighbourhood.hpp"

namespace rangeedge {

// Fills the fields of a grid, of which there are `tangent_fields`, with what `normal_angle` asks of its candidates.
constexpr int tangent_fields = first_field + 10;
void fill_tangents(const CandidateList& candidates, NeighbourGrid& grid);

// In degrees; negative where the neighbours do not fix it.
double normal_angle(const NeighbourGrid::Near& near, bool projective);

}  // namespace rangeedge
