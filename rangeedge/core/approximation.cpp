// SPDX-License-Identifier: Apache-2.0
#include "approximation.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "simd.hpp"

namespace rangeedge {
namespace {

constexpr double curved_significance = 5;  // of the quadratic term of a least-squares fit
constexpr double straddling = 2;           // how much more, in significance, a segment across an edge may cost

// Adds the ordinates of n samples one unit apart, the first at abscissa t: eight at a time, then lane by lane.
RANGEEDGE_WIDE
void add_ordinates(const float* y, int n, int t, Moments& m) {
    Double4 s0[2] = {}, s1[2] = {}, s2[2] = {}, sq[2] = {};
    Double4 at[2];
    for (int i = 0; i < 4; ++i) at[0][i] = t + i, at[1][i] = t + i + 4;
    int k = 0;
    for (; k + 8 <= n; k += 8)
        for (int half = 0; half < 2; ++half) {
            Float4 value;
            std::memcpy(&value, y + k + 4 * half, sizeof value);
            const Double4 h = __builtin_convertvector(value, Double4) - m.base, ht = h * at[half];
            s0[half] += h;
            s1[half] += ht;
            s2[half] += ht * at[half];
            sq[half] += h * h;
            at[half] += 8.0;
        }
    for (int half = 0; half < 2; ++half)
        for (int i = 0; i < 4; ++i) m.y0 += s0[half][i], m.y1 += s1[half][i], m.y2 += s2[half][i], m.yy += sq[half][i];
    for (; k < n; ++k) {
        const double h = static_cast<double>(y[k]) - m.base, x = t + k;
        m.y0 += h, m.y1 += h * x, m.y2 += h * x * x, m.yy += h * h;
    }
}

template <class T>
class Approximator {
public:
    Approximator(const Line<T>& line, const Parameters& parameters, Approximation& result)
        : line_(line), parameters_(parameters), r_(result) {}

    void split() {
        const T* x = line_.irregular ? line_.x.data() : nullptr;
        const T* scale = line_.scaled ? line_.scale.data() : nullptr;
        r_.segments.clear();
        for_each_run(line_.y.data(), x, line_.path.size, [&](int first, int last) {
            split_run(Run<T>{line_.y.data(), x, scale, first, last}, static_cast<T>(line_.tolerance), r_.pending,
                      r_.segments);
        });
    }

    void interpolate() {
        r_.curves.clear();
        for (const Segment& s : r_.segments) {
            const int middle = s.first + (s.last - s.first) / 2;
            Moments moments = empty_moments(middle);
            int added = s.first - 1;
            for (const int k : {s.first, middle, s.last}) {
                if (k > added) add(moments, k);
                added = k;
            }
            r_.curves.push_back(fit_interpolating(moments));
        }
    }

    void fit() {
        r_.curves.clear();
        r_.moments.clear();
        for (const Segment& s : r_.segments) {
            r_.moments.push_back(moments_of(s));
            r_.curves.push_back(fit_least_squares(r_.moments.back(), sigma(s), curved_significance));
        }
    }

    // Joins segments; they form a linked list meanwhile, of which the first one stays.
    void join() {
        const int count = static_cast<int>(r_.segments.size());
        r_.previous.resize(r_.segments.size());
        r_.next.resize(r_.segments.size());
        for (int i = 0; i < count; ++i) previous(i) = i - 1, next(i) = i + 1 < count ? i + 1 : none;
        if (count > 1) merge();
        if (count > 2) dissolve();
        std::size_t kept = 0;
        for (int i = count > 0 ? 0 : none; i != none; i = next(i), ++kept) {
            r_.segments[kept] = segment(i);
            r_.curves[kept] = curve(i);
        }
        r_.segments.resize(kept);
        r_.curves.resize(kept);
    }

private:
    static constexpr int none = -1;
    int& previous(int i) { return r_.previous[static_cast<std::size_t>(i)]; }
    int& next(int i) { return r_.next[static_cast<std::size_t>(i)]; }
    Segment& segment(int i) { return r_.segments[static_cast<std::size_t>(i)]; }
    Curve& curve(int i) { return r_.curves[static_cast<std::size_t>(i)]; }
    Moments& moments(int i) { return r_.moments[static_cast<std::size_t>(i)]; }
    double& cost(int i) { return r_.costs[static_cast<std::size_t>(i)]; }

    void remove(int i) {
        next(previous(i)) = next(i);
        if (next(i) != none) previous(next(i)) = previous(i);
    }

    // Takes back cuts, the least significant first, until each one left lowers the sum of squares enough.
    void merge() {
        r_.costs.resize(r_.segments.size());
        for (int i = 0; i != none; i = next(i)) price(i);
        while (!r_.cheap.empty()) {
            const Join join = r_.cheap.front();
            std::pop_heap(r_.cheap.begin(), r_.cheap.end());
            r_.cheap.pop_back();
            const int i = join.left, right = next(i);
            if (cost(i) != join.cost) continue;  // it has changed since
            moments(i) = joined(moments(i), moments(right));
            segment(i).last = segment(right).last;
            curve(i) = fit_least_squares(moments(i), sigma(segment(i)), curved_significance);
            cost(right) = HUGE_VAL;
            remove(right);
            price(i);
            if (previous(i) != none) price(previous(i));
        }
    }

