// SPDX-License-Identifier: Apache-2.0
#include "scanline.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "simd.hpp"

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
template <class T>
struct Worst {
    T residual;
    int at;
};

// Over samples first .. last - 1.
template <class T>
Worst<T> worst_of(const Run<T>& run, const ThreePoint<T>& curve, int first, int last) {
    Worst<T> worst{-1, first};
    for (int k = first; k < last; ++k) {
        T r = curve.residual(run.x ? run.x[k] : static_cast<T>(k), run.y[k]);
        if (run.scale) r *= run.scale[k];
        if (r > worst.residual) worst = {r, k};
    }
    return worst;
}

// The same for samples one unit apart, sixteen at a time: each lane keeps its own worst.
template <int bytes>
RANGEEDGE_INLINE Worst<float> worst_of_lanes_in(const float* y, const float* scale, const ThreePoint<float>& curve,
                                                int first, int last) {
    using F = Floats<bytes>;
    using I = Ints<bytes>;
    const F ym = F::all(curve.ym), a = F::all(curve.a), b = F::all(curve.b);
    const auto midpoint = static_cast<int>(curve.origin);
    F worst = F::all(-1);
    I at = I::all(first);
    for (int k = first; k < last; k += F::count) {
        const F t = F::from(static_cast<float>(k - midpoint));
        F r = magnitude(F::load(y + k) - (ym + t * (b + a * t)));
        if (scale) r *= F::load(scale + k);
        r = first_lanes(r, last - k);
        const I index = I::from(k);
        for (int p = 0; p < F::parts; ++p) {
            const auto larger = r.part[p] > worst.part[p];
            worst.part[p] = larger ? r.part[p] : worst.part[p];
            at.part[p] = larger ? index.part[p] : at.part[p];
        }
    }
    // Across the lanes, without branches: which is the worst cannot be foretold.
    const float most = worst.joined([](float p, float q) { return p > q ? p : q; });
    const I beyond = I::all(last);
    for (int p = 0; p < F::parts; ++p) at.part[p] = worst.part[p] == most ? at.part[p] : beyond.part[p];
    return {most, at.joined([](int p, int q) { return p < q ? p : q; })};
}
RANGEEDGE_VERSIONS(Worst<float>, worst_of_lanes,
                   (const float* y, const float* scale, const ThreePoint<float>& curve, int first, int last),
                   (y, scale, curve, first, last))

template <class T>
Worst<T> worst_sample(const Run<T>& run, const Segment& s) {
    const ThreePoint<T> curve(run, s);
    const int first = s.first + 1;
    if constexpr (std::is_same_v<T, float>)
        if (!run.x) return worst_of_lanes(run.y, run.scale, curve, first, s.last);
    return worst_of(run, curve, first, s.last);
}

}  // namespace

template <class T>
void split_run(const Run<T>& run, T eps, std::vector<Segment>& pending, std::vector<Segment>& segments) {
    pending.push_back({run.first, run.last});
    while (!pending.empty()) {
        const Segment s = pending.back();
        pending.pop_back();
        const Worst<T> worst = s.size() > 3 ? worst_sample(run, s) : Worst<T>{0, s.first};
        if (!(worst.residual > eps)) {
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
