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
constexpr int none = -1;
constexpr std::size_t lanes = 8;  // of doubles

// Sums of n >= 1 samples one unit apart, h = y - base, t counted from the first one.
struct Sums {
    double h, ht, htt, hh;
};

template <class T>
Sums sums_of(const T* y, int n, double base) {
    Sums s{};
    for (int k = 0; k < n; ++k) {
        const double h = static_cast<double>(y[k]) - base, ht = h * k;
        s.h += h, s.ht += ht, s.htt += ht * k, s.hh += h * h;
    }
    return s;
}

template <int bytes>
RANGEEDGE_INLINE Sums sums_of_in(const float* y, int n, double base) {
    using D = Doubles<bytes>;
    const D bases = D::all(base), step = D::all(D::count);
    D h0 = D::all(0), h1 = h0, h2 = h0, hh = h0, t = D::from(0);
    for (int k = 0; k < n; k += D::count) {
        const D h = first_lanes(load_doubles<bytes>(y + k) - bases, n - k), ht = h * t;
        h0 += h, h1 += ht, h2 += ht * t, hh += h * h;
        t += step;
    }
    return {h0.sum(), h1.sum(), h2.sum(), hh.sum()};
}
RANGEEDGE_VERSIONS(Sums, sums_of, (const float* y, int n, double base), (y, n, base))

// Counted from the centre of the n samples.
inline Projections projections_of(double n, double base, const Sums& s) {
    const double centre = (n - 1) / 2, mean = s.h / n;
    Projections p;
    p.n = n;
    p.mean = base + mean;
    p.y1 = s.ht - centre * s.h;
    p.y2 = s.htt - 2 * centre * s.ht + (centre * centre - Projections::beta(n)) * s.h;
    p.squares = std::max(0.0, s.hh - s.h * mean);
    return p;
}

int middle(const Segment& s) { return s.first + s.size() / 2; }

double cost_of(double residual, double left, double right, double sigma) {
    return sigma > 0 ? (residual - left - right) / (sigma * sigma) : HUGE_VAL;
}

// The i-th of `count` segments gets its projections, in place of its sums, and the squares of its residuals.
RANGEEDGE_WIDE
void project(std::size_t count, const double* n, const double* base, const double* least, double* h, double* ht,
             double* htt, double* hh, double* residual) {
    // One after the other: mean, y1, y2, squares.
#pragma GCC ivdep
    for (std::size_t i = 0; i < count; ++i) {
        const Projections p = projections_of(n[i], base[i], {h[i], ht[i], htt[i], hh[i]});
        h[i] = p.mean, ht[i] = p.y1, htt[i] = p.y2, hh[i] = p.squares;
        residual[i] = residual_squares(p, least[i]);
    }
}

// What it costs to join the i-th segment with the next one.
RANGEEDGE_WIDE
void price_all(std::size_t count, const double* n, const double* mean, const double* y1, const double* y2,
               const double* squares, const double* residual, const double* sigma, double* cost) {
#pragma GCC ivdep
    for (std::size_t i = 0; i < count; ++i) {
        const Projections a{n[i], mean[i], y1[i], y2[i], squares[i]};
        const Projections b{n[i + 1], mean[i + 1], y1[i + 1], y2[i + 1], squares[i + 1]};
        const double one = residual_squares(joined(a, b), curved_significance * sigma[i]);
        cost[i] = cost_of(one, residual[i], residual[i + 1], sigma[i]);
    }
}

// Joins the segments of one line.
template <class T, class P>
class Joiner {
public:
    Joiner(const Line<T>& line, const Parameters& parameters, P& pieces, std::vector<Join>& cheap)
        : line_(line), limit_(parameters.merge_significance * parameters.merge_significance), pieces_(pieces),
          cheap_(cheap) {}

    // Takes back cuts, the least significant first, until each one left lowers the sum of squares enough.
    void merge() {
        pieces_.price();
        for (int i = 0; i != none; i = next(i)) offer(i);
        while (!cheap_.empty()) {
            const Join cheapest = cheap_.front();
            std::pop_heap(cheap_.begin(), cheap_.end());
            cheap_.pop_back();
            const int i = cheapest.left, right = next(i);
            if (cost(i) != cheapest.cost) continue;  // it has changed since
            const auto sums = joined(pieces_.sums(i), pieces_.sums(right));
            segment(i).last = segment(right).last;
            sigma(i) = sigma(right);
            take(i, sums, sigma_of(segment(i)));
            cost(right) = HUGE_VAL;
            remove(right);
            price(i);
            if (previous(i) != none) price(previous(i));
        }
    }

