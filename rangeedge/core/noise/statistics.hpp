// The noise of a range image from the image itself. The paper chooses its threshold for every scanner by hand (paper,
// 6).
//
// Third differences along rows and columns vanish on every quadratic, as curves of scan lines are. Of independent noise
// they have sqrt(1 + 9 + 9 + 1) times its deviation. Those across edges are few and large: the smaller three quarters
// count, corrected for the trimming. Noise of neighbours may be correlated: differences of samples six apart show it in
// full. Since it changes with depth, the deviation is found for bins of ordinates as well.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

namespace rangeedge {

// Deviations of ordinates, as of independent noise.
struct NoiseStatistics {
    double near = 0, far = 0;        // from differences of neighbours, and of samples six apart
    double lowest = 0, highest = 0;  // ordinate
    // By ordinate, in bins of as many differences each: the median ordinate, and the deviation.
    std::vector<double> ordinates, deviations;
};

// Of an image with NaN where there is no data. Edges are few among differences, so the smaller three quarters count.
template <class T>
NoiseStatistics noise_statistics(const T* ordinate, int rows, int cols, int threads);

}  // namespace rangeedge
