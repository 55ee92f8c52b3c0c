// The noise of single values, as neighbours tell it: from third differences
//
//     y0 - 3 y1 + 3 y2 - y3
//
// along rows and columns, which vanish on every quadratic, and have sqrt(20) times the deviation of white noise. Edges
// are few among them, so that the smaller three quarters count (trimmed.hpp).
//
// Eight equal values in a row say nothing of the noise: they belong to filled holes, a saturated or a simulated
// background. The four in their middle do not count, and next to 32 of them nothing does. Where values are whole
// multiples of a step, many neighbours are equal that belong to a slope; then the step, the least difference other than
// zero, bounds the deviation by that of rounding, step / sqrt(12). But where nearly all of an image is constant, and
// its few levels meet in clean steps, there is no noise. Where no four neighbours have data, as on a chequered mask,
// samples two, three or four apart are taken for neighbours.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

namespace rangeedge {

class Team;

// Of ordinates.
struct SingleNoise {
    double deviation = 0;            // of the whole image; 0 where nothing tells it
    double quiet = 0;                // the same of the quieter windows, where not even these are off by a step
    double lowest = 0, highest = 0;  // ordinate
    // Where asked for, by ordinate, in bins of as many differences each: the mean ordinate, and the deviation.
    std::vector<double> ordinates, deviations;
};

// Of an image with NaN where there is no data. `by_ordinate` asks for positive ordinates only.
template <class T>
SingleNoise single_noise(const T* ordinate, int rows, int cols, bool by_ordinate, Team& team);

}  // namespace rangeedge
