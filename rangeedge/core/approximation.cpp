// SPDX-License-Identifier: Apache-2.0
#include "approximation.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "simd.hpp"

namespace rangeedge {
namespace {

constexpr double curved_significance = 5;  // of the quadratic term of a least-squares fit
constexpr double tie = 1e-6;                // of a cost, a sample
constexpr double straddling = 2;           // how much more, in significance, a segment across an edge may cost

// As many numbers, or a few more, as are computed side by side.
std::size_t in_lanes(std::size_t count) { return (count + 7) / 8 * 8; }

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

template <class T>
Samples<T> samples_of(const Line<T>& line) {
    return {line.y, line.x, line.scale, line.path.size, static_cast<T>(line.tolerance)};
}

// Of the noise in the middle of a segment.
template <class T>
double sigma_in(const Line<T>& line, const Segment& s) {
    const int half = (s.size() - 1) / 2;
    return (line.sigma_at(s.first + half) + line.sigma_at(s.last - half)) / 2;
}

// Of joining two segments, with n samples together: of equal costs, rounding included, that of fewer samples is lower.
double cost_of(double residual, double left, double right, double sigma, double n) {
    const double cost = (residual - left - right) / (sigma * sigma) + tie * n;
    return sigma > 0 && cost == cost ? cost : HUGE_VAL;
}

// Each of `count` segments gets its projections in place of its sums, and the squares of its residuals.
RANGEEDGE_WIDE
void project(std::size_t count, const double* n, const double* base, const double* least, double* h_mean, double* ht_y1,
             double* htt_y2, double* hh_squares, double* residual) {
    RANGEEDGE_INDEPENDENT
    for (std::size_t i = 0; i < count; ++i) {
        const Projections p = projections_of(n[i], base[i], {h_mean[i], ht_y1[i], htt_y2[i], hh_squares[i]});
        h_mean[i] = p.mean, ht_y1[i] = p.y1, htt_y2[i] = p.y2, hh_squares[i] = p.squares;
        residual[i] = residual_squares(p, least[i]);
    }
}

// Columns of numbers, one a segment.
struct Columns {
    const double *n, *mean, *y1, *y2, *squares, *residual;
    Projections operator[](std::size_t i) const { return {n[i], mean[i], y1[i], y2[i], squares[i]}; }
};

// What it costs to join each one on the left with that on the right.
RANGEEDGE_WIDE
void cost_all(std::size_t count, const Columns left, const Columns right, const double* sigma, double* cost) {
    RANGEEDGE_INDEPENDENT
    for (std::size_t i = 0; i < count; ++i) {
        const double one = residual_squares(joined(left[i], right[i]), curved_significance * sigma[i]);
        cost[i] = cost_of(one, left.residual[i], right.residual[i], sigma[i], left.n[i] + right.n[i]);
    }
}

// Joins segments.
template <class T, class P>
class Joiner {
public:
    Joiner(const std::vector<Line<T>>& lines, double limit, P& pieces, std::vector<int>& cuts, std::vector<int>& chosen)
        : lines_(lines), limit_(limit), pieces_(pieces), end_(pieces.end()), cuts_(cuts), chosen_(chosen) {}

    // Takes back cuts until each one left lowers the sum of squares enough: in every round those that cost less than
    // the cuts beside them.
    void merge() {
        pieces_.price_all();
        cuts_.resize(static_cast<std::size_t>(end_));
        for (int i = 0; i < end_; ++i) cuts_[static_cast<std::size_t>(i)] = i;
        while (!cuts_.empty()) {
            choose();
            for (const int i : chosen_) {
                const int right = next(i);
                segment(i).last = segment(right).last;
                sigma(i) = sigma(right);
                set_sums(i, joined(pieces_.sums(i), pieces_.sums(right)), sigma_of(i));
                remove(right);
            }
            cuts_.clear();
            for (const int i : chosen_) {
                cuts_.push_back(i);
                if (!chosen(previous(i))) cuts_.push_back(previous(i));
            }
            pieces_.price(cuts_);
            for (const int i : chosen_) chosen(i) = false;
            // These and the cuts beside them may be cheapest now.
            for (std::size_t k = cuts_.size(); k-- > 0;) {
                cuts_.push_back(previous(cuts_[k]));
                cuts_.push_back(next(cuts_[k]));
            }
        }
    }

