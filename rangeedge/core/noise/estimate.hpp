// The noise of a range image from the image itself: that of single values (single.hpp) as a + c z^2, and that of fits
// (fits.hpp).
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "noise/fits.hpp"

namespace rangeedge {

struct NoiseEstimate {
    Deviation single;
    FitNoiseEstimate fits;
};

// Of ordinates, NaN without data, which were rounded to multiples of `step` as lengths (0: to those of the step they
// show).
template <class T>
NoiseEstimate estimate_noise(const T* ordinate, int rows, int cols, bool projective, double step, int threads);

}  // namespace rangeedge
