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

    // Takes back cuts, the least significant first, until each one left lowers the sum of squares enough.
    void merge() {
        const double limit = parameters_.merge_significance * parameters_.merge_significance;
        if (r_.segments.size() < 2) return;
        r_.costs.resize(r_.segments.size() - 1);
        for (std::size_t i = 0; i < r_.costs.size(); ++i) r_.costs[i] = cost_of_merging(i);
        while (!r_.costs.empty()) {
            const auto least = std::min_element(r_.costs.begin(), r_.costs.end());
            if (!(*least < limit)) break;
            const auto i = static_cast<std::size_t>(least - r_.costs.begin());
            r_.moments[i] = joined(r_.moments[i], r_.moments[i + 1]);
            r_.segments[i].last = r_.segments[i + 1].last;
            r_.curves[i] = fit_least_squares(r_.moments[i], sigma(r_.segments[i]), curved_significance);
            erase(i + 1);
            r_.costs.erase(least);
            if (i < r_.costs.size()) r_.costs[i] = cost_of_merging(i);
            if (i > 0) r_.costs[i - 1] = cost_of_merging(i - 1);
        }
    }

    // Splitting may leave a segment across an edge, its rounding included, where one cut would do. It is taken out
    // where the curves beside it meet within it and, given its samples, explain them nearly as well.
    void dissolve() {
        for (std::size_t i = 1; i + 1 < r_.segments.size();) {
            if (dissolved(i))
                i = std::max<std::size_t>(1, i - 1);
            else
                ++i;
        }
    }

private:
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

    void erase(std::size_t i) {
        const auto at = static_cast<std::ptrdiff_t>(i);
        r_.segments.erase(r_.segments.begin() + at);
        r_.curves.erase(r_.curves.begin() + at);
        r_.moments.erase(r_.moments.begin() + at);
    }

    bool adjacent(std::size_t i) const {
        const int last = r_.segments[i].last;
        return last + 1 == r_.segments[i + 1].first && line_.abscissa(last) < line_.abscissa(last + 1);
    }

    double cost_of_merging(std::size_t i) const {
        if (!adjacent(i)) return HUGE_VAL;
        const double s = line_.sigma_at(r_.segments[i].last);
        const Curve one = fit_least_squares(joined(r_.moments[i], r_.moments[i + 1]), s, curved_significance);
        return (one.sum_squares - r_.curves[i].sum_squares - r_.curves[i + 1].sum_squares) / (s * s);
    }

    bool dissolved(std::size_t i) {
        if (!adjacent(i - 1) || !adjacent(i)) return false;
        const Segment s = r_.segments[i];
        const Curve &f = r_.curves[i - 1], &g = r_.curves[i + 1];
        double x = 0;
        if (!intersection(f, g, (line_.abscissa(s.first) + line_.abscissa(s.last)) / 2, x)) return false;
        if (x < line_.abscissa(s.first - 1) || x > line_.abscissa(s.last + 1)) return false;
        int cut = s.first - 1;
        Moments left = r_.moments[i - 1], right = r_.moments[i + 1];
        for (int k = s.first; k <= s.last; ++k) {
            if (line_.abscissa(k) <= x) cut = k;
            add(k == cut ? left : right, k);
        }
        const double v = sigma(s);
        const Curve to_cut = fit_least_squares(left, v, curved_significance);
        const Curve from_cut = fit_least_squares(right, v, curved_significance);
        const double before = f.sum_squares + r_.curves[i].sum_squares + g.sum_squares;
        const double limit = straddling * parameters_.merge_significance * v;
        if (!(to_cut.sum_squares + from_cut.sum_squares - before < limit * limit)) return false;
        r_.segments[i - 1].last = cut;
        r_.segments[i + 1].first = cut + 1;
        r_.moments[i - 1] = left, r_.moments[i + 1] = right;
        r_.curves[i - 1] = to_cut, r_.curves[i + 1] = from_cut;
        erase(i);
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
    if (!(parameters.merge_significance > 0)) return;
    approximator.merge();
    approximator.dissolve();
}

template void approximate(const Line<float>&, const Parameters&, Approximation&);
template void approximate(const Line<double>&, const Parameters&, Approximation&);

}  // namespace rangeedge