    // Splitting may leave a segment across an edge, its rounding included, where one cut would do. It is taken out
    // where the curves beside it meet within it and, given its samples, explain them nearly as well. In every round
    // those go that cost less than any other of the segments that it would change.
    void dissolve(std::vector<Curve>& curves) {
        std::vector<int>&changed = cuts_, &open = chosen_;
        changed.clear(), open.clear();
        for (int i = next(end_); i != end_; i = next(i)) changed.push_back(i);
        while (!changed.empty()) {
            for (const int i : changed) {
                cost(i) = parts_without(i, curves).cost;
                if (cost(i) < HUGE_VAL && !chosen(i)) open.push_back(i);
                chosen(i) |= cost(i) < HUGE_VAL;
            }
            changed.clear();
            const auto kept = std::partition(open.begin(), open.end(), [&](int i) { return !cheapest_of_five(i); });
            for (auto i = kept; i != open.end(); ++i) take_out(*i, curves, changed);
            open.erase(kept, open.end());
        }
    }

private:
    Pieces::Link& link(int i) { return pieces_.links[static_cast<std::size_t>(i)]; }
    int& previous(int i) { return link(i).previous; }
    int& next(int i) { return link(i).next; }
    bool& chosen(int i) { return link(i).chosen; }
    Segment& segment(int i) { return link(i).segment; }
    double& sigma(int i) { return pieces_.sigma[static_cast<std::size_t>(i)]; }
    double& residual(int i) { return pieces_.residual[static_cast<std::size_t>(i)]; }
    double& cost(int i) { return pieces_.cost[static_cast<std::size_t>(i)]; }
    const Line<T>& line_of(int i) { return lines_[static_cast<std::size_t>(link(i).line)]; }
    double sigma_of(int i) { return sigma_in(line_of(i), segment(i)); }

    // Of all cuts those that cost less than the ones beside them, of equals the leftmost. Without branches: which these
    // are cannot be foretold.
    void choose() {
        chosen_.resize(cuts_.size());
        std::size_t count = 0;
        for (const int i : cuts_) {
            const int cheap = cost(i) < limit_, before = cost(i) < cost(previous(i)), after = cost(i) <= cost(next(i));
            const int cheapest = cheap & before & after;
            chosen_[count] = i;
            count += static_cast<std::size_t>(cheapest & !chosen(i));
            chosen(i) |= cheapest != 0;
        }
        chosen_.resize(count);
    }

    template <class Sums>
    void set_sums(int i, const Sums& sums, double sigma) {
        const double least = curved_significance * sigma;
        pieces_.set_sums(i, sums);
        pieces_.least[static_cast<std::size_t>(i)] = least;
        residual(i) = residual_squares(sums, least);
    }

    void remove(int i) {
        next(previous(i)) = next(i);
        previous(next(i)) = previous(i);
    }

    // What becomes of the segments beside one that is taken out: where they meet, and their sums.
    using Sums = std::decay_t<decltype(std::declval<const P&>().sums(0))>;
    struct Parts {
        int cut = 0;
        Sums left{}, right{};
        double cost = HUGE_VAL;  // how much less significant the three are; infinite where the segment stays
    };

