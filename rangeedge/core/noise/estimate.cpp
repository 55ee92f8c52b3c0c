// SPDX-License-Identifier: Apache-2.0
#include "noise/estimate.hpp"

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "noise/least_squares.hpp"
#include "noise/quantum.hpp"
#include "noise/single.hpp"

namespace rangeedge {
namespace {

constexpr double finest = 3e-5;  // of the distance, or of the range of heights: no range sensor resolves more

// One deviation for all heights.
Deviation of_heights(const SingleNoise& found, double rounding) {
    const double extent = found.highest > found.lowest ? found.highest - found.lowest : 1;
    return {std::max({found.deviation, finest * extent, rounding}), 0, 0, 0};
}

// Raises a deviation by a constant, so that at both ends of the depths found it is at least `least` of the depth.
template <class Least>
void raise_to(Deviation& deviation, const SingleNoise& found, const Least& least) {
    for (const double z : {1 / found.highest, 1 / found.lowest}) {
        const double lack = least(z) - deviation.of_length(z);
        if (lack > 0) deviation.c0 += lack;
    }
}

// a + c z^2 by bins of depth; of the distance where nothing tells it.
Deviation of_depths(const SingleNoise& found, double rounding) {
    std::vector<double> depths, deviations;
    for (std::size_t i = 0; i < found.ordinates.size(); ++i) {
        const double z = 1 / found.ordinates[i];
        const double deviation = std::max({found.deviations[i] * z * z, finest * z, rounding});
        if (!std::isfinite(deviation)) continue;
        depths.push_back(z);
        deviations.push_back(deviation);
    }
    if (depths.empty()) return {rounding, finest, 0, 0};
    Deviation fitted = fitted_deviation(depths, deviations, {0, 2});
    raise_to(fitted, found, [&](double z) { return std::max(rounding, std::min(finest * z, 1e300)); });
    return fitted;
}

}  // namespace

template <class T>
NoiseEstimate estimate_noise(const T* ordinate, int rows, int cols, bool projective, double step, int threads) {
    Team team(std::min(threads, 2));  // for more there is too little to do
    const SingleNoise found = single_noise(ordinate, rows, cols, projective, team);
    if (projective && !(step > 0)) step = rounding_step(ordinate, rows, cols);
    const double rounding = step / std::sqrt(12.0);
    NoiseEstimate estimate;
    estimate.single = projective ? of_depths(found, rounding) : of_heights(found, rounding);
    // Of the noise of neighbours nothing is to be seen.
    const double middle = (found.lowest + found.highest) / 2, extent = found.highest - found.lowest;
    const bool silent = found.quiet <= finest * (projective ? std::abs(middle) : extent);
    estimate.fits = fit_noise(ordinate, rows, cols, projective, estimate.single, silent, team);
    // Over many samples rounding errs as much as over few where it takes a while from one value to the next. Of heights
    // the waves are as large as the deviation of single values, in which rounding is.
    if (projective) raise_to(estimate.fits.waves, found, [&](double) { return rounding; });
    return estimate;
}

template NoiseEstimate estimate_noise(const float*, int, int, bool, double, int);
template NoiseEstimate estimate_noise(const double*, int, int, bool, double, int);

}  // namespace rangeedge
