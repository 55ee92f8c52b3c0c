// A scan line as a sequence of segments, each with its curve.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "fit.hpp"
#include "line.hpp"
#include "scanline.hpp"

namespace rangeedge {

// A segment that may be joined with the next one, and what that costs.
struct Join {
    double cost;
    int left;
    // The cheapest, and of equals the leftmost, is on top of a heap.
    bool operator<(const Join& other) const { return cost != other.cost ? cost > other.cost : left > other.left; }
};

// The approximation of one line, and the scratch that making it needs; reused from line to line.
struct Approximation {
    std::vector<Segment> segments;
    std::vector<Curve> curves;
    std::vector<Moments> moments;
    std::vector<Segment> pending;
    std::vector<int> previous, next;  // of each segment while segments are joined
    std::vector<double> costs;        // of taking back the cut on the right
    std::vector<Join> cheap;
};

// Splits the line (section 4.1), fits a curve to every segment (4.2, end), takes back cuts that the noise explains,
// and gives segments that lie across an edge to the surfaces beside it.
template <class T>
void approximate(const Line<T>& line, const Parameters& parameters, Approximation& result);

// Where f and g meet, the place nearest `near`; false where they do not.
bool intersection(const Curve& f, const Curve& g, double near, double& x);

}  // namespace rangeedge
