// The deviation of many values of which few are outliers.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <vector>

namespace rangeedge {

// The value of a rank, or of several, among magnitudes, 0 being that of the smallest. `padding` more values than
// `count` may be read here and below.
float ranked(const float* magnitudes, std::size_t count, std::size_t rank);
std::vector<float> ranked(const float* magnitudes, std::size_t count, const std::vector<std::size_t>& ranks);

// The deviation of normal values around 0, given their magnitudes: the root mean square of the smallest three quarters,
// corrected for the trimming. 0 of none.
double trimmed_deviation(const float* magnitudes, std::size_t count);

// The same by the lower quartile of the magnitudes.
double quartile_deviation(const float* magnitudes, std::size_t count);

// The same by the median of the magnitudes.
double median_deviation(const float* magnitudes, std::size_t count);

// The same by the median; by the quartile or the tenth where that is less by more than chance makes it. Those of noise
// agree; where half of the values are outliers, the smaller ones still tell the deviation of the rest.
double normal_deviation(const float* magnitudes, std::size_t count);

}  // namespace rangeedge
