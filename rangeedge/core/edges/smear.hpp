// Smeared steps. A pixel at the rim of a surface sees the one behind it as well, and interpolation, of the sensor or of
// an image that was resized or registered, mixes the depths of both: a jump becomes a ramp over a few samples, of which
// the paper's splitting makes segments that belong to no surface.
//
// A smeared step is a ramp of short segments between two long ones. At each of its samples the depth lies between those
// to which the two sides extend, and it leads from the one to the other in steps that are not too uneven: the limb of a
// round surface falls off ever faster. A ramp is a surface by itself unless it is steep: seen along the line of sight,
// almost, if it has more than two samples. The jump is that between the long segments.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/array.hpp"
#include "edges/candidate.hpp"
#include "scanline/approximation.hpp"
#include "scanline/line.hpp"
#include "scanline/options.hpp"

namespace rangeedge {

constexpr double veil = 20;  // degrees from the line of sight, up to which a surface would hardly be seen

struct SmearedStep {
    int before, after;    // the last sample of the surface before the ramp, the first one of that after it
    int low, high;        // the samples on either side of the middle of the ramp
    std::ptrdiff_t next;  // the segment after it
    int gap;              // the most samples without data between two others
};

// The one after segment i of a line; with next = i where there is none.
template <class T>
SmearedStep smeared_step(const Line<T>& line, const Approximation& a, std::ptrdiff_t i, const ScanLineOptions& options);

// The pixels of an image over which steps are smeared. Lines that cross such a step at a flat angle see a ramp of many
// samples there, with creases at its ends.
class SmearMask {
public:
    // From the pixels that lines find. Those count that, together with the eight around them, are found `least` times:
    // a smeared step goes on from line to line.
    SmearMask(int rows, int cols, const std::vector<std::int32_t>& found, int least);

    // Removes jumps whose nearer side is smeared, unless they are those of smeared steps, and creases of which a pixel
    // is smeared or beside one that is.
    void clear_of_candidates(CandidateList& candidates) const;
    // 255 where a pixel is smeared; the output holds zeros before.
    void write(std::uint8_t* smeared) const;

private:
    enum : std::uint8_t { beside = 1, within = 2 };
    Array<std::uint8_t> mask_;  // empty without smeared pixels
};

}  // namespace rangeedge
