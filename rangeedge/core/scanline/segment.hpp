// A segment of a scan line: its first and last sample.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace rangeedge {

struct Segment {
    int first, last;

    int size() const { return last - first + 1; }
    // The samples in the middle, which are one where their number is odd.
    int left_middle() const { return first + (last - first) / 2; }
    int right_middle() const { return last - (last - first) / 2; }
    // The sample from which sums over the segment are counted.
    int reference() const { return first + size() / 2; }
};

}  // namespace rangeedge
