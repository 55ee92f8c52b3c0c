// Sums over points of the image, and the straight line with the least squared distances to them.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>

namespace rangeedge {

struct StraightLine {
    double x, y, dx, dy;  // a point and the unit direction
    double rss;           // weighted sum of squared distances

    double along(double px, double py) const { return (px - x) * dx + (py - y) * dy; }
    double off(double px, double py) const { return (py - y) * dx - (px - x) * dy; }
};

struct PointSums {
    double w = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;

    void add(double px, double py, double weight = 1) {
        w += weight, x += weight * px, y += weight * py;
        xx += weight * px * px, xy += weight * px * py, yy += weight * py * py;
    }

    void add(const PointSums& o) { w += o.w, x += o.x, y += o.y, xx += o.xx, xy += o.xy, yy += o.yy; }
    PointSums without(const PointSums& o) const { return {w - o.w, x - o.x, y - o.y, xx - o.xx, xy - o.xy, yy - o.yy}; }

    // The weighted sum of squared distances from the best line.
    double rss() const {
        const double mx = x / w, my = y / w, a = xx - x * mx, b = xy - x * my, c = yy - y * my;
        return std::max((a + c - std::sqrt((a - c) * (a - c) + 4 * b * b)) / 2, 0.0);
    }

    // In the direction that has a positive product with (forward_x, forward_y).
    StraightLine line(double forward_x, double forward_y) const {
        const double mx = x / w, my = y / w;
        const double a = xx - w * mx * mx, b = xy - w * mx * my, c = yy - w * my * my;
        const double angle = std::atan2(2 * b, a - c) / 2;
        double dx = std::cos(angle), dy = std::sin(angle);
        const double rss = std::max(a * dy * dy - 2 * b * dx * dy + c * dx * dx, 0.0);
        if (dx * forward_x + dy * forward_y < 0) dx = -dx, dy = -dy;
        return {mx, my, dx, dy, rss};
    }
};

}  // namespace rangeedge
