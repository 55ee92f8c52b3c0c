// A quantity along a chain, of which several samples are known at every place: an affine function of the position where
// that is all they tell, else a parabola through those nearby.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>

#include "base/array.hpp"

namespace rangeedge {

// What is known of one quantity: `place` counts along the chain, ascending.
struct ChannelSample {
    std::ptrdiff_t place;
    double position, value, weight;
};

struct AffineFit {
    double centre, value, slope;  // value + slope (position - centre)
    bool fits;                    // no part of the chain lies aside, by the scatter within the parts

    double at(double position) const { return value + slope * (position - centre); }
};

// Robust, by leaving out what lies far off. `allowed` may any part lie aside.
AffineFit fit_affine(const Array<ChannelSample>& samples, double allowed);

// The value at each of `places` places, by parabolas over those up to `reach` away. NaN where nothing is known.
void smooth_parabolas(const Array<ChannelSample>& samples, std::ptrdiff_t places, bool closed, int reach,
                      Array<double>& values);

}  // namespace rangeedge
