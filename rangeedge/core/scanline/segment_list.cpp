// SPDX-License-Identifier: Apache-2.0
#include "scanline/segment_list.hpp"

#include <algorithm>
#include <cmath>

#include "base/simd.hpp"

namespace rangeedge {
namespace {

// A count rounded up to as many numbers as are computed side by side.
std::ptrdiff_t in_lanes(std::ptrdiff_t count) { return (count + 7) / 8 * 8; }

// Of n >= 1 samples.
template <class T>
RawSums raw_sums(const T* y, int n, double base) {
    RawSums s{};
    for (int k = 0; k < n; ++k) {
        const double h = static_cast<double>(y[k]) - base, ht = h * k;
        s.h += h, s.ht += ht, s.htt += ht * k, s.hh += h * h;
    }
    return s;
}

template <int bytes>
RANGEEDGE_INLINE RawSums raw_sums_in(const float* y, int n, double base) {
    using D = Doubles<bytes>;
    const D bases = D::all(base), step = D::all(D::count);
    D h0 = D::all(0), h1 = h0, h2 = h0, hh = h0, t = D::from(0);
    for (int k = 0; k < n; k += D::count) {
        const D h = keep_first(load_doubles<bytes>(y + k) - bases, n - k), ht = h * t;
        h0 += h, h1 += ht, h2 += ht * t, hh += h * h;
        t += step;
    }
    return {h0.sum(), h1.sum(), h2.sum(), hh.sum()};
}
RANGEEDGE_VERSIONS(RawSums, raw_sums, (const float* y, int n, double base), (y, n, base))

// Each of `count` segments gets its orthogonal sums in place of the raw ones, and the squares of its residuals.
RANGEEDGE_WIDE
void orthogonalise(std::ptrdiff_t count, const double* n, const double* base, const double* least, double* h_mean,
                   double* ht_y1, double* htt_y2, double* hh_squares, double* residual) {
    RANGEEDGE_INDEPENDENT
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        const OrthogonalSums p = orthogonal(n[i], base[i], {h_mean[i], ht_y1[i], htt_y2[i], hh_squares[i]});
        h_mean[i] = p.mean, ht_y1[i] = p.y1, htt_y2[i] = p.y2, hh_squares[i] = p.squares;
        residual[i] = residual_squares(p, least[i]);
    }
}

// Columns of numbers, one a segment.
struct Columns {
    const double *n, *mean, *y1, *y2, *squares, *residual;
    OrthogonalSums operator[](std::ptrdiff_t i) const { return {n[i], mean[i], y1[i], y2[i], squares[i]}; }
};

// What it costs to join each segment on the left with that on the right, whose common border is off by sigma and waves.
RANGEEDGE_WIDE
void compute_costs(std::ptrdiff_t count, const Columns left, const Columns right, const double* sigma,
                   const double* waves, const FitNoise& noise, double* cost) {
    RANGEEDGE_INDEPENDENT
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        const int n = static_cast<int>(left.n[i]), m = static_cast<int>(right.n[i]);
        const SampleNoise own{sigma[i], waves[i]};
        const double joint = residual_squares(left[i] + right[i], least_quadratic(own, n + m, noise.slope));
        cost[i] = cost_of_joining(joint, left.residual[i], right.residual[i], own, n, m, noise.join);
    }
}

}  // namespace

template <class T>
void SegmentList::fill(const std::vector<Line<T>>& lines, const StripSegments& found) {
    const std::ptrdiff_t count = found.segments.size();
    links.resize(count + 1);
    links[count] = {{}, 0, static_cast<int>(count) - 1, 0, false};
    noise_ = lines.front().noise;
    for (auto* numbers : {&sigma, &waves, &least, &residual, &cost}) {
        numbers->resize(in_lanes(count + 1) + 1);
        std::fill(numbers->begin() + count, numbers->end(), 0.0);
    }
    cost[count] = HUGE_VAL;
    int own = 0;
    for (int i = 0; i < static_cast<int>(lines.size()); ++i) {
        const Line<T>& line = lines[static_cast<std::size_t>(i)];
        for (const std::ptrdiff_t last = found.starts[i + 1]; own < last; ++own) {
            const Segment s = found.segments[own];
            const bool adjacent = own + 1 < last && s.last + 1 == found.segments[own + 1].first &&
                                  line.abscissa(s.last) < line.abscissa(s.last + 1);
            links[own] = {s, i, own > 0 ? own - 1 : end(), own + 1, false};
            const SampleNoise border = adjacent ? line.noise_between(s.last, s.last + 1) : SampleNoise{0, 0};
            sigma[own] = border.sigma, waves[own] = border.waves;
            least[own] = least_quadratic(line.noise_of(s), s.size(), line.noise->slope);
        }
    }
}

void SegmentList::collect(StripSegments& found) const {
    const std::ptrdiff_t lines = found.starts.size() - 1;
    found.segments.clear();
    found.starts.assign(1, 0);
    for (int i = 0; i != end(); i = links[i].next) {
        found.starts.resize(links[i].line + 1, found.segments.size());
        found.curves[found.segments.size()] = found.curves[i];
        found.segments.push_back(links[i].segment);
    }
    found.starts.resize(lines + 1, found.segments.size());
}

template <class T>
OrthogonalSums EvenSegments::sums_over(const Line<T>& line, const Segment& s) {
    const double base = line.ordinate(s.reference());
    return orthogonal(s.size(), base, raw_sums(line.y + s.first, s.size(), base));
}

