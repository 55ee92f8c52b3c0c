// Regions: surfaces that grow from markers, compete for pixels, and are merged where nothing separates them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "regions/surface_image.hpp"

namespace rangeedge {

struct RegionParameters {
    double tolerance;     // of a pixel on its surface, in standard deviations
    double smooth_angle;  // degrees: planes that meet under less are one surface
    int min_area;         // pixels
    bool new_seeds;       // whether what no marker reaches may grow regions of its own
};

// Labels 1..n in raster order of first pixels, 0 where no surface fits; returns n.
int grow_regions(const RangeMap& map, const std::int32_t* markers, const RegionParameters& parameters, int threads,
                 std::int32_t* labels);

}  // namespace rangeedge
