// Noise is averaged out within surfaces. What a surface leaves of its pixels is noise, and what is left of its form:
// little, and without slope, so that a mean over neighbours does not bend it where the surface ends.
//
// The mean is weighted by a^(columns + rows apart), along ways that do not leave the surface: two recursive filters,
// one along rows and one along columns. It is taken twice, over few pixels and over many. Where both differ by more
// than noise lets them, the surface has detail there, and the one over few pixels counts. Pixels farther off their
// surface than noise takes them are something else: they do not count for means and are left alone.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "cleaning/surfaces.hpp"

namespace rangeedge {

// The ordinates of all pixels that have a label, also of those without data; NaN elsewhere and where a pixel stays.
// `radius` is the standard deviation of the weights in pixels, > 0.
void smooth_surfaces(const OrdinateMap& map, const std::vector<Surface>& surfaces, const std::int32_t* labels,
                     double radius, int threads, float* smoothed);

}  // namespace rangeedge
