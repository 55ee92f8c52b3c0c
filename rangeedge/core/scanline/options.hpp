// The options of edge detection, as `ScanLineParams` documents them; the paper's own setting is ScanLineParams.paper().
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace rangeedge {

struct ScanLineOptions {
    double eps;                 // tolerance of splitting, as a length; 0: `eps_factor` times the noise
    double eps_factor;          // standard deviations
    int directions;             // of scan lines, bits of Direction
    bool interpolate;           // curves through end points and midpoint instead of least squares
    bool endpoint;              // strengths from either end point instead of at the midpoint
    bool normals;               // crease angles between surface normals instead of the largest of the directions
    double max_shift;           // samples from the cut to the position of the edge
    int max_gap;                // samples without data between two segments that are compared
    int max_smear;              // samples of a smeared step
    bool shadows;               // whether the two sides of a wider gap are compared for outlines
    bool spaced;                // whether the spacing of pixels is known as a length
    double merge_significance;  // standard deviations below which a cut is taken back
    double min_significance;    // standard deviations below which a candidate is dropped
};

}  // namespace rangeedge