    Parts parts_without(int i, const std::vector<Curve>& curves) {
        const int before = previous(i), after = next(i);
        if (before == end_ || after == end_ || !(sigma(before) > 0 && sigma(i) > 0)) return {};  // not adjacent
        const Segment s = segment(i);
        const Line<T>& line = line_of(i);
        const Curve &f = curves[static_cast<std::size_t>(before)], &g = curves[static_cast<std::size_t>(after)];
        const double begin = line.abscissa(s.first - 1), end = line.abscissa(s.last + 1);
        const double near = (line.abscissa(s.first) + line.abscissa(s.last)) / 2;
        double x = 0;
        if (!intersection(f, g, near, std::max(near - begin, end - near), x)) return {};
        if (x < begin || x > end) return {};
        Parts parts;
        parts.cut = s.first - 1;
        while (parts.cut < s.last && line.abscissa(parts.cut + 1) <= x) ++parts.cut;
        parts.left = pieces_.sums(before), parts.right = pieces_.sums(after);
        if (parts.cut >= s.first) parts.left = joined(parts.left, P::sums_over(line, {s.first, parts.cut}));
        if (parts.cut < s.last) parts.right = joined(P::sums_over(line, {parts.cut + 1, s.last}), parts.right);
        const double v = sigma_of(i), least = curved_significance * v;
        const double rise = residual_squares(parts.left, least) + residual_squares(parts.right, least) -
                            (residual(before) + residual(i) + residual(after));
        const double cost = rise / (v * v);
        if (cost < straddling * straddling * limit_) parts.cost = cost;
        return parts;
    }

    bool cheapest_of_five(int i) {
        const int before = previous(i), after = next(i);
        return cost(i) < HUGE_VAL && cost(i) < cost(before) && cost(i) < cost(previous(before)) &&
               cost(i) <= cost(after) && cost(i) <= cost(next(after));
    }

    void take_out(int i, std::vector<Curve>& curves, std::vector<int>& changed) {
        const Parts parts = parts_without(i, curves);
        const int before = previous(i), after = next(i);
        const double v = sigma_of(i);
        segment(before).last = parts.cut;
        segment(after).first = parts.cut + 1;
        set_sums(before, parts.left, v);
        set_sums(after, parts.right, v);
        remove(i);
        for (const int k : {before, after}) curves[static_cast<std::size_t>(k)] = pieces_.curve(k);
        for (const int k : {previous(before), before, after, next(after)})
            if (k != end_) changed.push_back(k);
    }

