// The noise of a range image at the scale of tiles, which is that of its surfaces where noise has long waves.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "surface_image.hpp"

namespace rangeedge {

struct TileNoise {
    // The standard deviation of pixels from the smooth surface below them, in units of that between neighbours: 1 for
    // independent noise, more where pixels err together.
    double deviation;
    // How many pixels tell as much as one that is independent of all others: n pixels have a mean with the variance of
    // one, over n / area.
    double area;
};

TileNoise tile_noise(const SurfaceImage& image, Team& team);

}  // namespace rangeedge
