// The angle between two vectors, from their cross and dot products rather than from the arc cosine in which the paper
// writes it (paper, 2 and 4.2): this one is accurate for the smallest and the largest angles too.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>

namespace rangeedge {

constexpr double degrees_per_radian = 57.295779513082320877;

// In degrees, from 0 to 180; NaN of none.
inline double angle_between(double cross, double dot) {
    const double scale = 1 / std::max(std::abs(cross), std::abs(dot));  // lest they leave the range of single precision
    const auto y = static_cast<float>(cross * scale), x = static_cast<float>(dot * scale);
    return std::abs(std::atan2(y, x)) * degrees_per_radian;
}

}  // namespace rangeedge