    const std::vector<Line<T>>& lines_;
    double limit_;
    P& pieces_;
    int end_;
    std::vector<int>&cuts_, &chosen_;
};

}  // namespace

void Pieces::resize(std::size_t count) {
    links.resize(count + 1);
    links[count] = {{}, 0, static_cast<int>(count) - 1, 0, false};
    for (auto* numbers : {&sigma, &least, &residual, &cost}) {
        numbers->resize(in_lanes(count + 1) + 1);
        std::fill(numbers->begin() + static_cast<std::ptrdiff_t>(count), numbers->end(), 0.0);
    }
    cost[count] = HUGE_VAL;
}

Projections EvenPieces::sums(int i) const {
    const auto k = static_cast<std::size_t>(i);
    return {sums_[n][k], sums_[mean][k], sums_[y1][k], sums_[y2][k], sums_[squares][k]};
}

void EvenPieces::set_sums(int i, const Projections& p) {
    const auto k = static_cast<std::size_t>(i);
    sums_[n][k] = p.n, sums_[mean][k] = p.mean, sums_[y1][k] = p.y1, sums_[y2][k] = p.y2, sums_[squares][k] = p.squares;
}

template <class T>
Projections EvenPieces::sums_over(const Line<T>& line, const Segment& s) {
    const double base = line.ordinate(middle(s));
    return projections_of(s.size(), base, sums_of(line.y + s.first, s.size(), base));
}

template <class T>
void EvenPieces::fit(const std::vector<Line<T>>& lines) {
    for (auto& numbers : sums_) numbers.resize(cost.size());
    base_.resize(cost.size());
    for (std::size_t k = 0; k + 1 < links.size(); ++k) {
        const Segment& s = links[k].segment;
        const Line<T>& line = lines[static_cast<std::size_t>(links[k].line)];
        base_[k] = line.ordinate(middle(s));
        const Sums sums = sums_of(line.y + s.first, s.size(), base_[k]);
        sums_[n][k] = s.size();
        sums_[mean][k] = sums.h, sums_[y1][k] = sums.ht, sums_[y2][k] = sums.htt, sums_[squares][k] = sums.hh;
    }
    project(in_lanes(links.size()), column(n), base_.data(), least.data(), column(mean), column(y1), column(y2),
            column(squares), residual.data());
}

void EvenPieces::price_all() {
    const Columns left{column(n), column(mean), column(y1), column(y2), column(squares), residual.data()};
    const Columns right{left.n + 1, left.mean + 1, left.y1 + 1, left.y2 + 1, left.squares + 1, left.residual + 1};
    cost_all(in_lanes(links.size()), left, right, sigma.data(), cost.data());
}

// Gathered first, to be computed side by side.
void EvenPieces::price(const std::vector<int>& cuts) {
    constexpr int sides = 6;
    const std::size_t count = in_lanes(cuts.size());
    gathered_.resize((2 * sides + 2) * count);
    const auto part = [&](int i) { return gathered_.data() + static_cast<std::size_t>(i) * count; };
    for (std::size_t k = 0; k < cuts.size(); ++k) {
        const auto i = static_cast<std::size_t>(cuts[k]);
        const std::size_t pair[2] = {i, static_cast<std::size_t>(links[i].next)};
        for (int side = 0; side < 2; ++side) {
            for (int c = 0; c < columns; ++c) part(side * sides + c)[k] = sums_[c][pair[side]];
            part(side * sides + columns)[k] = residual[pair[side]];
        }
        part(2 * sides)[k] = sigma[i];
    }
    const auto side = [&](int i) {
        return Columns{part(i), part(i + 1), part(i + 2), part(i + 3), part(i + 4), part(i + 5)};
    };
    cost_all(count, side(0), side(sides), part(2 * sides), part(2 * sides + 1));
    for (std::size_t k = 0; k < cuts.size(); ++k) cost[static_cast<std::size_t>(cuts[k])] = part(2 * sides + 1)[k];
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
void UnevenPieces::fit(const std::vector<Line<T>>& lines) {
    sums_.resize(links.size());
    for (std::size_t k = 0; k + 1 < links.size(); ++k) {
        sums_[k] = sums_over(lines[static_cast<std::size_t>(links[k].line)], links[k].segment);
        residual[k] = residual_squares(sums_[k], least[k]);
    }
}

void UnevenPieces::price_all() {
    for (std::size_t k = 0; k < links.size(); ++k) price(k);
}

void UnevenPieces::price(const std::vector<int>& cuts) {
    for (const int i : cuts) price(static_cast<std::size_t>(i));
}

void UnevenPieces::price(std::size_t i) {
    cost[i] = HUGE_VAL;
    if (!(sigma[i] > 0)) return;
    const auto right = static_cast<std::size_t>(links[i].next);
    const double one = residual_squares(joined(sums_[i], sums_[right]), curved_significance * sigma[i]);
    cost[i] = cost_of(one, residual[i], residual[right], sigma[i], sums_[i].n + sums_[right].n);
}

Curve UnevenPieces::curve(int i) const {
    return fit_least_squares(sums(i), least[static_cast<std::size_t>(i)]);
}

bool intersection(const Curve& f, const Curve& g, double near, double reach, double& x) {
    // f - g = c + b t + a t^2 with t = x - near; the root of smaller magnitude, without cancellation.
    const double c = f.value(near) - g.value(near), b = f.slope(near) - g.slope(near), a = f.c2 - g.c2;
    if (std::abs(c) > (std::abs(b) + std::abs(a) * reach) * reach) return false;
    const double discriminant = b * b - 4 * a * c;
    if (!(discriminant >= 0)) return false;
    const double denominator = std::abs(b) + std::sqrt(discriminant);
    if (!(denominator > 0)) return false;
    x = near - (b < 0 ? -2 : 2) * c / denominator;
    return std::isfinite(x);
}

template <class T>
void Approximator<T>::approximate(const Strip<T>& strip) {
    split(strip);
    if (parameters_.interpolate)
        interpolate(strip);
    else if (strip.lines.front().x)
        fit(strip, uneven_);
    else
        fit(strip, even_);
}

template <class T>
void Approximator<T>::split(const Strip<T>& strip) {
    splitter_.clear();
    for (const Line<T>& line : strip.lines)
        splitter_.add(samples_of(line));
    splitter_.split();
    segments_.clear();
    curves_.clear();
    starts_.assign(1, 0);
    for (std::size_t i = 0; i < strip.lines.size(); ++i) {
        splitter_.for_each_segment(i, [&](const Segment& s) { segments_.push_back(s); });
        starts_.push_back(segments_.size());
    }
}

template <class T>
void Approximator<T>::interpolate(const Strip<T>& strip) {
    for (std::size_t i = 0; i < strip.lines.size(); ++i)
        for (std::size_t j = starts_[i]; j < starts_[i + 1]; ++j) {
            const Line<T>& line = strip.lines[i];
            const Segment s = segments_[j];
            const int m = midpoint(samples_of(line), s);
            Moments moments;
            moments.origin = line.abscissa(m);
            moments.base = line.ordinate(m);
            int added = s.first - 1;
            for (const int k : {s.first, m, s.last}) {
                if (k > added) moments.add(line.abscissa(k), line.ordinate(k));
                added = k;
            }
            curves_.push_back(fit_interpolating(moments));
        }
}

template <class T>
template <class P>
void Approximator<T>::fit(const Strip<T>& strip, P& pieces) {
    if (segments_.empty()) return;
    pieces.resize(segments_.size());
    for (std::size_t i = 0; i < strip.lines.size(); ++i)
        for (std::size_t k = starts_[i]; k < starts_[i + 1]; ++k) {
            const Line<T>& line = strip.lines[i];
            const Segment s = segments_[k];
            const bool adjacent = k + 1 < starts_[i + 1] && s.last + 1 == segments_[k + 1].first &&
                                  line.abscissa(s.last) < line.abscissa(s.last + 1);
            const int own = static_cast<int>(k);
            pieces.links[k] = {s, static_cast<int>(i), k > 0 ? own - 1 : pieces.end(), own + 1, false};
            pieces.sigma[k] = adjacent ? (line.sigma_at(s.last) + line.sigma_at(s.last + 1)) / 2 : 0;
            pieces.least[k] = curved_significance * sigma_in(line, s);
        }
    pieces.fit(strip.lines);
    const double limit = parameters_.merge_significance * parameters_.merge_significance;
    Joiner<T, P> joiner(strip.lines, limit, pieces, cuts_, chosen_);
    if (limit > 0) joiner.merge();
    curves_.resize(segments_.size());
    for (int i = 0; i != pieces.end(); i = pieces.links[static_cast<std::size_t>(i)].next)
        curves_[static_cast<std::size_t>(i)] = pieces.curve(i);
    if (limit > 0) joiner.dissolve(curves_);
    // Those that are left move together.
    segments_.clear();
    starts_.assign(1, 0);
    for (int i = 0; i != pieces.end(); i = pieces.links[static_cast<std::size_t>(i)].next) {
        const Pieces::Link& link = pieces.links[static_cast<std::size_t>(i)];
        starts_.resize(static_cast<std::size_t>(link.line) + 1, segments_.size());
        curves_[segments_.size()] = curves_[static_cast<std::size_t>(i)];
        segments_.push_back(link.segment);
    }
    starts_.resize(strip.lines.size() + 1, segments_.size());
}

template class Approximator<float>;
template class Approximator<double>;

}  // namespace rangeedge
