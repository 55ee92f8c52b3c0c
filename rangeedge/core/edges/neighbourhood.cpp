// SPDX-License-Identifier: Apache-2.0
#include "edges/neighbourhood.hpp"

#include <cmath>

namespace rangeedge {
namespace {

constexpr double least_spread = 0.05;  // squared pixels: positions closer together than this form no line

// Weighted sums of the positions of neighbours.
struct PositionSums {
    float n, x, y, xx, xy, yy;
};

template <int bytes>
RANGEEDGE_INLINE PositionSums position_sums_in(const NeighbourGrid::Near& near) {
    using F = Floats<bytes>;
    F n = F::all(0), x = n, y = n, xx = n, xy = n, yy = n;
    for_each_lanes<bytes>(near, [&](int, const F& w, const F& dx, const F& dy) RANGEEDGE_ALWAYS {
        const F wx = w * dx, wy = w * dy;
        n += w, x += wx, y += wy, xx += wx * dx, xy += wx * dy, yy += wy * dy;
    });
    return {n.sum(), x.sum(), y.sum(), xx.sum(), xy.sum(), yy.sum()};
}
RANGEEDGE_VERSIONS(PositionSums, position_sums, (const NeighbourGrid::Near& near), (near))

}  // namespace

CommonLine common_line(const NeighbourGrid::Near& near) {
    const PositionSums sums = position_sums(near);
    const double per_n = 1 / double{sums.n}, mx = sums.x * per_n, my = sums.y * per_n;
    const double sxx = sums.xx * per_n - mx * mx, sxy = sums.xy * per_n - mx * my, syy = sums.yy * per_n - my * my;
    // The line runs at half the angle of (sxx - syy, 2 sxy).
    const double spread = std::sqrt((sxx - syy) * (sxx - syy) + 4 * sxy * sxy);
    const double cosine = spread > 0 ? (sxx - syy) / spread : 1, sine = spread > 0 ? 2 * sxy / spread : 0;
    const double larger = std::sqrt((1 + std::abs(cosine)) / 2), smaller = std::abs(sine) / (2 * larger);
    CommonLine line{};
    line.normal[0] = -std::copysign(cosine >= 0 ? smaller : larger, sine);
    line.normal[1] = cosine >= 0 ? larger : smaller;
    line.offset = line.normal[0] * mx + line.normal[1] * my;
    line.found = sxx + syy > least_spread;
    return line;
}

}  // namespace rangeedge
