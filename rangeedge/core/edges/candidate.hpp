// An edge candidate: one cut of one scan line (paper, 4.2), with its strengths and what its neighbours ask of it.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "base/memory.hpp"

namespace rangeedge {

// Bits of Candidate::kind and of the kinds of pixels.
enum Kind : std::uint8_t {
    jump_bit = 1,
    convex_bit = 2,
    concave_bit = 4,
    occluding_bit = 8,  // of a candidate: the surface before the cut is the nearer one
    occluded_bit = 16,
    boundary_bit = 32,  // of a pixel
};

constexpr float endless = 1e30f;  // the largest variance, and the largest significance

// One side of a cut: the curve's ordinate there, its slope per unit of the plane and the slope's variance.
struct Side {
    float value, slope, slope_variance;
};

struct Candidate {
    float x, y;          // position in pixels
    float shift;         // samples from the cut to the position
    float spread;        // standard deviation of the position of a crease, in samples
    float jump, crease;  // length, degrees
    float significance;  // standard deviations as one of several neighbours has them, at last together with these
    std::uint8_t kind, direction;
    bool smeared;                // a step over several samples, in whose middle it lies
    std::int32_t before, after;  // linear indices of the pixels on either side
    std::int32_t order;          // by direction, then by line, then along the line
    Side sides[2];
    float plane_position[2], plane_direction[2];  // of the edge, and of its scan line, in the plane of the image
};

using CandidateList = std::vector<Candidate, LargeAllocator<Candidate>>;

}  // namespace rangeedge
