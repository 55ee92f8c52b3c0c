// Merges the segments of split scan lines.
//
// The paper uses "the splitting algorithm without any merging" (paper, 4.1). We merge for the sake of noisy images:
// cuts are taken back, cheapest first, as long as the squared residuals, in variances of the noise, rise by less than
// the square of `merge_significance`. Then segments that bridge an edge are removed: splitting may cut on either side
// of it, or of its rounding, and leave a short segment across it where one cut would do.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstddef>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/array.hpp"
#include "scanline/curve.hpp"
#include "scanline/line.hpp"
#include "scanline/segment_list.hpp"

namespace rangeedge {

// Lists of segments, each standing for the cut on its right; reused from strip to strip.
struct MergeBuffers {
    Array<int> cuts, chosen;
};

// `List` is EvenSegments or UnevenSegments.
template <class T, class List>
class Merger {
public:
    // Significance in standard deviations; with 0 nothing is merged.
    Merger(const std::vector<Line<T>>& lines, double significance, List& list, MergeBuffers& buffers)
        : lines_(lines), limit_(significance * significance), list_(list), end_(list.end()), cuts_(buffers.cuts),
          chosen_(buffers.chosen) {}

    // Takes back cuts until each one left lowers the sum of squares enough: in every round those that cost less than
    // the cuts beside them.
    void merge();
    // Removes segments where the curves beside them intersect within them and, given their samples, explain these
    // nearly as well: in every round those that cost less than any other whose surfaces they would change.
    void remove_bridges(Array<Curve>& curves);

private:
    int& previous(int i) { return list_.links[i].previous; }
    int& next(int i) { return list_.links[i].next; }
    bool& chosen(int i) { return list_.links[i].chosen; }
    Segment& segment(int i) { return list_.links[i].segment; }
    double& residual(int i) { return list_.residual[i]; }
    double& cost(int i) { return list_.cost[i]; }
    const Line<T>& line_of(int i) { return lines_[static_cast<std::size_t>(list_.links[i].line)]; }

    void choose();
    void remove(int i);
    // What becomes of the segments beside a bridge that is removed: the last sample of the left one, and their sums.
    using Sums = std::decay_t<decltype(std::declval<const List&>().sums(0))>;
    struct Sides {
        int cut = 0;
        Sums left{}, right{};
        double cost = HUGE_VAL;  // rise of the sum of squares, in variances; infinite where the segment is no bridge
    };
    Sides sides_without(int i, const Array<Curve>& curves);
    bool cheapest_bridge(int i);
    void remove_bridge(int i, Array<Curve>& curves, Array<int>& changed);
    double least_of(int i, const Sums& sums);
    void set_sums(int i, const Sums& sums);

    const std::vector<Line<T>>& lines_;
    double limit_;  // variances
    List& list_;
    int end_;
    Array<int>&cuts_, &chosen_;
};

}  // namespace rangeedge
