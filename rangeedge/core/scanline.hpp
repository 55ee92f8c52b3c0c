// Scan line approximation (paper, section 4.1): one scan line, a curve in a plane, is split into segments.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstring>
#include <vector>

namespace rangeedge {

// A curve segment: its first and last sample.
struct Segment {
    int first, last;
    int size() const { return last - first + 1; }
};

// One run of valid samples. `x` is null where samples are one unit apart, else strictly increasing.
// `scale` is null where one tolerance holds for the whole run, else it multiplies each residual. Of `y` and `scale`
// a few samples beyond the last one may be read.
template <class T>
struct Run {
    const T* y;
    const T* x;
    const T* scale;
    int first, last;
};

// Splits a run into segments whose residuals against the quadratic through both end points and the midpoint
// stay within `eps`; appends them to `segments` in order. `pending` is scratch, left empty.
template <class T>
void split_run(const Run<T>& run, T eps, std::vector<Segment>& pending, std::vector<Segment>& segments);

// The first sample at or after k, and before n, that is valid or is not; else n. NaN marks a sample without data.
template <bool valid, class T>
int find(const T* y, int k, int n) {
    typedef T Lanes __attribute__((vector_size(16)));
    constexpr int count = 4 * sizeof(Lanes) / sizeof(T);
    const auto found_in_lanes = [y](int first) {
        Lanes lanes[4];
        std::memcpy(lanes, y + first, sizeof lanes);
        auto invalid = lanes[0] != lanes[0];
        for (int i = 1; i < 4; ++i) {
            const auto also = lanes[i] != lanes[i];
            invalid = valid ? invalid & also : invalid | also;
        }
        long long halves[2];
        std::memcpy(halves, &invalid, sizeof halves);
        return valid ? (halves[0] & halves[1]) != -1 : (halves[0] | halves[1]) != 0;
    };
    while (k + count <= n && !found_in_lanes(k)) k += count;
    while (k < n && (y[k] == y[k]) != valid) ++k;
    return k;
}

// Calls visit(first, last) for every maximal stretch of valid samples, cut where the abscissa does not increase.
template <class T, class Visit>
void for_each_run(const T* y, const T* x, int n, Visit&& visit) {
    for (int k = find<true>(y, 0, n); k < n; k = find<true>(y, k, n)) {
        const int end = find<false>(y, k, n);
        while (k < end) {
            const int first = k++;
            if (!x) k = end;
            while (k < end && x[k] > x[k - 1]) ++k;
            visit(first, k - 1);
        }
    }
}

}  // namespace rangeedge
