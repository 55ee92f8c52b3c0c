// Scan line approximation: every line becomes a sequence of segments, each with its curve.
//
// Lines are split (paper, 4.1), and a curve is fitted to every segment (paper, 4.2, end). The paper merges nothing,
// since cuts on smooth surfaces give weak edges. They are many, though, and every segment more makes curves less
// certain: here cuts are taken back where the noise explains what they gain, and segments that bridge an edge are given
// to the surfaces beside it.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>

#include "base/array.hpp"
#include "scanline/curve.hpp"
#include "scanline/line.hpp"
#include "scanline/merge.hpp"
#include "scanline/options.hpp"
#include "scanline/segment_list.hpp"
#include "scanline/split.hpp"

namespace rangeedge {

// The segments of one line and their curves.
struct Approximation {
    const Segment* segments;
    const Curve* curves;
    std::ptrdiff_t count;

    Fit fit(std::ptrdiff_t i) const { return {curves[i], segments[i].size()}; }
};

// Approximates strip after strip; what it needs for that is reused.
template <class T>
class Approximator {
public:
    explicit Approximator(const ScanLineOptions& options) : options_(options) {}

    void approximate(const Strip<T>& strip);
    // Of the i-th line; holds until the next call of `approximate`.
    Approximation line(std::ptrdiff_t i) const {
        const std::ptrdiff_t first = found_.starts[i];
        return {found_.segments.data() + first, found_.curves.data() + first, found_.starts[i + 1] - first};
    }

private:
    void split(const Strip<T>& strip);
    void interpolate(const Strip<T>& strip);
    template <class List>
    void fit_and_merge(const Strip<T>& strip, List& list);

    const ScanLineOptions& options_;
    Splitter<T> splitter_;
    StripSegments found_;
    EvenSegments even_;
    UnevenSegments uneven_;
    MergeBuffers buffers_;
};

}  // namespace rangeedge
