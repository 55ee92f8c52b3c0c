// The noise of fits as a function of their number of samples (image/noise.hpp), measured from the image itself.
//
// Straight lines are fitted to three adjacent windows of n samples each, n = 4, 8, 16, 32, in scan lines all over the
// image. With their means z and slopes s, the differences
//
//     D = s1 - 2 s2 + s3   and   G = z1 - 2 z2 + z3 - (s3 - s1) n / 2,
//
// of the steps in slope, and in value, at the two borders, vanish on every quadratic. Where there is no edge they are
// noise alone, and for white noise of the deviation sigma_n have the deviations
//
//     sd D = sigma_n sqrt(6 / m2),   sd G = sigma_n sqrt(6 / n + n^2 / (2 m2)),   m2 = n (n^2 - 1) / 12.
//
// What their medians exceed that by are the factors of n: edges are few enough not to move these. Means of D and G over
// five neighbouring scan lines, times sqrt(5), tell the shared factors, which are the same for noise that is
// independent from line to line. |D| for n = 16, by depth, tells how the waves grow with it. Windows whose values are
// all equal say nothing where there is noise. The residuals of quadratics over 64 samples tell how far samples lie off
// fits that are longer than the waves.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "image/noise.hpp"

namespace rangeedge {

class Team;

struct FitNoiseEstimate {
    Deviation waves;
    double rows[FitNoise::size], cols[FitNoise::size];  // what FitNoise takes
};

// Of an image of ordinates whose single values are off by `single`, or by nothing that could be seen (`silent`).
template <class T>
FitNoiseEstimate fit_noise(const T* ordinate, int rows, int cols, bool projective, const Deviation& single, bool silent,
                           Team& team);

}  // namespace rangeedge
