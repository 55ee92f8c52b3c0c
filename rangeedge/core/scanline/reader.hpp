// Reads the scan lines of a range image: their samples, where they lie in their plane, and how far a curve may be off
// each sample.
//
// The paper splits with one epsilon for all images of a scanner (paper, 6). Here the tolerance of a sample is, unless
// it is given as a length, a multiple of the standard deviation of its noise; both are turned into ordinates there.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "image/frame.hpp"
#include "scanline/line.hpp"
#include "scanline/options.hpp"

namespace rangeedge {

template <class T>
class LineReader {
public:
    LineReader(const Frame<T>& frame, const ScanLineOptions& options) : frame_(frame), options_(options) {}

    // The lines first to first + count - 1 of a direction. Read together they share the cache lines of the image.
    void read(int direction, int first, int count, Strip<T>& strip) const;

private:
    void locate(Line<T>& line) const;
    void take_rows(Strip<T>& strip) const;
    void transpose(Strip<T>& strip) const;
    void read_points(Line<T>& line, T* x, T* y) const;
    void read_curved(Line<T>& line, T* x, T* y) const;
    void set_tolerance(Line<T>& line, T* scale) const;
    void bridge(Strip<T>& strip) const;

    const Frame<T>& frame_;
    const ScanLineOptions& options_;
};

}  // namespace rangeedge
