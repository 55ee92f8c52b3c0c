// Splitting of scan lines into segments (paper, 4.1 and Fig. 3), after Duda and Hart.
//
// The quadratic f(x) = a x^2 + b x + c through both end points and the midpoint of a run approximates it. Where the
// largest residual |y - f(x)| exceeds epsilon the run is cut there, and both parts are treated the same way.
//
// The paper leaves open to which part the sample of the largest residual belongs. Here a cut falls between two samples:
// this one goes with the neighbour whose value is closer, since on a jump one of the two lies on the other surface. A
// line is also cut where samples have no data, but for small holes (bridge.hpp). No rule prefers a side, so that a
// mirrored line is cut at the same places. Instead of by recursion the segments of one generation, of all lines of a
// strip, are split in turn, so that a processor works on several at a time; the result is the same.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstddef>

#include "base/array.hpp"
#include "scanline/segment.hpp"

namespace rangeedge {

// The first sample at or after k, and before n, that is valid or is not; else n. NaN marks a sample without data.
// `padding` samples beyond n may be read.
int find_valid(const float* y, int k, int n);
int find_invalid(const float* y, int k, int n);
inline int find_valid(const double* y, int k, int n) {
    while (k < n && !(y[k] == y[k])) ++k;
    return k;
}
inline int find_invalid(const double* y, int k, int n) {
    while (k < n && y[k] == y[k]) ++k;
    return k;
}

// Calls visit(first, last) for every maximal stretch of valid samples, cut where the abscissa does not increase.
template <class T, class Visit>
void for_each_run(const T* y, const T* x, int n, Visit&& visit) {
    for (int k = find_valid(y, 0, n); k < n; k = find_valid(y, k, n)) {
        const int end = find_invalid(y, k, n);
        while (k < end) {
            const int first = k++;
            if (!x) k = end;
            while (k < end && x[k] > x[k - 1]) ++k;
            visit(first, k - 1);
        }
    }
}

// The samples of one scan line. `x` is null where they are one unit apart; `scale` is null where one tolerance holds
// for all, else it multiplies each residual. Of `y` and `scale` `padding` samples beyond the last one may be read.
template <class T>
struct Samples {
    const T* y;
    const T* x;
    const T* scale;
    int size;
    T eps;

    T width(int i, int k) const { return x ? x[k] - x[i] : static_cast<T>(k - i); }
};

// The middle sample of a segment; of two, the one closer to the straight line between the ends, which is computed from
// either end alike. Where they lie equally far on either side of that line it is the curve itself, and the first sample
// is returned.
template <class T>
int midpoint(const Samples<T>& line, const Segment& s) {
    const int m = s.left_middle(), n = s.right_middle();
    const T slope = (line.y[s.last] - line.y[s.first]) / line.width(s.first, s.last);
    const T left = line.y[m] - line.y[s.first] - slope * line.width(s.first, m);
    const T right = line.y[n] - line.y[s.last] + slope * line.width(n, s.last);
    if (m < n && left == -right && left != 0) return s.first;
    return std::abs(right) < std::abs(left) ? n : m;
}

// Splits strip after strip of lines; what it needs for that is reused.
template <class T>
class Splitter {
public:
    void clear();
    void add(const Samples<T>& line);
    void split();

    // Calls visit(segment) in order for those of the i-th line that was added.
    template <class Visit>
    void for_each_segment(std::ptrdiff_t i, Visit&& visit) const {
        for (int k = heads_[i]; k >= 0; k = nodes_[k].next) visit(nodes_[k].segment);
    }

    // A segment, its line, and the next segment there or -1.
    struct Node {
        Segment segment;
        int line, next;
    };
    // A node to be cut, and the samples of its largest residual, the first and the last of equals.
    struct Worst {
        int node, first, last;
    };

private:
    void find_worst();

    Array<Samples<T>> lines_;
    Array<Node> nodes_;
    Array<int> heads_;                // the first node of each line
    Array<int> pending_, following_;  // nodes of this generation, and of the next one
    Array<Worst> worst_;              // of those pending that are to be cut
};

}  // namespace rangeedge
