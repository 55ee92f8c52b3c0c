// SPDX-License-Identifier: Apache-2.0
#include "scanline/approximation.hpp"

#include "scanline/fit.hpp"

namespace rangeedge {
namespace {

template <class T>
Samples<T> samples_of(const Line<T>& line) {
    return {line.y, line.x, line.scale, line.path.size, static_cast<T>(line.tolerance)};
}

}  // namespace

template <class T>
void Approximator<T>::approximate(const Strip<T>& strip) {
    split(strip);
    if (options_.interpolate)
        interpolate(strip);
    else if (strip.lines.front().x)
        fit_and_merge(strip, uneven_);
    else
        fit_and_merge(strip, even_);
}

template <class T>
void Approximator<T>::split(const Strip<T>& strip) {
    splitter_.clear();
    for (const Line<T>& line : strip.lines) splitter_.add(samples_of(line));
    splitter_.split();
    found_.clear();
    for (std::size_t i = 0; i < strip.lines.size(); ++i) {
        splitter_.for_each_segment(static_cast<std::ptrdiff_t>(i), [&](Segment s) { found_.segments.push_back(s); });
        found_.starts.push_back(found_.segments.size());
    }
}

// The quadratic through the end points and the midpoint, as it was split by.
template <class T>
void Approximator<T>::interpolate(const Strip<T>& strip) {
    found_.for_each(strip.lines, [&](const Line<T>& line, const Segment& s) {
        const int m = midpoint(samples_of(line), s);
        PowerSums sums;
        sums.origin = line.abscissa(m);
        sums.base = line.ordinate(m);
        int added = s.first - 1;
        for (const int k : {s.first, m, s.last}) {
            if (k > added) sums.add(line.abscissa(k), line.ordinate(k));
            added = k;
        }
        found_.curves.push_back(fit_interpolating(sums));
    });
}

template <class T>
template <class List>
void Approximator<T>::fit_and_merge(const Strip<T>& strip, List& list) {
    if (found_.segments.empty()) return;
    list.fill(strip.lines, found_);
    list.sum_up(strip.lines);
    Merger<T, List> merger(strip.lines, options_.merge_significance, list, buffers_);
    merger.merge();
    list.fit(found_.curves);
    merger.remove_bridges(found_.curves);
    list.collect(found_);
}

template class Approximator<float>;
template class Approximator<double>;

}  // namespace rangeedge