    // Splitting may leave a segment across an edge, its rounding included, where one cut would do. It is taken out
    // where the curves beside it meet within it and, given its samples, explain them nearly as well.
    void dissolve() {
        for (int i = next(0); i != none && next(i) != none;) {
            const int before = previous(i), after = next(i);
            i = !dissolved(i) || previous(before) == none ? after : before;
        }
    }

private:
    typename P::Link& link(int i) { return pieces_.links[static_cast<std::size_t>(i)]; }
    int& previous(int i) { return link(i).previous; }
    int& next(int i) { return link(i).next; }
    Segment& segment(int i) { return link(i).segment; }
    double& sigma(int i) { return pieces_.sigma[static_cast<std::size_t>(i)]; }
    double& residual(int i) { return pieces_.residual[static_cast<std::size_t>(i)]; }
    double& cost(int i) { return pieces_.cost[static_cast<std::size_t>(i)]; }

    template <class Sums>
    void take(int i, const Sums& sums, double sigma) {
        const double least = curved_significance * sigma;
        pieces_.set_sums(i, sums);
        pieces_.least[static_cast<std::size_t>(i)] = least;
        residual(i) = residual_squares(sums, least);
    }

    void remove(int i) {
        next(previous(i)) = next(i);
        if (next(i) != none) previous(next(i)) = previous(i);
    }

    void price(int i) {
        const int right = next(i);
        cost(i) = HUGE_VAL;
        if (right == none || !(sigma(i) > 0)) return;
        const double one = residual_squares(joined(pieces_.sums(i), pieces_.sums(right)), curved_significance * sigma(i));
        cost(i) = cost_of(one, residual(i), residual(right), sigma(i));
        offer(i);
    }

    void offer(int i) {
        if (!(cost(i) < limit_)) return;
        cheap_.push_back({cost(i), i});
        std::push_heap(cheap_.begin(), cheap_.end());
    }

    bool dissolved(int i) {
        const Segment s = segment(i);
        const int before = previous(i), after = next(i);
        if (!(sigma(before) > 0 && sigma(i) > 0)) return false;  // not adjacent
        double x = 0;
        const double middle = (line_.abscissa(s.first) + line_.abscissa(s.last)) / 2;
        if (!intersection(pieces_.curve(before), pieces_.curve(after), middle, x)) return false;
        if (x < line_.abscissa(s.first - 1) || x > line_.abscissa(s.last + 1)) return false;
        int cut = s.first - 1;
        while (cut < s.last && line_.abscissa(cut + 1) <= x) ++cut;
        auto left = pieces_.sums(before), right = pieces_.sums(after);
        if (cut >= s.first) left = joined(left, P::sums_over(line_, {s.first, cut}));
        if (cut < s.last) right = joined(P::sums_over(line_, {cut + 1, s.last}), right);
        const double v = sigma_of(s), least = curved_significance * v;
        const double cost = residual_squares(left, least) + residual_squares(right, least) -
                            (residual(before) + residual(i) + residual(after));
        if (!(cost < straddling * straddling * limit_ * v * v)) return false;
        segment(before).last = cut;
        segment(after).first = cut + 1;
        take(before, left, v);
        take(after, right, v);
        remove(i);
        return true;
    }

    double sigma_of(const Segment& s) const { return line_.sigma_at(middle(s)); }

    const Line<T>& line_;
    double limit_;
    P& pieces_;
    std::vector<Join>& cheap_;
};

}  // namespace

Projections EvenPieces::sums(int i) const {
    const auto k = static_cast<std::size_t>(i);
    return {n_[k], mean_[k], y1_[k], y2_[k], squares_[k]};
}

void EvenPieces::set_sums(int i, const Projections& p) {
    const auto k = static_cast<std::size_t>(i);
    n_[k] = p.n, mean_[k] = p.mean, y1_[k] = p.y1, y2_[k] = p.y2, squares_[k] = p.squares;
}

template <class T>
Projections EvenPieces::sums_over(const Line<T>& line, const Segment& s) {
    const double base = line.ordinate(middle(s));
    return projections_of(s.size(), base, sums_of(line.y + s.first, s.size(), base));
}

template <class T>
void EvenPieces::fit(const Line<T>& line) {
    for (auto* numbers : {&n_, &base_, &mean_, &y1_, &y2_, &squares_}) numbers->resize(cost.size());
    for (std::size_t k = 0; k < links.size(); ++k) {
        const Segment& s = links[k].segment;
        n_[k] = s.size();
        base_[k] = line.ordinate(middle(s));
        const Sums sums = sums_of(line.y + s.first, s.size(), base_[k]);
        mean_[k] = sums.h, y1_[k] = sums.ht, y2_[k] = sums.htt, squares_[k] = sums.hh;
    }
    project(cost.size() - 1, n_.data(), base_.data(), least.data(), mean_.data(), y1_.data(), y2_.data(), squares_.data(),
            residual.data());
}

