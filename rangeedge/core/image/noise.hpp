// How noisy the values of a range image are. A measured length z has the standard deviation
//
//     sigma(z) = a + b z + c z^2,
//
// or one that is given for every pixel. Kernels work on ordinates: heights, or inverse depths q = 1 / z, which are off
// by sigma(z) / z^2 = a q^2 + b q + c where z is off by sigma(z). So the noise of an ordinate is a quadratic as well,
// of the same coefficients, in reverse order where the ordinate is an inverse depth.
//
// The paper has no model of the noise: its threshold epsilon is chosen for each scanner (paper, 6).
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/simd.hpp"

namespace rangeedge {

// c0 + c1 x + c2 x^2.
template <class T>
struct Quadratic {
    T c0, c1, c2;
    RANGEEDGE_INLINE T at(T x) const { return c0 + (c1 + c2 * x) * x; }
};

struct Noise {
    double a = 0, b = 0, c = 0;
    double correlation = 1;      // how much larger the deviation is over a segment than between neighbours
    const float* map = nullptr;  // the deviations of lengths at every pixel of the image, or null

    // The deviation of an ordinate y by |y|, unless there is a map.
    Quadratic<double> of_ordinates(bool projective) const {
        return projective ? Quadratic<double>{c, b, a} : Quadratic<double>{a, b, c};
    }
    // The deviation of an ordinate, and that of one that stands for several pixels.
    double sigma(double ordinate, std::int64_t pixel, bool projective) const {
        const double y = std::abs(ordinate);
        if (map) return static_cast<double>(map[pixel]) * (projective ? y * y : 1);
        return of_ordinates(projective).at(y);
    }
    double correlated_sigma(double ordinate, std::int64_t pixel, bool projective) const {
        return std::max(correlation * sigma(ordinate, pixel, projective), finest);
    }
    static constexpr double finest = 1e-30;  // no deviation is smaller, lest it be divided by
};

}  // namespace rangeedge
