// SPDX-License-Identifier: Apache-2.0
#include "image/noise.hpp"

namespace rangeedge {

FitFactors::FitFactors(const double* at_levels) {
    for (int n = 0; n <= largest; ++n) {
        const double level = std::log2(static_cast<double>(std::max(n, 2))) - 1;  // 0 at n = 2, 1 at n = 4
        const int below = std::min(static_cast<int>(level), levels - 1);
        const double low = below > 0 ? at_levels[below - 1] : 1, high = at_levels[below];
        factors_[n] = low + (high - low) * (level - below);
    }
}

FitFactors::FitFactors(const FitFactors& a, const FitFactors& b) {
    for (int n = 0; n <= largest; ++n) factors_[n] = std::max(a[n], b[n]);
}

FitNoise::FitNoise(const double* numbers)
    : slope(numbers), value(numbers + FitFactors::levels), shared_slope(numbers + 2 * FitFactors::levels),
      shared_value(numbers + 3 * FitFactors::levels), join(slope, value), residual(numbers[4 * FitFactors::levels]) {}

}  // namespace rangeedge