void EvenPieces::price() {
    price_all(cost.size() - 1, n_.data(), mean_.data(), y1_.data(), y2_.data(), squares_.data(), residual.data(),
              sigma.data(), cost.data());
}

Curve EvenPieces::curve(int i) const {
    const auto k = static_cast<std::size_t>(i);
    return fit_least_squares(sums(i), links[k].segment.first, least[k]);
}

template <class T>
Moments UnevenPieces::sums_over(const Line<T>& line, const Segment& s) {
    Moments moments;
    moments.origin = line.abscissa(middle(s));
    moments.base = line.ordinate(middle(s));
    for (int k = s.first; k <= s.last; ++k) moments.add(line.abscissa(k), line.ordinate(k));
    return moments;
}

template <class T>
void UnevenPieces::fit(const Line<T>& line) {
    sums_.resize(links.size());
    for (std::size_t k = 0; k < links.size(); ++k) {
        sums_[k] = sums_over(line, links[k].segment);
        residual[k] = residual_squares(sums_[k], least[k]);
    }
}

void UnevenPieces::price() {
    for (std::size_t k = 0; k < links.size(); ++k) {
        cost[k] = HUGE_VAL;
        if (!(sigma[k] > 0)) continue;
        const double one = residual_squares(joined(sums_[k], sums_[k + 1]), curved_significance * sigma[k]);
        cost[k] = cost_of(one, residual[k], residual[k + 1], sigma[k]);
    }
}

Curve UnevenPieces::curve(int i) const {
    return fit_least_squares(sums(i), least[static_cast<std::size_t>(i)]);
}

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
void Approximator<T>::split(const Strip<T>& strip) {
    splitter_.clear();
    for (const Line<T>& line : strip.lines)
        splitter_.add({line.y, line.x, line.scale, line.path.size, static_cast<T>(line.tolerance)});
    splitter_.split();
}

template <class T>
const Approximation& Approximator<T>::approximate(const Strip<T>& strip, std::size_t i) {
    const Line<T>& line = strip.lines[i];
    result_.segments.clear();
    result_.curves.clear();
    splitter_.for_each_segment(i, [&](const Segment& s) { result_.segments.push_back(s); });
    if (parameters_.interpolate)
        interpolate(line);
    else if (line.x)
        fit(line, uneven_);
    else
        fit(line, even_);
    return result_;
}

template <class T>
void Approximator<T>::interpolate(const Line<T>& line) {
    for (const Segment& s : result_.segments) {
        const int middle = s.first + (s.last - s.first) / 2;
        Moments moments;
        moments.origin = line.abscissa(middle);
        moments.base = line.ordinate(middle);
        int added = s.first - 1;
        for (const int k : {s.first, middle, s.last}) {
            if (k > added) moments.add(line.abscissa(k), line.ordinate(k));
            added = k;
        }
        result_.curves.push_back(fit_interpolating(moments));
    }
}

template <class T>
template <class P>
void Approximator<T>::fit(const Line<T>& line, P& pieces) {
    const int count = static_cast<int>(result_.segments.size());
    if (count == 0) return;
    pieces.resize(result_.segments.size(), result_.segments.size() / lanes * lanes + lanes + 1);
    for (int i = 0; i < count; ++i) {
        const Segment& s = result_.segments[static_cast<std::size_t>(i)];
        const bool last = i + 1 == count;
        const bool adjacent = !last && s.last + 1 == result_.segments[static_cast<std::size_t>(i) + 1].first &&
                              line.abscissa(s.last) < line.abscissa(s.last + 1);
        pieces.links[static_cast<std::size_t>(i)] = {s, i - 1, last ? none : i + 1};
        pieces.sigma[static_cast<std::size_t>(i)] = adjacent ? line.sigma_at(s.last) : 0;
        pieces.least[static_cast<std::size_t>(i)] = curved_significance * line.sigma_at(middle(s));
    }
    pieces.fit(line);
    if (parameters_.merge_significance > 0) {
        Joiner<T, P> joiner(line, parameters_, pieces, cheap_);
        joiner.merge();
        joiner.dissolve();
    }
    result_.segments.clear();
    for (int i = 0; i != none; i = pieces.links[static_cast<std::size_t>(i)].next) {
        result_.segments.push_back(pieces.links[static_cast<std::size_t>(i)].segment);
        result_.curves.push_back(pieces.curve(i));
    }
}

template class Approximator<float>;
template class Approximator<double>;

}  // namespace rangeedge
