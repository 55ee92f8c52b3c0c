// Roofs: sets of pixels that two planes describe better than one quadratic.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "regions/surface_image.hpp"

namespace rangeedge {

// Whether two planes that meet in a crease describe the pixels better than `curved`, their quadratic, and which pixels
// lie on which plane.
bool split_roof(const SurfaceImage& image, const Pixels& pixels, const Surface& curved, Pixels& first, Pixels& second);

}  // namespace rangeedge