template <class T>
void EvenSegments::sum_up(const std::vector<Line<T>>& lines) {
    for (auto& numbers : sums_) numbers.resize(cost.size());
    base_.resize(cost.size());
    for (int k = 0; k < end(); ++k) {
        const Segment& s = links[k].segment;
        const Line<T>& line = lines[static_cast<std::size_t>(links[k].line)];
        base_[k] = line.ordinate(s.reference());
        const RawSums raw = raw_sums(line.y + s.first, s.size(), base_[k]);
        sums_[n][k] = s.size();
        sums_[mean][k] = raw.h, sums_[y1][k] = raw.ht, sums_[y2][k] = raw.htt, sums_[squares][k] = raw.hh;
    }
    orthogonalise(in_lanes(links.size()), column(n), base_.data(), least.data(), column(mean), column(y1), column(y2),
                  column(squares), residual.data());
}

void EvenSegments::update_all_costs() {
    const Columns left{column(n), column(mean), column(y1), column(y2), column(squares), residual.data()};
    const Columns right{left.n + 1, left.mean + 1, left.y1 + 1, left.y2 + 1, left.squares + 1, left.residual + 1};
    compute_costs(in_lanes(links.size()), left, right, sigma.data(), waves.data(), noise(), cost.data());
}

// Gathered first, to be computed side by side: six numbers of each segment on the left, of each one on the right,
// sigma and waves, and then the cost.
void EvenSegments::update_costs(const Array<int>& cuts) {
    constexpr int numbers = columns + 1;
    const std::ptrdiff_t count = in_lanes(cuts.size());
    gathered_.resize((2 * numbers + 3) * count);
    const auto part = [&](int i) { return gathered_.data() + i * count; };
    for (std::ptrdiff_t k = 0; k < cuts.size(); ++k) {
        const int pair[2] = {cuts[k], links[cuts[k]].next};
        for (int side = 0; side < 2; ++side) {
            for (int c = 0; c < columns; ++c) part(side * numbers + c)[k] = sums_[c][pair[side]];
            part(side * numbers + columns)[k] = residual[pair[side]];
        }
        part(2 * numbers)[k] = sigma[cuts[k]];
        part(2 * numbers + 1)[k] = waves[cuts[k]];
    }
    // What fills up the last lanes has no samples: left from before, it could be beyond any number of them.
    for (std::ptrdiff_t k = cuts.size(); k < count; ++k) part(0)[k] = part(numbers)[k] = 0;
    const auto side = [&](int i) {
        return Columns{part(i), part(i + 1), part(i + 2), part(i + 3), part(i + 4), part(i + 5)};
    };
    double* const costs = part(2 * numbers + 2);
    compute_costs(count, side(0), side(numbers), part(2 * numbers), part(2 * numbers + 1), noise(), costs);
    for (std::ptrdiff_t k = 0; k < cuts.size(); ++k) cost[cuts[k]] = costs[k];
}

void EvenSegments::fit(Array<Curve>& curves) const {
    curves.resize(end());
    for (int i = 0; i != end(); i = links[i].next) curves[i] = curve(i);
}

template <class T>
PowerSums UnevenSegments::sums_over(const Line<T>& line, const Segment& s) {
    PowerSums sums;
    sums.origin = line.abscissa(s.reference());
    sums.base = line.ordinate(s.reference());
    for (int k = s.first; k <= s.last; ++k) sums.add(line.abscissa(k), line.ordinate(k));
    return sums;
}

template <class T>
void UnevenSegments::sum_up(const std::vector<Line<T>>& lines) {
    sums_.resize(links.size());
    for (int k = 0; k < end(); ++k) {
        sums_[k] = sums_over(lines[static_cast<std::size_t>(links[k].line)], links[k].segment);
        residual[k] = residual_squares(sums_[k], least[k]);
    }
}

void UnevenSegments::update_all_costs() {
    for (int k = 0; k <= end(); ++k) update_cost(k);
}

void UnevenSegments::update_costs(const Array<int>& cuts) {
    for (const int i : cuts) update_cost(i);
}

void UnevenSegments::update_cost(int i) {
    cost[i] = HUGE_VAL;
    if (!(sigma[i] > 0)) return;
    const int right = links[i].next;
    const SampleNoise border{sigma[i], waves[i]};
    const int n = links[i].segment.size(), m = links[right].segment.size();
    const double joint = residual_squares(sums_[i] + sums_[right], least_quadratic(border, n + m, noise().slope));
    cost[i] = cost_of_joining(joint, residual[i], residual[right], border, n, m, noise().join);
}

void UnevenSegments::fit(Array<Curve>& curves) const {
    curves.resize(end());
    for (int i = 0; i != end(); i = links[i].next) curves[i] = curve(i);
}

#define RANGEEDGE_INSTANTIATE(T)                                                        \
    template void SegmentList::fill(const std::vector<Line<T>>&, const StripSegments&); \
    template OrthogonalSums EvenSegments::sums_over(const Line<T>&, const Segment&);    \
    template void EvenSegments::sum_up(const std::vector<Line<T>>&);                    \
    template PowerSums UnevenSegments::sums_over(const Line<T>&, const Segment&);       \
    template void UnevenSegments::sum_up(const std::vector<Line<T>>&);
RANGEEDGE_INSTANTIATE(float)
RANGEEDGE_INSTANTIATE(double)

}  // namespace rangeedge