    void price(int i) {
        const double limit = parameters_.merge_significance * parameters_.merge_significance;
        cost(i) = cost_of_merging(i);
        if (!(cost(i) < limit)) return;
        r_.cheap.push_back({cost(i), i});
        std::push_heap(r_.cheap.begin(), r_.cheap.end());
    }

    // Splitting may leave a segment across an edge, its rounding included, where one cut would do. It is taken out
    // where the curves beside it meet within it and, given its samples, explain them nearly as well.
    void dissolve() {
        for (int i = next(0); i != none && next(i) != none;) {
            const int before = previous(i), after = next(i);
            i = !dissolved(i) || previous(before) == none ? after : before;
        }
    }

    Moments empty_moments(int k) const {
        Moments moments;
        moments.origin = line_.abscissa(k);
        moments.base = line_.ordinate(k);
        return moments;
    }
    void add(Moments& moments, int k) const { moments.add(line_.abscissa(k), line_.ordinate(k)); }

    Moments moments_of(const Segment& s) const {
        const int middle = s.first + (s.last - s.first) / 2;
        Moments moments = empty_moments(middle);
        if constexpr (std::is_same_v<T, float>) {
            if (!line_.irregular) {
                moments.count(middle - s.first, s.last - middle);
                add_ordinates(line_.y.data() + s.first, s.size(), s.first - middle, moments);
                return moments;
            }
        }
        for (int k = s.first; k <= s.last; ++k) add(moments, k);
        return moments;
    }

    double sigma(const Segment& s) const { return line_.sigma_at(s.first + s.size() / 2); }

    bool adjacent(int i) {
        const int last = segment(i).last;
        return last + 1 == segment(next(i)).first && line_.abscissa(last) < line_.abscissa(last + 1);
    }

    double cost_of_merging(int i) {
        if (next(i) == none || !adjacent(i)) return HUGE_VAL;
        const double s = line_.sigma_at(segment(i).last);
        const Curve one = fit_least_squares(joined(moments(i), moments(next(i))), s, curved_significance);
        return (one.sum_squares - curve(i).sum_squares - curve(next(i)).sum_squares) / (s * s);
    }

    bool dissolved(int i) {
        const int before = previous(i), after = next(i);
        if (!adjacent(before) || !adjacent(i)) return false;
        const Segment s = segment(i);
        const Curve &f = curve(before), &g = curve(after);
        double x = 0;
        if (!intersection(f, g, (line_.abscissa(s.first) + line_.abscissa(s.last)) / 2, x)) return false;
        if (x < line_.abscissa(s.first - 1) || x > line_.abscissa(s.last + 1)) return false;
        int cut = s.first - 1;
        Moments left = moments(before), right = moments(after);
        for (int k = s.first; k <= s.last; ++k) {
            if (line_.abscissa(k) <= x) cut = k;
            add(k == cut ? left : right, k);
        }
        const double v = sigma(s);
        const Curve to_cut = fit_least_squares(left, v, curved_significance);
        const Curve from_cut = fit_least_squares(right, v, curved_significance);
        const double sum = f.sum_squares + curve(i).sum_squares + g.sum_squares;
        const double limit = straddling * parameters_.merge_significance * v;
        if (!(to_cut.sum_squares + from_cut.sum_squares - sum < limit * limit)) return false;
        segment(before).last = cut;
        segment(after).first = cut + 1;
        moments(before) = left, moments(after) = right;
        curve(before) = to_cut, curve(after) = from_cut;
        remove(i);
        return true;
    }

    const Line<T>& line_;
    const Parameters& parameters_;
    Approximation& r_;
};

}  // namespace

bool intersection(const Curve& f, const Curve& g, double near, double& x) {
    // f - g = c + b t + a t^2 with t = x - near; the root of smaller magnitude, without cancellation.
    const double c = f.value(near) - g.value(near), b = f.slope(near) - g.slope(near), a = f.c2 - g.c2;
    const double discriminant = b * b - 4 * a * c;
    if (!(discriminant >= 0)) return false;
    const double denominator = std::abs(b) + std::sqrt(discriminant);
    if (!(denominator > 0)) return false;
    x = near - (b < 0 ? -2 : 2) * c / denominator;
    return std::isfinite(x);
}

template <class T>
void approximate(const Line<T>& line, const Parameters& parameters, Approximation& result) {
    Approximator<T> approximator(line, parameters, result);
    approximator.split();
    if (parameters.interpolate) {
        approximator.interpolate();
        return;
    }
    approximator.fit();
    if (parameters.merge_significance > 0) approximator.join();
}

template void approximate(const Line<float>&, const Parameters&, Approximation&);
template void approximate(const Line<double>&, const Parameters&, Approximation&);

}  // namespace rangeedge
