// SPDX-License-Identifier: Apache-2.0
#include "scanline/bridge.hpp"

#include <algorithm>
#include <cmath>

#include "scanline/split.hpp"

namespace rangeedge {
namespace {

// Whether the sample behind a hole may continue the surface of the one before it.
template <class T>
bool runs_on(const Line<T>& line, const Hole& hole) {
    const int left = hole.first - 1, right = hole.end;
    const double width = line.abscissa(right) - line.abscissa(left);
    if (!(width > 0)) return false;
    const auto rise = [&](int i, int k) {  // of the straight line through two samples; 0 where one has no data
        if (i < 0 || k >= line.path.size) return 0.0;
        const double slope = (line.ordinate(k) - line.ordinate(i)) / (line.abscissa(k) - line.abscissa(i));
        return std::isfinite(slope) ? slope * width : 0.0;
    };
    const double before = rise(left - 1, left), after = rise(right, right + 1);
    const double step = line.ordinate(right) - line.ordinate(left);
    const double slack = 2 * std::max(line.tolerance_at(left), line.tolerance_at(right));
    return step >= std::min({before, after, 0.0}) - slack && step <= std::max({before, after, 0.0}) + slack;
}

}  // namespace

template <class T>
void find_bridged(const Line<T>& line, int most, Array<Hole>& holes) {
    const int n = line.path.size;
    holes.clear();
    for (int first = find_invalid(line.y, find_valid(line.y, 0, n), n); first < n;) {
        const Hole hole{first, find_valid(line.y, first, n)};
        if (hole.end == n) return;
        if (hole.size() <= most && runs_on(line, hole)) holes.push_back(hole);
        first = find_invalid(line.y, hole.end, n);
    }
}

template void find_bridged(const Line<float>&, int, Array<Hole>&);
template void find_bridged(const Line<double>&, int, Array<Hole>&);

}  // namespace rangeedge
