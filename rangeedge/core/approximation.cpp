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

template <class T>
Projections projections_of(const T* y, int n) {
    // The base is one of the samples, and a number of their type.
    const double base = static_cast<double>(y[n / 2]), centre = (n - 1) / 2.0;
    const Sums s = sums_of(y, n, base);
    Projections p;
    p.n = n;
    const double mean = s.h / n;
    p.mean = base + mean;
    p.squares = std::max(0.0, s.hh - s.h * mean);
    p.y1 = s.ht - centre * s.h;
    p.y2 = s.htt - 2 * centre * s.ht + (centre * centre - Projections::beta(n)) * s.h;
    return p;
}

// Joins the segments of one line.
template <class T, class Sums>
class Joiner {
public:
    Joiner(const Line<T>& line, const Parameters& parameters, std::vector<Piece<Sums>>& pieces, std::vector<Join>& cheap)
        : line_(line), limit_(parameters.merge_significance * parameters.merge_significance), pieces_(pieces),
          cheap_(cheap) {}

    void add(const Segment& s) {
        const int i = static_cast<int>(pieces_.size());
        const Sums sums = sums_over(s);
        pieces_.push_back({s, i - 1, i + 1, sums, least(s), residual_squares(sums, least(s)), HUGE_VAL});
    }

    void join() {
        const auto count = pieces_.size();
        if (count > 0) pieces_.back().next = none;
        if (!(limit_ > 0)) return;
        if (count > 1) merge();
        if (count > 2) dissolve();
    }

    void take(Approximation& result) const {
        for (int i = pieces_.empty() ? none : 0; i != none; i = at(i).next) {
            result.segments.push_back(at(i).segment);
            result.curves.push_back(curve(i));
        }
    }

private:
    Piece<Sums>& at(int i) { return pieces_[static_cast<std::size_t>(i)]; }
    const Piece<Sums>& at(int i) const { return pieces_[static_cast<std::size_t>(i)]; }

    void remove(int i) {
        at(at(i).previous).next = at(i).next;
        if (at(i).next != none) at(at(i).next).previous = at(i).previous;
    }

    // Takes back cuts, the least significant first, until each one left lowers the sum of squares enough.
    void merge() {
        for (int i = 0; i != none; i = at(i).next) price(i);
        while (!cheap_.empty()) {
            const Join cheapest = cheap_.front();
            std::pop_heap(cheap_.begin(), cheap_.end());
            cheap_.pop_back();
            Piece<Sums>& piece = at(cheapest.left);
            if (piece.cost != cheapest.cost) continue;  // it has changed since
            Piece<Sums>& right = at(piece.next);
            piece.sums = joined(piece.sums, right.sums);
            piece.segment.last = right.segment.last;
            piece.least = least(piece.segment);
            piece.squares = residual_squares(piece.sums, piece.least);
            right.cost = HUGE_VAL;
            remove(piece.next);
            price(cheapest.left);
            if (piece.previous != none) price(piece.previous);
        }
    }

    void price(int i) {
        Piece<Sums>& piece = at(i);
        piece.cost = cost_of_merging(piece);
        if (!(piece.cost < limit_)) return;
        cheap_.push_back({piece.cost, i});
        std::push_heap(cheap_.begin(), cheap_.end());
    }

    double cost_of_merging(const Piece<Sums>& piece) const {
        if (piece.next == none) return HUGE_VAL;
        const Piece<Sums>& right = at(piece.next);
        if (!adjacent(piece, right)) return HUGE_VAL;
        const double sigma = line_.sigma_at(piece.segment.last);
        const double one = residual_squares(joined(piece.sums, right.sums), curved_significance * sigma);
        return (one - piece.squares - right.squares) / (sigma * sigma);
    }

    // Splitting may leave a segment across an edge, its rounding included, where one cut would do. It is taken out
    // where the curves beside it meet within it and, given its samples, explain them nearly as well.
    void dissolve() {
        for (int i = at(0).next; i != none && at(i).next != none;) {
            const int before = at(i).previous, after = at(i).next;
            i = !dissolved(i) || at(before).previous == none ? after : before;
        }
    }

