// A segment of a scan line: its first and last sample.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace rangeedge {

struct Segment {
    int first, last;

    int size() const { return last - first + 1; }
    // The midpoint through which splitting and interpolation lay their curve, the left one of two (paper, 4.1).
    int midpoint() const { return first + (last - first) / 2; }
    // The sample whose noise stands for the segment, and from which sums over it are counted; the right one of two.
    int reference() const { return first + size() / 2; }
};

}  // namespace rangeedge
