// Contour closure: edges dilated until what they enclose is a surface (Jiang, PAMI 22(11) 2000).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "regions/surface_image.hpp"

namespace rangeedge {

struct ClosureParameters {
    double correlation;  // standard deviation of a pixel from its surface, in units of that between pixels
    double tolerance;    // of a pixel on its surface, in these standard deviations
    double share;        // of the pixels of a surface that lie on it
    int dilations;       // at most, by a pixel each
    int min_area;        // of a component, in pixels
};

// Labels 1, 2, ... of the parts of what is no edge that are surfaces, grown back over the rest of it; 0 elsewhere.
void verified_regions(const RangeMap& map, const ClosureParameters& parameters, int threads, std::int32_t* regions);

}  // namespace rangeedge
