// SPDX-License-Identifier: Apache-2.0
#include "edges/align.hpp"

#include <cmath>

namespace rangeedge {
namespace {

constexpr double least_crossing = 0.3;  // pixels that a step of the scan line must lead across the common line

}  // namespace

template <class T>
void align(Candidate& c, const NeighbourGrid::Near& near, const Frame<T>& frame, double max_shift, double max_spreads) {
    const CommonLine line = common_line(near);
    const Step step = step_of(c.direction);
    const double across = step.dcol * line.normal[0] + step.drow * line.normal[1];
    if (!line.found || std::abs(across) < least_crossing) return;
    const double shift = line.offset / across, total = static_cast<double>(c.shift) + shift;
    if (std::abs(total) > max_shift || std::abs(shift) > max_spreads * static_cast<double>(c.spread)) return;
    const double x = static_cast<double>(c.x) + shift * step.dcol, y = static_cast<double>(c.y) + shift * step.drow;
    const int u = static_cast<int>(step.dcol ? std::floor(x) : std::round(x));
    const int v = static_cast<int>(step.drow > 0 ? std::floor(y) : step.drow < 0 ? std::ceil(y) : std::round(y));
    if (!frame.valid_at(u, v) || !frame.valid_at(u + step.dcol, v + step.drow)) return;
    c.shift = static_cast<float>(total);
    c.x = static_cast<float>(x);
    c.y = static_cast<float>(y);
    c.before = v * frame.cols + u;
    c.after = (v + step.drow) * frame.cols + u + step.dcol;
}

template void align(Candidate&, const NeighbourGrid::Near&, const Frame<float>&, double, double);
template void align(Candidate&, const NeighbourGrid::Near&, const Frame<double>&, double, double);

}  // namespace rangeedge
