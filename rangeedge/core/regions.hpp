// Regions: surfaces that grow from markers, compete for pixels, and are merged where one surface explains both.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "surface.hpp"

namespace rangeedge {

// Maps of rows * cols pixels. Planes of the scene are affine functions ordinate(x, y).
struct RegionImage {
    int rows, cols;
    const float* x;         // place on the image plane, neighbours about 1 apart
    const float* y;
    const float* ordinate;  // grows toward the viewer; NaN: no data
    const float* sigma;     // standard deviation of the ordinate, > 0
    const std::uint8_t* edges;
    // Normals: the ordinate is offset + unit * `ordinate`, the image plane to_plane * (x, y, 1).
    bool projective;
    double offset, unit;
    std::array<double, 6> to_plane;
};

struct RegionParameters {
    double tolerance;     // of a pixel on its surface, in standard deviations
    double lateral;       // standard deviation of a pixel's place, in pixels
    double smooth_angle;  // degrees: surfaces that meet under less go on into each other
    int min_area;         // pixels
    bool new_seeds;       // whether what no marker reaches may grow regions of its own
};

// Labels 1..n in raster order of first pixels, 0 where no surface fits; returns n.
int grow_regions(const RegionImage& image, const std::int32_t* markers, const RegionParameters& parameters,
                 std::int32_t* labels);

}  // namespace rangeedge
