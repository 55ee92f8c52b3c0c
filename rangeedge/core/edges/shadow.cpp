// SPDX-License-Identifier: Apache-2.0
#include "edges/shadow.hpp"

#include <algorithm>
#include <cmath>

#include "edges/smear.hpp"

namespace rangeedge {

template <class T>
ShadowStep step_across_shadow(const Line<T>& line, const Curve& f, const Curve& g, int before, int after, bool spaced) {
    const double x1 = line.abscissa(before), x2 = line.abscissa(after);
    ShadowStep step;
    step.before_nearer = f.value(x1) > g.value(x2);
    const Curve &near = step.before_nearer ? f : g, &far = step.before_nearer ? g : f;
    const double x_near = step.before_nearer ? x1 : x2, x_far = step.before_nearer ? x2 : x1;
    // The end of the nearer surface, above that of the farther one and above the place to which that runs on.
    const double end = near.value(x_near), beyond = far.value(x_far), below = far.value(x_near);
    if (line.frame->projective && !(std::min({end, beyond, below}) > 0)) return {};
    if (spaced && line.grazing_angle(before, after) > veil) return {};
    step.jump = std::min(line.depth(beyond), line.depth(below)) - line.depth(end);
    step.difference = end - std::max(beyond, below);
    if (!spaced) step.difference = std::min(step.difference, near.value(x_far) - beyond);
    const double variance = f.value_variance(x_near) + g.value_variance(x_near);
    step.deviation = line.sigma_between(before, after) * std::sqrt(variance);
    return step;
}

template ShadowStep step_across_shadow(const Line<float>&, const Curve&, const Curve&, int, int, bool);
template ShadowStep step_across_shadow(const Line<double>&, const Curve&, const Curve&, int, int, bool);

}  // namespace rangeedge
