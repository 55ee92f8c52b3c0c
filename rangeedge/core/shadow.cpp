// SPDX-License-Identifier: Apache-2.0
#include "shadow.hpp"

#include <algorithm>
#include <cmath>

namespace rangeedge {

template <class T>
ShadowStep step_across_shadow(const Line<T>& line, const Curve& f, const Curve& g, int before, int after, bool spaced) {
    const double xf = line.abscissa(before), xg = line.abscissa(after);
    ShadowStep step;
    step.before_nearer = f.value(xf) > g.value(xg);
    const Curve &near = step.before_nearer ? f : g, &far = step.before_nearer ? g : f;
    const double x_near = step.before_nearer ? xf : xg, x_far = step.before_nearer ? xg : xf;
    // The end of the nearer surface, above that of the farther one and above the place to which that runs on.
    const double end = near.value(x_near), beyond = far.value(x_far), below = far.value(x_near);
    if (line.projective && !(std::min({end, beyond, below}) > 0)) return {};
    step.difference = end - std::max(beyond, below);
    step.jump = std::min(line.depth(beyond), line.depth(below)) - line.depth(end);
    if (spaced && grazing_angle(line, before, after) > veil) return {};
    if (!spaced) step.difference = std::min(step.difference, near.value(x_far) - beyond);
    const double sigma = (line.sigma_at(before) + line.sigma_at(after)) / 2;
    step.significance = step.difference / (sigma * std::sqrt(f.value_variance(x_near) + g.value_variance(x_near)));
    return step;
}

template ShadowStep step_across_shadow(const Line<float>&, const Curve&, const Curve&, int, int, bool);
template ShadowStep step_across_shadow(const Line<double>&, const Curve&, const Curve&, int, int, bool);

}  // namespace rangeedge
