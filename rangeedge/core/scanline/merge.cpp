// SPDX-License-Identifier: Apache-2.0
#include "scanline/merge.hpp"

#include <algorithm>

#include "scanline/fit.hpp"

namespace rangeedge {
namespace {

constexpr double bridge_factor = 2;  // by which the significance of a bridge may exceed that of other cuts

}  // namespace

template <class T, class List>
void Merger<T, List>::merge() {
    if (!(limit_ > 0)) return;
    list_.update_all_costs();
    cuts_.resize(end_);
    for (int i = 0; i < end_; ++i) cuts_[i] = i;
    while (!cuts_.empty()) {
        choose();
        for (const int i : chosen_) {
            const int right = next(i);
            segment(i).last = segment(right).last;
            list_.sigma[i] = list_.sigma[right], list_.waves[i] = list_.waves[right];
            set_sums(i, list_.sums(i) + list_.sums(right));
            remove(right);
        }
        cuts_.clear();
        for (const int i : chosen_) {
            cuts_.push_back(i);
            if (!chosen(previous(i))) cuts_.push_back(previous(i));
        }
        list_.update_costs(cuts_);
        for (const int i : chosen_) chosen(i) = false;
        // These and the cuts beside them may be cheapest now.
        for (std::ptrdiff_t k = cuts_.size(); k-- > 0;) {
            cuts_.push_back(previous(cuts_[k]));
            cuts_.push_back(next(cuts_[k]));
        }
    }
}

// Of all cuts those that cost less than the ones beside them, of equals the leftmost. Without branches, since which
// these are cannot be foretold: each is written, and then counted if it is chosen.
template <class T, class List>
void Merger<T, List>::choose() {
    chosen_.resize(cuts_.size());
    std::ptrdiff_t count = 0;
    for (const int i : cuts_) {
        const int cheap = cost(i) < limit_, before = cost(i) < cost(previous(i)), after = cost(i) <= cost(next(i));
        const int cheapest = cheap & before & after;
        chosen_[count] = i;
        count += cheapest & !chosen(i);
        chosen(i) |= cheapest != 0;
    }
    chosen_.resize(count);
}

template <class T, class List>
void Merger<T, List>::remove_bridges(Array<Curve>& curves) {
    if (!(limit_ > 0)) return;
    for (int i = next(0); i != end_ && next(i) != end_;) {
        const int before = previous(i), after = next(i);
        i = !remove_if_bridge(i, curves) || previous(before) == end_ ? after : before;
    }
}

template <class T, class List>
bool Merger<T, List>::remove_if_bridge(int i, Array<Curve>& curves) {
    const int before = previous(i), after = next(i);
    if (!(list_.sigma[before] > 0 && list_.sigma[i] > 0)) return false;  // not adjacent
    const Segment s = segment(i);
    const Line<T>& line = line_of(i);
    const double begin = line.abscissa(s.first - 1), end = line.abscissa(s.last + 1);
    const double middle = (line.abscissa(s.first) + line.abscissa(s.last)) / 2;
    double x = 0;
    if (!intersection(curves[before], curves[after], middle, std::max(middle - begin, end - middle), x)) return false;
    if (x < begin || x > end) return false;
    int cut = s.first - 1;
    while (cut < s.last && line.abscissa(cut + 1) <= x) ++cut;
    auto left = list_.sums(before), right = list_.sums(after);
    if (cut >= s.first) left = left + List::sums_over(line, {s.first, cut});
    if (cut < s.last) right = List::sums_over(line, {cut + 1, s.last}) + right;
    const double deviation = list_.noise().join[s.size()] * line.sigma_of_fit_at(s.reference(), s.size());
    const double rise = residual_squares(left, least_of(i, left)) + residual_squares(right, least_of(i, right)) -
                        (residual(before) + residual(i) + residual(after));
    if (!(rise < bridge_factor * bridge_factor * limit_ * deviation * deviation)) return false;
    segment(before).last = cut;
    segment(after).first = cut + 1;
    set_sums(before, left);
    set_sums(after, right);
    remove(i);
    curves[before] = list_.curve(before), curves[after] = list_.curve(after);
    return true;
}

// The significance of a quadratic term of these sums, where the noise is that of a segment.
template <class T, class List>
template <class Sums>
double Merger<T, List>::least_of(int i, const Sums& sums) {
    const Line<T>& line = line_of(i);
    const int k = segment(i).reference();
    return least_quadratic(line.sigma_at(k), line.waves_at(k), static_cast<int>(sums.n), line.noise->slope);
}

template <class T, class List>
template <class Sums>
void Merger<T, List>::set_sums(int i, const Sums& sums) {
    list_.least[i] = least_of(i, sums);
    list_.set_sums(i, sums);
    residual(i) = residual_squares(sums, list_.least[i]);
}

template <class T, class List>
void Merger<T, List>::remove(int i) {
    next(previous(i)) = next(i);
    previous(next(i)) = previous(i);
}

template class Merger<float, EvenSegments>;
template class Merger<double, EvenSegments>;
template class Merger<float, UnevenSegments>;
template class Merger<double, UnevenSegments>;

}  // namespace rangeedge
