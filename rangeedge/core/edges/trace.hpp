// One scan line as the detector sees it, with every number that its tests compare: why a cut is a candidate, or none.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "image/frame.hpp"
#include "scanline/options.hpp"

namespace rangeedge {

// A cut between two segments, before and after the tests on it alone (paper, 4.2).
struct CutTrace {
    double cut, sample;                   // where splitting has it, and its position, counted in samples
    double before, after;                 // samples on either side of the position
    double jump, crease;                  // length, degrees, before the tests
    double difference, tolerance;         // of ordinates; a jump exceeds twice the tolerance
    double jump_single, jump_shared;      // significances by one line, and as one of several neighbours
    double crease_single, crease_shared;  // likewise
    double jumps, smooth, bends;          // whether it is a jump; samples run on too smoothly for one, or for a crease
    double convex, smeared, outline;      // its kind; whether it is a smeared step, or the end of a surface at a gap
    double candidate;                     // whether it passed
};

// A sample; the abscissa and ordinates are those of the approximation (line.hpp), NaN where there is no data.
struct SampleTrace {
    double col, row, abscissa, ordinate, depth, fitted, fitted_depth, tolerance, tolerance_depth;
};

// A segment and its curve z = a t^2 + b t + c with t = abscissa - mean.
struct SegmentTrace {
    double first, last, mean, a, b, c;
};

struct LineTrace {
    std::vector<SampleTrace> samples;
    std::vector<SegmentTrace> segments;
    std::vector<CutTrace> cuts;
};

// The line of a direction through a pixel.
template <class T>
LineTrace trace_line(const Frame<T>& frame, const ScanLineOptions& options, int direction, int col, int row);

}  // namespace rangeedge
