// The deviation of many values of which few are outliers.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <vector>

namespace rangeedge {

// The deviation of normal values around 0, given their magnitudes: the root mean square of the smallest three quarters,
// corrected for the trimming. 0 of none. `padding` more values than `count` may be read.
double trimmed_deviation(const float* magnitudes, std::size_t count);

// The same by the lower quartile of the magnitudes, which are put in another order.
double quartile_deviation(std::vector<float>& magnitudes);

// The same by the median of the magnitudes, which are put in another order; for a few thousand. Less where many small
// ones are far smaller than those of normal values would be: then the median itself is one of the outliers.
double median_deviation(std::vector<float>& magnitudes);

}  // namespace rangeedge
