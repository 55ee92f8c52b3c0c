// Holes become part of the surfaces around them.
//
// Eight lines of sight along the image, from a pixel of a hole to the first labelled pixel of a row, a column or a
// diagonal, tell which surfaces are around it. A surface that has both ends of three of the four lines surrounds the
// pixel, which is its own. Otherwise surfaces are compared in pairs. Two that change their order in depth between
// the pixels where they end meet in a line of the image, and each has the pixels on its side of it. Two that do not
// part in a jump: a pixel at which both were seen, mixed, belongs to the one it is nearer to. Any other belongs to the
// one that has both ends of more lines, as where a hole interrupts the border of the nearer one. Else it is what that
// hides from the light or from another camera, and belongs to the farther one.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "cleaning/surfaces.hpp"

namespace rangeedge {

// Gives the pixels at which `holes` is not 0 the label of a surface; they have none before. `mixed` holds the ordinates
// of pixels that see two surfaces, else NaN. `zero` is the ordinate that no pixel may reach: that of infinite depth,
// minus infinity on a grid. A surface whose ordinate at a pixel is beyond twice what is seen around it is too far off
// to be continued.
void fill_holes(const OrdinateMap& map, const std::vector<Surface>& surfaces, const std::uint8_t* holes,
                const float* mixed, double zero, std::int32_t* labels);

}  // namespace rangeedge
