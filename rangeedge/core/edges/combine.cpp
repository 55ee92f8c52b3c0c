// SPDX-License-Identifier: Apache-2.0
#include "edges/combine.hpp"

#include <algorithm>

#include "base/watch.hpp"

namespace rangeedge {

void combine(const std::vector<Candidate>& candidates, float* jump, float* crease, std::uint8_t* kind,
             float* significance) {
    constexpr int jumps = jump_bit | occluding_bit | occluded_bit, creases = convex_bit | concave_bit;
    Checkpoints checkpoints(64);  // each of which may be the first to touch its piece of memory
    // The largest jump of a pixel (paper, 4.2), and the side of it on which the pixel is.
    for (const Candidate& c : candidates) {
        checkpoints.pass();
        for (const std::int32_t p : {c.before, c.after}) {
            jump[p] = std::max(jump[p], c.jump);
            if (!(c.kind & jump_bit)) continue;
            const bool nearer = ((c.kind & occluding_bit) != 0) == (p == c.before);
            kind[p] = static_cast<std::uint8_t>(kind[p] | jump_bit | (nearer ? occluding_bit : occluded_bit));
            significance[p] = std::max(significance[p], c.significance);
        }
    }
    // A pixel with a more significant crease is no jump.
    for (const Candidate& c : candidates) {
        checkpoints.pass();
        for (const std::int32_t p : {c.before, c.after})
            if (c.crease > 0 && c.significance > significance[p]) kind[p] = static_cast<std::uint8_t>(kind[p] & ~jumps);
    }
    // The largest crease of the others (paper, 4.2), and its type.
    for (const Candidate& c : candidates) {
        checkpoints.pass();
        for (const std::int32_t p : {c.before, c.after}) {
            if (kind[p] & jump_bit) continue;
            significance[p] = std::max(significance[p], c.significance);
            if (c.crease > crease[p] || (c.crease > 0 && c.crease == crease[p] && (c.kind & convex_bit)))
                kind[p] = static_cast<std::uint8_t>((kind[p] & ~creases) | (c.kind & creases));
            crease[p] = std::max(crease[p], c.crease);
        }
    }
}

}  // namespace rangeedge
