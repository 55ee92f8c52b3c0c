// The straight lines that separate the pixels of two surfaces, and the middle one of them.
//
// Without noise an edge passes between the pixels beside each of its candidates. Lines that do so are, by their values
// at two places, a convex polygon, small where the edge crosses rows, columns and diagonals at many different shares of
// a pixel (the preimage of a digital line: Dorst & Smeulders, PAMI 6(4), 1984). Its centroid is the best estimate.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>

#include "base/array.hpp"
#include "chains/channel.hpp"

namespace rangeedge {

// Pixels next to each other on two sides of a line, by their positions along it and the distances across.
struct PixelPair {
    double upper_position, upper;  // the line passes below
    double lower_position, lower;  // and above
};

// How far lines lie from their middle one: the covariance of their values at two positions, all lines being as likely.
struct LineSpread {
    double first = 0, last = 0;  // positions
    double first_first = 0, first_last = 0, last_last = 0;

    double deviation_at(double position) const {
        const double t = (position - first) / (last - first), s = 1 - t;
        return std::sqrt(std::max(s * s * first_first + 2 * s * t * first_last + t * t * last_last, 0.0));
    }
};

// Moves a fit to the middle of all lines that separate the pairs. Leaves it, and returns false, where too many
// contradict each other, as in noise.
bool separate(const Array<PixelPair>& pairs, AffineFit& fit, LineSpread& spread);

}  // namespace rangeedge
