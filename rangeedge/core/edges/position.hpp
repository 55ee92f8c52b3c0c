// Where an edge is, to a fraction of a pixel (paper, 4.2 and Fig. 5).
//
// Splitting leaves an edge between two samples, and in noise not always between the right ones. The two curves are
// intersected, and the intersection is the edge's position if it lies within `max_shift` samples of the cut. The paper
// asks for no more; here the samples between cut and intersection must also fit the curve to which they then belong,
// since two nearly parallel curves intersect anywhere. Where curves intersect there is no jump.
//
// This is the adaptation along one scan line. The second one, `align` in align.cpp, moves creases onto the line that
// several scan lines give.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>

#include "scanline/approximation.hpp"
#include "scanline/line.hpp"

namespace rangeedge {

// The position of an edge between two samples, at an abscissa, also counted in samples.
struct Position {
    int before, after;
    double abscissa, sample;
    double shift;     // samples that it was moved
    bool intersects;  // the two curves do so here: no jump
};

// The midpoint (x1 + x2) / 2 between the end points of segments i and i + 1 (paper, 4.2).
template <class T>
Position midpoint(const Line<T>& line, const Approximation& a, std::ptrdiff_t i) {
    const int left = a.segments[i].last, right = a.segments[i + 1].first;
    return {left, right, (line.abscissa(left) + line.abscissa(right)) / 2, (left + right) / 2.0, 0, false};
}

// The intersection of the curves of segments i and i + 1 nearest to that, or the midpoint itself.
template <class T>
Position adapted_position(const Line<T>& line, const Approximation& a, std::ptrdiff_t i, double max_shift) {
    const Segment &left = a.segments[i], &right = a.segments[i + 1];
    const Position cut = midpoint(line, a, i);
    const auto moved = [&](int before, int after, double x, double sample) {
        const double shift = sample - cut.sample;
        return std::abs(shift) > max_shift ? cut : Position{before, after, x, sample, shift, true};
    };
    const double reach = line.x ? HUGE_VAL : max_shift + 1;
    double x = 0;
    if (!(max_shift > 0)) return cut;
    if (!intersection(a.curves[i], a.curves[i + 1], cut.abscissa, reach, x)) return cut;
    const double x1 = line.abscissa(left.last), x2 = line.abscissa(right.first), rounding = 1e-9 * (x2 - x1);
    if (x >= x1 - rounding && x <= x2 + rounding)
        return moved(left.last, right.first, x, left.last + (right.first - left.last) * (x - x1) / (x2 - x1));
    // Beyond the end of a segment: its samples up to there go to the other curve.
    const bool leftward = x < x1;
    const int step = leftward ? -1 : 1, begin = leftward ? left.last : right.first;
    const int end = leftward ? left.first : right.last;
    const Curve& other = a.curves[leftward ? i + 1 : i];
    for (int k = begin; k != end; k += step) {
        const double here = line.abscissa(k), next = line.abscissa(k + step);
        if (std::abs(line.ordinate(k) - other.value(here)) > line.tolerance_at(k)) return cut;
        if (leftward ? x < next - rounding : x > next + rounding) continue;
        const int before = leftward ? k - 1 : k;
        return moved(before, before + 1, x, k + step * (x - here) / (next - here));
    }
    return cut;
}

}  // namespace rangeedge
