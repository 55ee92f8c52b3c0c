// Steps that are smeared over a few samples: pixels at the rim of a surface see the one behind it as well, and
// interpolation, of the sensor or of an image that was resized or registered, mixes the depths of both.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "approximation.hpp"
#include "edges.hpp"
#include "line.hpp"

namespace rangeedge {

// A smeared step: the last sample of the surface before it, the first one of that after it, and the segment there; and
// the most samples without data between two others.
struct Smear {
    int before, after;
    std::size_t next;
    int gap;
};

// The smeared step after segment i of a line; with next = i where there is none. It is a ramp of short segments between
// two long ones: at each of its samples the depth lies between those to which the two sides extend, and it leads from
// the one to the other. A ramp of more than two samples is a surface by itself unless it is almost parallel to the
// viewing direction.
template <class T>
Smear smear_after(const Line<T>& line, const Approximation& a, std::size_t i, const Parameters& parameters);

// The pixels of an image over which steps are smeared. Lines that cross such a step at a flat angle see a ramp of many
// samples there, with creases at its ends.
class SmearMask {
public:
    // From the pixels that each line finds. Those count that, together with the eight around them, are found `least`
    // times: a smeared step goes on from line to line.
    SmearMask(int rows, int cols, const std::vector<const std::vector<std::int32_t>*>& found, int least);

    // Removes jumps whose nearer side is smeared, and creases of which a pixel is smeared or beside one that is.
    void clear_of_candidates(std::vector<Candidate>& candidates) const;
    // 255 where a pixel is smeared; the output holds zeros before.
    void write(std::uint8_t* smeared) const;

private:
    enum : std::uint8_t { beside = 1, within = 2 };
    std::vector<std::uint8_t> mask_;  // empty without smeared pixels
};

}  // namespace rangeedge
