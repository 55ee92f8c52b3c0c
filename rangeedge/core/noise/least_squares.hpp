// A deviation as a function of depth, by least squares.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "image/noise.hpp"

namespace rangeedge {

// The deviation sum c_p z^p over some powers p from 0 to 3, all c_p >= 0, that has the least squares of relative errors
// among deviations at several depths z > 0: quiet depths count as much as noisy ones.
Deviation fitted_deviation(const std::vector<double>& depths, const std::vector<double>& deviations,
                           const std::vector<int>& powers);

}  // namespace rangeedge
