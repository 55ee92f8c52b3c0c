// Outlines beside shadow. A surface that ends at a gap too wide for its two sides to be extended to the middle, in
// front of another one beyond, has a jump at its end: the gap is what the sensor's second eye, or its lamp, does not
// reach.
//
// The two sides are one surface with a hole in it, or meet there, where the farther one runs on to the end of the
// nearer one, along its curve or straight on, or where a surface between the two ends could be seen, since it is not
// almost parallel to the line of sight. The paper does not compare segments across pixels without data.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "scanline/curve.hpp"
#include "scanline/line.hpp"
#include "scanline/options.hpp"

namespace rangeedge {

// The step from the sample before a gap to that after it, a length, and its difference of ordinates with the standard
// deviation of that; not positive where there is none.
struct ShadowStep {
    double jump = 0, difference = 0;
    double deviation = 0, shared_deviation = 0;  // of one line, and of neighbouring lines together
    bool before_nearer = false;
};

// From the fit f before the gap to g after it. Unless pixels are `spaced` there are no angles to the line of sight;
// then the nearer surface must not run on to the end of the farther one either.
template <class T>
ShadowStep step_across_shadow(const Line<T>& line, const Fit& f, const Fit& g, int before, int after, bool spaced);

}  // namespace rangeedge
