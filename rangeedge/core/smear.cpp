// SPDX-License-Identifier: Apache-2.0
#include "smear.hpp"

#include <algorithm>
#include <cmath>

namespace rangeedge {
namespace {

constexpr int always_smeared = 2;   // samples, too few to show a surface
constexpr double overshoot = 0.1;   // how far beyond a side a smeared depth may lie, as a share of the step
constexpr double own_share = 0.15;  // of the step, up to which a sample belongs to a side
constexpr double least_ramp = 0.5;  // share of an even ramp that the samples must climb
constexpr double veil = 20;         // degrees from the viewing ray, up to which a ramp is no surface

// The angle at which the viewing ray meets the straight line from sample i to sample k, in degrees.
template <class T>
double grazing_angle(const Line<T>& line, int i, int k) {
    struct Point {
        double s, r;
    };
    const auto point = [&](int j) {
        const double w = line.start + line.step * line.abscissa(j), z = line.depth(line.ordinate(j));
        return line.projective ? Point{w * z, line.kappa * z} : Point{w, z};
    };
    const Point a = point(i), b = point(k);
    const Point way{b.s - a.s, b.r - a.r}, ray = line.projective ? Point{a.s + b.s, a.r + b.r} : Point{0, 1};
    return degrees_of(way.s * ray.r - way.r * ray.s, std::abs(way.s * ray.s + way.r * ray.r));
}

}  // namespace

template <class T>
Smear smear_after(const Line<T>& line, const Approximation& a, std::size_t i, const Parameters& parameters) {
    const Smear none{0, 0, i};
    if (a.segments[i].size() <= parameters.max_smear) return none;
    std::size_t next = i + 1;
    int count = 0;
    for (; next < a.count && a.segments[next].size() <= parameters.max_smear; ++next) {
        count += a.segments[next].size();
        if (count > parameters.max_smear) return none;
    }
    if (next == i + 1 || next == a.count) return none;
    for (std::size_t j = i; j < next; ++j)
        if (a.segments[j + 1].first - a.segments[j].last - 1 > parameters.max_gap) return none;

    const Curve &f = a.curves[i], &g = a.curves[next];
    Smear smear{a.segments[i].last, a.segments[next].first, next};
    double side = 0, first = 0, last = 0;
    bool left = true;  // of the ramp
    for (std::size_t j = i + 1; j < next; ++j)
        for (int k = a.segments[j].first; k <= a.segments[j].last; ++k) {
            const double x = line.abscissa(k), yf = f.value(x), yg = g.value(x);
            if (line.projective && !(std::min(yf, yg) > 0)) return none;
            const double zf = line.depth(yf), zg = line.depth(yg), share = (line.depth(line.ordinate(k)) - zf) / (zg - zf);
            const double slack = std::max(overshoot, line.tolerance_at(k) / std::abs(yg - yf));
            if (!(share >= -slack && share <= 1 + slack) || side * (yg - yf) < 0) return none;
            side = yg - yf;
            if (k == a.segments[i + 1].first) first = share;
            last = share;
            left = left && share <= own_share;
            if (left) smear.before = k;
            if (share < 1 - own_share) smear.after = a.segments[next].first;
            else smear.after = std::min(smear.after, k);
        }
    if (last - first < least_ramp * (count - 1) / (count + 1)) return none;
    const int smeared = smear.after - smear.before - 1;
    if (parameters.spaced && smeared > always_smeared && grazing_angle(line, smear.before, smear.after) > veil) return none;
    return smear;
}

template Smear smear_after(const Line<float>&, const Approximation&, std::size_t, const Parameters&);
template Smear smear_after(const Line<double>&, const Approximation&, std::size_t, const Parameters&);

}  // namespace rangeedge
