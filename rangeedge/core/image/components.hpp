// Connected components of an image, as runs of pixels in rows.
//
// One pass over the image finds the runs of equal values and joins each one with those of the row above that touch it,
// in a forest whose roots are the first runs of components (union and find); a second pass over the runs numbers the
// components and sorts the runs by them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "base/disjoint_sets.hpp"
#include "base/watch.hpp"

namespace rangeedge {

// Components of equal values other than 0, in raster order of first pixels. Images have a margin of one pixel, all 0,
// and pixels are known by their index there.
class Components {
public:
    struct Run {
        int begin, end;  // pixels [begin, end)
    };
    struct Range {
        const Run *first, *last;
        const Run* begin() const { return first; }
        const Run* end() const { return last; }
    };

    // `connectivity` is 4 or 8; `wrap` says that the first column follows the last.
    template <class T>
    Components(const T* image, int rows, int cols, int connectivity = 4, bool wrap = false) : stride_(cols + 2) {
        const int stride = stride_, reach = connectivity == 8;
        std::vector<Run> found;
        DisjointSets sets;      // of runs; the first in raster order represents each
        std::size_t above = 0;  // first run that may touch the next one from the row above
        for (int row = 0; row < rows; ++row) {
            Watch::checkpoint();
            const std::size_t row_begin = found.size();
            int p = (row + 1) * stride + 1;
            for (const int end = p + cols; (p = find_value(image, p, end)) < end;) {
                const int begin = p;
                const T value = image[begin];
                while (image[p] == value) ++p;
                const Run run{begin, p};
                const std::size_t i = found.size();
                found.push_back(run);
                sets.add();
                while (above < row_begin && found[above].end + stride + reach <= run.begin) ++above;
                for (std::size_t k = above; k < row_begin && found[k].begin + stride < run.end + reach; ++k) {
                    if (image[found[k].begin] != value) continue;
                    join(sets, k, i);
                }
            }
            above = row_begin;
        }
        if (wrap) join_around(image, rows, cols, reach, found, sets);
        sort(found, sets);
    }

    int count() const { return static_cast<int>(areas_.size()); }
    int area(int i) const { return areas_[static_cast<std::size_t>(i)]; }
    // Of a pixel, without the margin.
    int row_of(int pixel) const { return pixel / stride_ - 1; }
    int col_of(int pixel) const { return pixel % stride_ - 1; }
    // Its runs in raster order.
    Range runs(int i) const {
        const auto k = static_cast<std::size_t>(i);
        return {runs_.data() + starts_[k], runs_.data() + starts_[k + 1]};
    }

private:
    // The first pixel from p, and before `end`, that is not 0; else `end`.
    template <class T>
    static int find_value(const T* image, int p, int end) {
        std::uint64_t word;
        constexpr int step = sizeof word / sizeof(T);
        while (p + step <= end && (std::memcpy(&word, image + p, sizeof word), !word)) p += step;
        while (p < end && !image[p]) ++p;
        return p;
    }

    static void join(DisjointSets& sets, std::size_t a, std::size_t b) {
        const auto [low, high] = std::minmax({sets.find(static_cast<int>(a)), sets.find(static_cast<int>(b))});
        sets.link(high, low);
    }

    // Joins runs that end in the last column with those of the same row, or one up to `reach` away, in the first.
    template <class T>
    void join_around(const T* image, int rows, int cols, int reach, const std::vector<Run>& found, DisjointSets& sets) {
        constexpr std::size_t none = ~std::size_t{0};
        std::vector<std::size_t> in_first(static_cast<std::size_t>(rows), none), in_last = in_first;
        for (std::size_t i = 0; i < found.size(); ++i) {
            const auto row = static_cast<std::size_t>(row_of(found[i].begin));
            if (col_of(found[i].begin) == 0) in_first[row] = i;
            if (col_of(found[i].end) == cols) in_last[row] = i;
        }
        for (int row = 0; row < rows; ++row) {
            const std::size_t left = in_last[static_cast<std::size_t>(row)];
            for (int other = std::max(row - reach, 0); left != none && other <= std::min(row + reach, rows - 1);
                 ++other) {
                const std::size_t right = in_first[static_cast<std::size_t>(other)];
                if (right != none && image[found[left].begin] == image[found[right].begin]) join(sets, left, right);
            }
        }
    }

    void sort(const std::vector<Run>& found, DisjointSets& sets) {
        std::vector<std::size_t> sizes, component(found.size());
        Checkpoints checkpoints;
        for (std::size_t i = 0; i < found.size(); ++i) {
            checkpoints.pass();
            const auto root = static_cast<std::size_t>(sets.find(static_cast<int>(i)));
            if (root == i) {
                component[i] = areas_.size();
                areas_.push_back(0);
                sizes.push_back(0);
            } else {
                component[i] = component[root];
            }
            areas_[component[i]] += found[i].end - found[i].begin;
            ++sizes[component[i]];
        }
        starts_.assign(1, 0);
        for (const std::size_t size : sizes) starts_.push_back(starts_.back() + size);
        runs_.resize(found.size());
        auto next = starts_;
        for (std::size_t i = 0; i < found.size(); ++i) runs_[next[component[i]]++] = found[i];
    }

    int stride_;
    std::vector<Run> runs_;            // by component
    std::vector<std::size_t> starts_;  // of components in runs_
    std::vector<int> areas_;
};

}  // namespace rangeedge
