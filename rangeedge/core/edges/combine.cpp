// SPDX-License-Identifier: Apache-2.0
#include "edges/combine.hpp"

#include <algorithm>

#include "base/watch.hpp"

namespace rangeedge {
namespace {

// The pixels [first, last) of the maps.
struct Band {
    std::int32_t first, last;

    // Those beside the cut; returns whether there is one.
    template <class Visit>
    bool for_each_pixel(const Candidate& c, Visit&& visit) const {
        bool here = false;
        for (const std::int32_t p : {c.before, c.after})
            if (p >= first && p < last) visit(p), here = true;
        return here;
    }
};

void combine(const CandidateList& candidates, const Band& band, const EdgeMaps& maps) {
    const auto [size, jump, crease, kind, significance] = maps;
    const std::ptrdiff_t pixels = band.last - band.first;
    for (float* map : {jump, crease, significance}) std::fill_n(map + band.first, pixels, 0.0f);
    std::fill_n(kind + band.first, pixels, std::uint8_t{0});
    constexpr int jumps = jump_bit | occluding_bit | occluded_bit, creases = convex_bit | concave_bit;
    Checkpoints checkpoints(64);  // each of which may be the first to touch its piece of memory
    std::vector<const Candidate*> others;
    // The largest jump of a pixel (paper, 4.2), and the side of it on which the pixel is.
    for (const Candidate& c : candidates) {
        checkpoints.pass();
        const bool jumps_here = c.kind & jump_bit;
        const bool here = band.for_each_pixel(c, [&, jump = jump, kind = kind, significance = significance](int p) {
            jump[p] = std::max(jump[p], c.jump);
            if (!jumps_here) return;
            const bool nearer = ((c.kind & occluding_bit) != 0) == (p == c.before);
            kind[p] = static_cast<std::uint8_t>(kind[p] | jump_bit | (nearer ? occluding_bit : occluded_bit));
            significance[p] = std::max(significance[p], c.significance);
        });
        if (here && !jumps_here) others.push_back(&c);
    }
    // A pixel with a more significant crease is no jump.
    for (const Candidate* c : others) {
        checkpoints.pass();
        if (!(c->crease > 0)) continue;
        band.for_each_pixel(*c, [&, kind = kind, significance = significance](int p) {
            if (c->significance > significance[p]) kind[p] = static_cast<std::uint8_t>(kind[p] & ~jumps);
        });
    }
    // The largest crease of the others (paper, 4.2), and its type.
    for (const Candidate* c : others) {
        checkpoints.pass();
        band.for_each_pixel(*c, [&, crease = crease, kind = kind, significance = significance](int p) {
            if (kind[p] & jump_bit) return;
            significance[p] = std::max(significance[p], c->significance);
            if (c->crease > crease[p] || (c->crease > 0 && c->crease == crease[p] && (c->kind & convex_bit)))
                kind[p] = static_cast<std::uint8_t>((kind[p] & ~creases) | (c->kind & creases));
            crease[p] = std::max(crease[p], c->crease);
        });
    }
}

}  // namespace

void combine(const CandidateList& candidates, const EdgeMaps& maps, Team& team) {
    // Candidates lie row by row of the image, nearly: where their number is divided evenly, pixels are.
    const auto border = [&](int i) {
        if (i == 0 || i == team.size() || candidates.empty()) return i == 0 ? 0 : maps.size;
        return candidates[candidates.size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(team.size())]
            .before;
    };
    std::vector<std::int32_t> borders;
    for (int i = 0; i <= team.size(); ++i) borders.push_back(border(i));
    std::sort(borders.begin(), borders.end());
    team.run([&](int thread) {
        const auto i = static_cast<std::size_t>(thread);
        combine(candidates, Band{borders[i], borders[i + 1]}, maps);
    });
}

}  // namespace rangeedge