    bool dissolved(int i) {
        const Segment s = at(i).segment;
        Piece<Sums>&before = at(at(i).previous), &after = at(at(i).next);
        if (!adjacent(before, at(i)) || !adjacent(at(i), after)) return false;
        double x = 0;
        const double middle = (line_.abscissa(s.first) + line_.abscissa(s.last)) / 2;
        if (!intersection(curve(at(i).previous), curve(at(i).next), middle, x)) return false;
        if (x < line_.abscissa(s.first - 1) || x > line_.abscissa(s.last + 1)) return false;
        int cut = s.first - 1;
        while (cut < s.last && line_.abscissa(cut + 1) <= x) ++cut;
        Sums left = before.sums, right = after.sums;
        if (cut >= s.first) left = joined(left, sums_over({s.first, cut}));
        if (cut < s.last) right = joined(sums_over({cut + 1, s.last}), right);
        const double sigma = sigma_of(s), least = curved_significance * sigma;
        const double to_cut = residual_squares(left, least), from_cut = residual_squares(right, least);
        const double cost = to_cut + from_cut - (before.squares + at(i).squares + after.squares);
        if (!(cost < straddling * straddling * limit_ * sigma * sigma)) return false;
        before.segment.last = cut;
        after.segment.first = cut + 1;
        before.sums = left, after.sums = right;
        before.least = after.least = least;
        before.squares = to_cut, after.squares = from_cut;
        remove(i);
        return true;
    }

    bool adjacent(const Piece<Sums>& left, const Piece<Sums>& right) const {
        const int last = left.segment.last;
        return last + 1 == right.segment.first && line_.abscissa(last) < line_.abscissa(last + 1);
    }

    Sums sums_over(const Segment& s) const {
        if constexpr (std::is_same_v<Sums, Projections>) {
            return projections_of(line_.y + s.first, s.size());
        } else {
            Moments moments;
            moments.origin = line_.abscissa(s.first + (s.last - s.first) / 2);
            moments.base = line_.ordinate(s.first + (s.last - s.first) / 2);
            for (int k = s.first; k <= s.last; ++k) moments.add(line_.abscissa(k), line_.ordinate(k));
            return moments;
        }
    }

    Curve curve(int i) const {
        const Piece<Sums>& piece = at(i);
        if constexpr (std::is_same_v<Sums, Projections>)
            return fit_least_squares(piece.sums, piece.segment.first, piece.least);
        else
            return fit_least_squares(piece.sums, piece.least);
    }

    double sigma_of(const Segment& s) const { return line_.sigma_at(s.first + s.size() / 2); }
    double least(const Segment& s) const { return curved_significance * sigma_of(s); }

    const Line<T>& line_;
    double limit_;
    std::vector<Piece<Sums>>& pieces_;
    std::vector<Join>& cheap_;
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
const Approximation& Approximator<T>::approximate(const Line<T>& line) {
    result_.segments.clear();
    result_.curves.clear();
    split(line);
    if (parameters_.interpolate)
        interpolate(line);
    else if (line.x)
        fit(line, uneven_);
    else
        fit(line, even_);
    return result_;
}

template <class T>
void Approximator<T>::split(const Line<T>& line) {
    for_each_run(line.y, line.x, line.path.size, [&](int first, int last) {
        split_run(Run<T>{line.y, line.x, line.scale, first, last}, static_cast<T>(line.tolerance), pending_,
                  result_.segments);
    });
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
template <class Sums>
void Approximator<T>::fit(const Line<T>& line, std::vector<Piece<Sums>>& pieces) {
    pieces.clear();
    Joiner<T, Sums> joiner(line, parameters_, pieces, cheap_);
    for (const Segment& s : result_.segments) joiner.add(s);
    joiner.join();
    result_.segments.clear();
    joiner.take(result_);
}

template class Approximator<float>;
template class Approximator<double>;

}  // namespace rangeedge
