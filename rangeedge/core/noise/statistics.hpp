// The noise of a range image from third differences along its rows and columns, which vanish on every quadratic.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

namespace rangeedge {

// Deviations of ordinates, as of independent noise.
struct NoiseStatistics {
    double near = 0, far = 0;          // from differences of neighbours, and of samples six apart
    double lowest = 0, highest = 0;    // ordinate
    // By ordinate, in bins of as many differences each: the median ordinate, and the deviation.
    std::vector<double> ordinates, deviations;
};

// Of an image with NaN where there is no data. Edges are few among differences, so the smaller three quarters count.
template <class T>
NoiseStatistics noise_statistics(const T* ordinate, int rows, int cols, int threads);

}  // namespace rangeedge
