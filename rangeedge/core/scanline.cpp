// SPDX-License-Identifier: Apache-2.0
#include "scanline.hpp"

#include <cmath>

namespace rangeedge {
namespace {

// The quadratic through both end points and the midpoint, y = ym + t (b + a t) with t counted from the midpoint.
template <class T>
struct ThreePoint {
    T origin, ym, a, b;

    ThreePoint(const Run<T>& run, const Segment& s) {
        const int m = s.first + (s.last - s.first) / 2;
        const T left = run.x ? run.x[m] - run.x[s.first] : static_cast<T>(m - s.first);
        const T right = run.x ? run.x[s.last] - run.x[m] : static_cast<T>(s.last - m);
        const T slope_left = (run.y[m] - run.y[s.first]) / left;
        const T slope_right = (run.y[s.last] - run.y[m]) / right;
        origin = run.x ? run.x[m] : static_cast<T>(m);
        ym = run.y[m];
        a = (slope_right - slope_left) / (left + right);
        b = slope_left + a * left;
    }
    T residual(T x, T y) const {
        const T t = x - origin;
        return std::abs(y - (ym + t * (b + a * t)));
    }
};

// Where the residual is largest, and how large; the first of equals.
struct Worst {
    int at;
    double residual;
};

template <class T>
Worst worst_sample(const Run<T>& run, const Segment& s) {
    const ThreePoint<T> curve(run, s);
    T largest = -1;
    int at = s.first;
    for (int k = s.first + 1; k < s.last; ++k) {
        T r = curve.residual(run.x ? run.x[k] : static_cast<T>(k), run.y[k]);
        if (run.scale) r *= run.scale[k];
        if (r > largest) {
            largest = r;
            at = k;
        }
    }
    return {at, static_cast<double>(largest)};
}

}  // namespace

template <class T>
void split_run(const Run<T>& run, T eps, std::vector<Segment>& pending, std::vector<Segment>& segments) {
    pending.push_back({run.first, run.last});
    while (!pending.empty()) {
        const Segment s = pending.back();
        pending.pop_back();
        const Worst worst = s.size() > 3 ? worst_sample(run, s) : Worst{s.first, 0.0};
        if (!(worst.residual > static_cast<double>(eps))) {
            segments.push_back(s);
            continue;
        }
        // The cut falls between two samples; the extreme one joins the neighbour it is closer to.
        const int k = worst.at;
        const bool joins_left = std::abs(run.y[k] - run.y[k - 1]) <= std::abs(run.y[k + 1] - run.y[k]);
        const int cut = joins_left ? k : k - 1;
        pending.push_back({cut + 1, s.last});
        pending.push_back({s.first, cut});
    }
}

template void split_run(const Run<float>&, float, std::vector<Segment>&, std::vector<Segment>&);
template void split_run(const Run<double>&, double, std::vector<Segment>&, std::vector<Segment>&);

}  // namespace rangeedge
