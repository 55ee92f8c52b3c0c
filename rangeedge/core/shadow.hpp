// Outlines beside shadow: where a surface ends at samples without data, in front of another one beyond them.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "approximation.hpp"
#include "line.hpp"

namespace rangeedge {

// The step from the sample before a wide gap to that after it.
struct ShadowStep {
    double jump = 0, difference = 0, significance = 0;  // a length, and in ordinates
    bool before_nearer = false;
};

// From the curve f before the gap to g after it. They are one surface with a hole in it, or two that meet there, where
// the farther one runs on to the end of the nearer one, or where a surface between the two ends could be seen, since it is
// not almost parallel to the viewing direction. Then the significance is not positive. Unless pixels are `spaced` there
// are no angles, and the nearer surface must not run on to the end of the farther one either.
template <class T>
ShadowStep step_across_shadow(const Line<T>& line, const Curve& f, const Curve& g, int before, int after, bool spaced);

}  // namespace rangeedge
