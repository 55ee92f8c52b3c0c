// SPDX-License-Identifier: Apache-2.0
#include "edges/combine.hpp"

#include <algorithm>

namespace rangeedge {

void combine(const std::vector<Candidate>& candidates, float* jump, float* crease, std::uint8_t* kind,
             float* significance) {
    constexpr int types = convex_bit | concave_bit;
    for (const Candidate& c : candidates) {
        for (const std::int32_t p : {c.before, c.after}) {
            const bool nearer = ((c.kind & occluding_bit) != 0) == (p == c.before);
            if (c.kind & jump_bit)
                kind[p] = static_cast<std::uint8_t>(kind[p] | jump_bit | (nearer ? occluding_bit : occluded_bit));
            if (c.crease > crease[p] || (c.crease > 0 && c.crease == crease[p] && (c.kind & convex_bit)))
                kind[p] = static_cast<std::uint8_t>((kind[p] & ~types) | (c.kind & types));
            crease[p] = std::max(crease[p], c.crease);
            jump[p] = std::max(jump[p], c.jump);
            significance[p] = std::max(significance[p], c.significance);
        }
    }
}

}  // namespace rangeedge
