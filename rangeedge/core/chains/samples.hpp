// What candidates tell at every place of a chain, but for those at its ends that lead off beside a corner.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/array.hpp"
#include "base/vector.hpp"
#include "chains/pieces.hpp"
#include "image/frame.hpp"

namespace rangeedge {

constexpr std::ptrdiff_t most_frayed = 6;  // places at an end that may lead off
constexpr int tangent_reach = 3;           // places on either side that tell the direction at one

struct ChainSample {
    const Candidate* candidate;
    std::ptrdiff_t place;
    bool before_left;  // whether what is before the cut is on the left of the chain
};

struct ChainSamples {
    Array<Point> means;  // positions, of every place
    Array<ChainSample> samples;
    bool closed = false;

    std::ptrdiff_t places() const { return means.size(); }
    std::ptrdiff_t neighbour(std::ptrdiff_t k, std::ptrdiff_t step) const {
        if (closed) return ((k + step) % places() + places()) % places();  // a step may lead around
        return std::min(std::max<std::ptrdiff_t>(k + step, 0), places() - 1);
    }
};

// The ordinate of a pixel with data.
template <class T>
double ordinate_at(const Frame<T>& frame, std::int32_t pixel) {
    if (frame.ordinate) return static_cast<double>(frame.ordinate[pixel]);
    const double along = dot(frame.point(pixel), {frame.axis[0], frame.axis[1], frame.axis[2]});
    return frame.projective ? 1 / along : -along;
}

ChainSamples gather_samples(const Piece& chain, const CandidateList& candidates, const Crossings& crossings);

}  // namespace rangeedge
