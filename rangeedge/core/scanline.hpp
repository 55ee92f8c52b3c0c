// Scan line approximation (paper, section 4.1): one scan line, a curve in a plane, is split into segments.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <vector>

namespace rangeedge {

// A curve segment: its first and last sample.
struct Segment {
    int first, last;
    int size() const { return last - first + 1; }
};

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
// either end alike, so that no side is preferred. Where they lie equally far on either side of that line it is the curve
// itself, and the first sample is returned.
template <class T>
int midpoint(const Samples<T>& line, const Segment& s) {
    const int half = (s.last - s.first) / 2, m = s.first + half, n = s.last - half;
    const T slope = (line.y[s.last] - line.y[s.first]) / line.width(s.first, s.last);
    const T left = line.y[m] - line.y[s.first] - slope * line.width(s.first, m);
    const T right = line.y[n] - line.y[s.last] + slope * line.width(n, s.last);
    if (m < n && left == -right && left != 0) return s.first;
    return std::abs(right) < std::abs(left) ? n : m;
}

// Splits runs of valid samples into segments whose residuals against the quadratic through both end points and the
// midpoint stay within `eps`. Lines are split together, all segments of one generation in turn, so that a processor
// works on several at a time. What it needs is reused.
template <class T>
class Splitter {
public:
    void clear();
    void add(const Samples<T>& line);
    void split();

    // Calls visit(segment) in order for those of the i-th line that was added.
    template <class Visit>
    void for_each_segment(std::size_t i, Visit&& visit) const {
        for (int k = heads_[i]; k >= 0; k = nodes_[static_cast<std::size_t>(k)].next)
            visit(nodes_[static_cast<std::size_t>(k)].segment);
    }

    // A segment, its line, and the next segment there or -1.
    struct Node {
        Segment segment;
        int line, next;
    };
    // A node to be cut, and where its residual is largest: the first and the last of equal ones.
    struct Worst {
        int node, first, last;
    };

private:
    void find_worst_of_pending();

    std::vector<Samples<T>> lines_;
    std::vector<Node> nodes_;
    std::vector<int> heads_;                // the first node of each line
    std::vector<int> pending_, following_;  // nodes of this generation, and of the next one
    std::vector<Worst> worst_;              // of those pending that are to be cut
};

}  // namespace rangeedge
