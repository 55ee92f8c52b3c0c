// Region hypotheses verified by a surface (Jiang, PAMI 22(11) 2000).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "surface_image.hpp"

namespace rangeedge {

// For each label 1..count of `labels`, writes to accepted[label] whether a plane, or a quadratic that two planes do not
// beat, leaves at most 1 - `share` of its pixels farther off than `tolerance` standard deviations, each `correlation`
// times that between pixels. accepted[0] is 0.
void verify_surfaces(const RangeMap& map, const std::int32_t* labels, int count, double correlation, double tolerance,
                     double share, std::uint8_t* accepted);

}  // namespace rangeedge
