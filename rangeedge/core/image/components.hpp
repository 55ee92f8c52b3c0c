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
#include "base/parallel.hpp"
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
        std::vector<Run> found;
        for (int row = 0; row < rows; ++row) find_runs(image, row, cols, found);
        join_and_sort(image, rows, cols, connectivity == 8, wrap, found);
    }
    // Likewise, 4-connected, on all threads of a team.
    template <class T>
    Components(const T* image, int rows, int cols, Team& team) : stride_(cols + 2) {
        std::vector<std::vector<Run>> of_threads(static_cast<std::size_t>(team.size()));
        parallel_for(rows, team, [&](int first, int last, int thread) {
            for (int row = first; row < last; ++row)
                find_runs(image, row, cols, of_threads[static_cast<std::size_t>(thread)]);
        });
        std::vector<Run> found = std::move(of_threads.front());
        for (std::size_t k = 1; k < of_threads.size(); ++k)
            found.insert(found.end(), of_threads[k].begin(), of_threads[k].end());
        join_and_sort(image, rows, cols, 0, false, found);
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

    template <class T>
    void find_runs(const T* image, int row, int cols, std::vector<Run>& found) const {
        Watch::checkpoint();
        int p = (row + 1) * stride_ + 1;
        for (const int end = p + cols; (p = find_value(image, p, end)) < end;) {
            const int begin = p;
            const T value = image[begin];
            while (image[p] == value) ++p;
            found.push_back({begin, p});
        }
    }

    // Runs in raster order become components.
    template <class T>
    void join_and_sort(const T* image, int rows, int cols, int reach, bool wrap, const std::vector<Run>& found) {
        DisjointSets sets(static_cast<int>(found.size()));  // of runs; the first in raster order represents each
        std::size_t above = 0;                              // first run that may touch the next one from the row above
        Checkpoints checkpoints;
        for (std::size_t i = 0; i < found.size(); ++i) {
            checkpoints.pass();
            const Run above_run{found[i].begin - stride_ - reach, found[i].end - stride_ + reach};
            while (found[above].end <= above_run.begin) ++above;
            for (std::size_t k = above; k < i && found[k].begin < above_run.end; ++k)
                if (image[found[k].begin] == image[found[i].begin]) join(sets, k, i);
        }
        if (wrap) join_around(image, rows, cols, reach, found, sets);
        sort(found, sets);
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
