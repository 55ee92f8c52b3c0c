// The deviation of many values of which few are outliers.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <vector>

namespace rangeedge {

// The deviation of normal values around 0, given their magnitudes: the root mean square of the smallest three quarters,
// corrected for the trimming. 0 of none. `padding` more values than `count` may be read.
double trimmed_deviation(const float* magnitudes, std::size_t count);

// The same by the lower quartile, or the median, of the magnitudes, which are put in another order.
double quartile_deviation(std::vector<float>& magnitudes);
double median_deviation(std::vector<float>& magnitudes);

// The largest deviation of normal values that agrees with the median, the quartile and the tenth of the magnitudes. Those
// of noise agree; where half of the values are outliers, the smaller ones still tell the deviation of the rest.
double normal_deviation(std::vector<float>& magnitudes);

}  // namespace rangeedge
