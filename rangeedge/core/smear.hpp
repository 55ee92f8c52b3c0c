// Steps that are smeared over a few samples: pixels at the rim of a surface see the one behind it as well, and
// interpolation, of the sensor or of an image that was resized or registered, mixes the depths of both.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>

#include "approximation.hpp"
#include "edges.hpp"
#include "line.hpp"

namespace rangeedge {

// A smeared step: the last sample of the surface before it, the first one of that after it, and the segment there.
struct Smear {
    int before, after;
    std::size_t next;
};

// The smeared step after segment i of a line; with next = i where there is none. It is a ramp of short segments between
// two long ones: at each of its samples the depth lies between those to which the two sides extend, and it leads from
// the one to the other. A ramp of more than two samples is a surface by itself unless it is almost parallel to the
// viewing direction.
template <class T>
Smear smear_after(const Line<T>& line, const Approximation& a, std::size_t i, const Parameters& parameters);

}  // namespace rangeedge
