// SPDX-License-Identifier: Apache-2.0
#include "scanline/merge.hpp"

#include <algorithm>
#include <cmath>

#include "base/watch.hpp"
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
        Watch::checkpoint();
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
    Array<int>&changed = cuts_, &bridges = chosen_;
    changed.clear(), bridges.clear();
    for (int i = next(end_); i != end_; i = next(i)) changed.push_back(i);
    while (!changed.empty()) {
        Watch::checkpoint();
        for (const int i : changed) {
            cost(i) = sides_without(i, curves).cost;
            if (cost(i) < HUGE_VAL && !chosen(i)) bridges.push_back(i);
            chosen(i) |= cost(i) < HUGE_VAL;
        }
        changed.clear();
        const auto kept = std::partition(bridges.begin(), bridges.end(), [&](int i) { return !cheapest_bridge(i); });
        for (auto i = kept; i != bridges.end(); ++i) remove_bridge(*i, curves, changed);
        bridges.resize(kept - bridges.begin());
    }
}

template <class T, class List>
typename Merger<T, List>::Sides Merger<T, List>::sides_without(int i, const Array<Curve>& curves) {
    const int before = previous(i), after = next(i);
    if (before == end_ || after == end_ || !(list_.sigma[before] > 0 && list_.sigma[i] > 0)) return {};  // not adjacent
    const Segment s = segment(i);
    const Line<T>& line = line_of(i);
    const double begin = line.abscissa(s.first - 1), end = line.abscissa(s.last + 1);
    const double middle = (line.abscissa(s.first) + line.abscissa(s.last)) / 2;
    double x = 0;
    if (!intersection(curves[before], curves[after], middle, std::max(middle - begin, end - middle), x)) return {};
    if (x < begin || x > end) return {};
    Sides sides;
    sides.cut = s.first - 1;
    while (sides.cut < s.last && line.abscissa(sides.cut + 1) <= x) ++sides.cut;
    sides.left = list_.sums(before), sides.right = list_.sums(after);
    if (sides.cut >= s.first) sides.left = sides.left + List::sums_over(line, {s.first, sides.cut});
    if (sides.cut < s.last) sides.right = List::sums_over(line, {sides.cut + 1, s.last}) + sides.right;
    const SampleNoise noise = line.noise_of(s);
    const double deviation = list_.noise().join[s.size()] * noise.of_fit(s.size());
    const auto residual_of = [&](const Sums& sums) {
        return residual_squares(sums, least_quadratic(noise, static_cast<int>(sums.n), line.noise->slope));
    };
    const double joint = residual_of(sides.left) + residual_of(sides.right);
    const double rise = joint - (residual(before) + residual(i) + residual(after));
    const double cost = rise / (deviation * deviation);
    if (cost < bridge_factor * bridge_factor * limit_) sides.cost = cost;
    return sides;
}

template <class T, class List>
bool Merger<T, List>::cheapest_bridge(int i) {
    const int before = previous(i), after = next(i);
    return cost(i) < HUGE_VAL && cost(i) < cost(before) && cost(i) < cost(previous(before)) && cost(i) <= cost(after) &&
           cost(i) <= cost(next(after));
}

template <class T, class List>
void Merger<T, List>::remove_bridge(int i, Array<Curve>& curves, Array<int>& changed) {
    const Sides sides = sides_without(i, curves);
    const int before = previous(i), after = next(i);
    segment(before).last = sides.cut;
    segment(after).first = sides.cut + 1;
    set_sums(before, sides.left);
    set_sums(after, sides.right);
    remove(i);
    for (const int k : {before, after}) curves[k] = list_.curve(k);
    for (const int k : {previous(before), before, after, next(after)})
        if (k != end_) changed.push_back(k);
}

// The significance of a quadratic term of these sums, where the noise is that of a segment.
template <class T, class List>
double Merger<T, List>::least_of(int i, const Sums& sums) {
    const Line<T>& line = line_of(i);
    return least_quadratic(line.noise_of(segment(i)), static_cast<int>(sums.n), line.noise->slope);
}

template <class T, class List>
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
