// SPDX-License-Identifier: Apache-2.0
#include "edges/shadow.hpp"

#include <algorithm>
#include <cmath>

#include "edges/smear.hpp"
#include "edges/strength.hpp"

namespace rangeedge {
namespace {

// To where a surface may run on from one abscissa to another: by its curve, which far from its samples is uncertain, or
// straight on.
struct Extension {
    double lower, upper;

    Extension(const Curve& curve, double from, double to) {
        const double curved = curve.value(to), straight = curve.value(from) + curve.slope(from) * (to - from);
        lower = std::min(curved, straight), upper = std::max(curved, straight);
    }
};

}  // namespace

template <class T>
ShadowStep step_across_shadow(const Line<T>& line, const Fit& f, const Fit& g, int before, int after, bool spaced) {
    const double x1 = line.abscissa(before), x2 = line.abscissa(after);
    ShadowStep step;
    step.before_nearer = f.curve.value(x1) > g.curve.value(x2);
    const Curve &near = (step.before_nearer ? f : g).curve, &far = (step.before_nearer ? g : f).curve;
    const double x_near = step.before_nearer ? x1 : x2, x_far = step.before_nearer ? x2 : x1;
    // The end of the nearer surface, above that of the farther one and above the place to which that runs on.
    const double end = near.value(x_near), beyond = far.value(x_far);
    const double below = Extension(far, x_far, x_near).upper;
    if (line.frame->projective && !(std::min({end, beyond, below}) > 0)) return {};
    if (spaced && line.grazing_angle(before, after) > veil) return {};
    step.jump = std::min(line.depth(beyond, x_far), line.depth(below, x_near)) - line.depth(end, x_near);
    step.difference = end - std::max(beyond, below);
    if (!spaced) step.difference = std::min(step.difference, Extension(near, x_near, x_far).lower - beyond);
    const FitDeviation deviation = jump_deviation(value_deviation(*line.noise, line.noise_at(before).of_fit(f.samples),
                                                                  f.samples, f.curve.value_variance(x_near)),
                                                  value_deviation(*line.noise, line.noise_at(after).of_fit(g.samples),
                                                                  g.samples, g.curve.value_variance(x_near)));
    step.deviation = deviation.single, step.shared_deviation = deviation.shared;
    return step;
}

template ShadowStep step_across_shadow(const Line<float>&, const Fit&, const Fit&, int, int, bool);
template ShadowStep step_across_shadow(const Line<double>&, const Fit&, const Fit&, int, int, bool);

}  // namespace rangeedge
