// The combination of the four directions into maps of pixels (paper, 4.2): of several candidates a pixel takes the
// largest jump and the largest crease, and the type, convex or concave, of that crease. Both pixels beside a cut take
// part. Surfaces either meet at a pixel or do not: of its jumps and creases, the most significant candidate decides
// which the pixel is, and one with a jump has no crease. The crease of the default setting, the angle between surface
// normals, is found before, from the candidates of several directions together (normals.hpp).
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

#include "base/parallel.hpp"
#include "edges/candidate.hpp"

namespace rangeedge {

// A value for each of the pixels of an image.
struct EdgeMaps {
    std::int32_t size;  // pixels
    float *jump, *crease;
    std::uint8_t* kind;
    float* significance;
};

// The maps hold zeros where there are none. Of equal creases, convex. The order of candidates decides nothing but how
// evenly threads share them: they should lie row by row.
void combine(const CandidateList& candidates, const EdgeMaps& maps, Team& team);

}  // namespace rangeedge
