// The noise of fits as a function of their number of samples (image/noise.hpp), measured from the image itself.
//
// Straight lines are fitted to two adjacent windows of n samples each, n = 4, 8, 16, 32, in scan lines all over the
// image. Where there is no edge, the difference D of their slopes and the gap G of their values at the common border
// are noise alone, and for white noise of the deviation sigma_n have the deviations
//
//     sd D = sigma_n sqrt(2 / m2),   sd G = sigma_n sqrt(2 (1 / n + (n / 2)^2 / m2)),   m2 = n (n^2 - 1) / 12.
//
// What their medians exceed that by are the factors of n: edges are few enough not to move these. Means of D and G over
// five neighbouring scan lines, times sqrt(5), tell the shared factors, which are the same for noise that is independent
// from line to line. |D| for n = 16, by depth, tells how the waves grow with it. Windows whose values are all equal say
// nothing. The residuals of quadratics over 64 samples tell how far samples lie off fits that are longer than waves.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "image/noise.hpp"

namespace rangeedge {

struct FitNoiseEstimate {
    Deviation waves;
    double rows[FitNoise::size], cols[FitNoise::size];  // what FitNoise takes
};

// Of an image of ordinates whose single values are off by `single`.
template <class T>
FitNoiseEstimate fit_noise(const T* ordinate, int rows, int cols, bool projective, const Deviation& single,
                           int threads);

}  // namespace rangeedge
