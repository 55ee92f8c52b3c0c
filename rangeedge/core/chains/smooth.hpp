// The points of a chain, smoothed: on one straight line of the image where its candidates are, else on parabolas over a
// few pixels; the ordinates and normals of both surfaces likewise.
//
// The candidates of a jump lie half way between two pixels, so its straight line is found to a fraction of that only if
// it crosses rows or columns at an angle. A scan line that meets it at a small angle tells more: its half pixel is
// short across the edge.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "chains/link.hpp"
#include "chains/pieces.hpp"

namespace rangeedge {

struct SmoothChain {
    std::vector<ChainPoint> points;
    bool straight = false;
};

template <class T>
SmoothChain smooth_chain(const Piece& chain, const Frame<T>& frame, const CandidateList& candidates,
                         const Crossings& crossings);

}  // namespace rangeedge
