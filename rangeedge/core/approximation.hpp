// A scan line as a sequence of segments, each with its curve.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "fit.hpp"
#include "line.hpp"
#include "scanline.hpp"

namespace rangeedge {

struct Approximation {
    std::vector<Segment> segments;
    std::vector<Curve> curves;
};

// A segment while segments are joined: a linked list, of which the first one stays.
template <class Sums>
struct Piece {
    Segment segment;
    int previous, next;
    Sums sums;
    double least;    // significance of a quadratic term, in the unit of the ordinates
    double squares;  // of the residuals
    double cost;     // of taking back the cut on the right
};

// A segment that may be joined with the next one, and what that costs.
struct Join {
    double cost;
    int left;
    // The cheapest, and of equals the leftmost, is on top of a heap.
    bool operator<(const Join& other) const { return cost != other.cost ? cost > other.cost : left > other.left; }
};

// Approximates line after line; what it needs for that is reused.
template <class T>
class Approximator {
public:
    explicit Approximator(const Parameters& parameters) : parameters_(parameters) {}

    // Splits the line (section 4.1), fits a curve to every segment (4.2, end), takes back cuts that the noise
    // explains, and gives segments that lie across an edge to the surfaces beside it. Holds until the next call.
    const Approximation& approximate(const Line<T>& line);

private:
    void split(const Line<T>& line);
    void interpolate(const Line<T>& line);
    template <class Sums>
    void fit(const Line<T>& line, std::vector<Piece<Sums>>& pieces);

    Parameters parameters_;
    Approximation result_;
    std::vector<Segment> pending_;
    std::vector<Piece<Projections>> even_;  // of samples one unit apart
    std::vector<Piece<Moments>> uneven_;
    std::vector<Join> cheap_;
};

// Where f and g meet, the place nearest `near`; false where they do not.
bool intersection(const Curve& f, const Curve& g, double near, double& x);

}  // namespace rangeedge
