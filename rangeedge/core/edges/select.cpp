// SPDX-License-Identifier: Apache-2.0
#include "edges/select.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "base/simd.hpp"
#include "base/watch.hpp"
#include "edges/candidate.hpp"
#include "image/components.hpp"

namespace rangeedge {
namespace {

// The least strength that reaches a threshold, which may be 0 or more than a float holds.
float least_reaching(double threshold) {
    using Limits = std::numeric_limits<float>;
    if (threshold > static_cast<double>(Limits::max())) return Limits::infinity();
    return std::max(static_cast<float>(threshold), Limits::denorm_min());
}

RANGEEDGE_WIDE void flag_reaching(const float* strength, int n, float least, std::uint8_t* flags) {
    for (int i = 0; i < n; ++i) flags[i] = strength[i] >= least;
}

// `flags` may be read one before and after.
RANGEEDGE_WIDE void count_in_row(const std::uint8_t* flags, int n, std::uint8_t* counts) {
    for (int i = 0; i < n; ++i) counts[i] = static_cast<std::uint8_t>(flags[i - 1] + flags[i] + flags[i + 1]);
}

RANGEEDGE_WIDE void select_in_row(const std::uint8_t* jumps, const std::uint8_t* kind, const std::uint8_t* creases,
                                  const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below, int n,
                                  std::uint8_t* edges) {
    for (int i = 0; i < n; ++i) {
        const int nearer = (kind[i] & occluding_bit) != 0, joined = above[i] + here[i] + below[i] >= company;
        edges[i] = static_cast<std::uint8_t>((jumps[i] & nearer) | (creases[i] & joined));
    }
}

// An edge map, 0 and 1, with the margin of one pixel that components need.
struct EdgeMap {
    int rows, cols;
    bool wrap;
    std::size_t stride;
    std::vector<std::uint8_t> pixels;

    EdgeMap(int map_rows, int map_cols, bool wrapped)
        : rows(map_rows), cols(map_cols), wrap(wrapped), stride(static_cast<std::size_t>(cols) + 2),
          pixels(stride * (static_cast<std::size_t>(rows) + 2), 0) {}

    std::uint8_t* row(int i) { return pixels.data() + stride * (static_cast<std::size_t>(i) + 1) + 1; }
    const std::uint8_t* row(int i) const { return pixels.data() + stride * (static_cast<std::size_t>(i) + 1) + 1; }
    Components components() const { return Components(pixels.data(), rows, cols, 8, wrap); }
};

// The length of a line: the longer side of its bounding box, or the number of its columns where the map wraps.
class Extent {
public:
    explicit Extent(const EdgeMap& map) : map_(map), line_(map.wrap ? static_cast<std::size_t>(map.cols) : 0, 0) {}

    // Of another line from now on, which costs the same however wide the map is.
    void start() {
        ++number_, columns_ = 0;
        left_ = map_.cols, right_ = -1, top_ = map_.rows, bottom_ = -1;
    }
    void add(int row, int first, int last) {
        left_ = std::min(left_, first), right_ = std::max(right_, last);
        top_ = std::min(top_, row), bottom_ = std::max(bottom_, row);
        for (int col = first; map_.wrap && col <= last; ++col) {
            int& latest = line_[static_cast<std::size_t>(col)];
            columns_ += latest != number_;
            latest = number_;
        }
    }
    int length() const { return std::max(map_.wrap ? columns_ : right_ - left_ + 1, bottom_ - top_ + 1); }

private:
    const EdgeMap& map_;
    int number_ = 0, columns_ = 0, left_ = 0, right_ = -1, top_ = 0, bottom_ = -1;
    std::vector<int> line_;  // number of the latest one in every column
};

// Each pixel with the eight around it.
EdgeMap widened(const EdgeMap& edges) {
    EdgeMap wide(edges.rows, edges.cols, edges.wrap);
    const int last = edges.cols - 1;
    for (int row = 0; row < edges.rows; ++row) {
        Watch::checkpoint();
        const std::uint8_t* from = edges.row(row);
        for (int near = std::max(0, row - 1); near <= std::min(edges.rows - 1, row + 1); ++near) {
            std::uint8_t* to = wide.row(near);
            for (int col = 0; col <= last; ++col)
                to[col] = static_cast<std::uint8_t>(to[col] | from[col - 1] | from[col] | from[col + 1]);
            if (edges.wrap && edges.cols > 0) to[0] |= from[last], to[last] |= from[0];
        }
    }
    return wide;
}

// Removes the lines that are not significant. Their pieces may lie a few pixels apart.
void drop_faint(EdgeMap& edges, const float* significance, double least) {
    const Components lines = widened(edges).components();
    Checkpoints checkpoints;
    Extent extent(edges);
    for (int i = 0; i < lines.count(); ++i) {
        checkpoints.pass();
        extent.start();
        double squares = 0, pixels = 0;
        const auto for_each_pixel = [&](auto&& visit) {
            for (const auto [begin, end] : lines.runs(i)) {
                const int row = lines.row_of(begin), first = lines.col_of(begin);
                std::uint8_t* own = edges.row(row);
                for (int col = first; col < first + end - begin; ++col)
                    if (own[col]) visit(row, col, own[col]);
            }
        };
        for_each_pixel([&](int row, int col, std::uint8_t) {
            const auto s = static_cast<double>(significance[static_cast<std::ptrdiff_t>(row) * edges.cols + col]);
            extent.add(row, col, col);
            squares += s * s, pixels += 1;
        });
        if (squares * extent.length() >= least * least * usual_length * pixels) continue;
        for_each_pixel([](int, int, std::uint8_t& own) { own = 0; });
    }
}

}  // namespace

void select_pixels(const Strengths& strengths, const Thresholds& thresholds, Team& team, std::uint8_t* edges) {
    const int rows = strengths.rows, cols = strengths.cols;
    const float least_jump = least_reaching(thresholds.jump), least_crease = least_reaching(thresholds.crease);
    const float least_company = least_reaching(thresholds.company);
    const bool alone = !strengths.kind || std::min(rows, cols) < 3;
    const auto width = static_cast<std::size_t>(cols) + 2;
    const std::vector<std::uint8_t> every_kind(strengths.kind ? 0 : width, occluding_bit);
    parallel_for(rows, team, [&](int begin, int end, int) {
        // Of a row: jumps and creases that reach their threshold, and company with a column more on either side; of
        // three rows, the last one counted and the two before it, the company of each pixel and those beside it.
        std::vector<std::uint8_t> jumps(width), creases(width), flags(width, 0);
        std::vector<std::uint8_t> counts(3 * width, alone ? company : 0);
        const auto counts_of = [&](int row) { return counts.data() + static_cast<std::size_t>((row + 3) % 3) * width; };
        const auto at = [&](int row) { return static_cast<std::ptrdiff_t>(row) * cols; };
        const auto count = [&](int row) {
            if (alone) return;
            if (row < 0 || row == rows) {
                std::fill_n(counts_of(row), width, std::uint8_t{0});
                return;
            }
            flag_reaching(strengths.crease + at(row), cols, least_company, flags.data() + 1);
            if (strengths.wrap) flags.front() = flags[width - 2], flags.back() = flags[1];
            count_in_row(flags.data() + 1, cols, counts_of(row));
        };
        count(begin - 1), count(begin);
        for (int row = begin; row < end; ++row) {
            count(row + 1);
            flag_reaching(strengths.jump + at(row), cols, least_jump, jumps.data());
            flag_reaching(strengths.crease + at(row), cols, least_crease, creases.data());
            select_in_row(jumps.data(), strengths.kind ? strengths.kind + at(row) : every_kind.data(), creases.data(),
                          counts_of(row - 1), counts_of(row), counts_of(row + 1), cols, edges + at(row));
        }
    });
}

void keep_lines(const std::uint8_t* edges, int rows, int cols, bool wrap, int min_length, const float* significance,
                double least_significance, std::uint8_t* kept) {
    EdgeMap map(rows, cols, wrap);
    const auto width = static_cast<std::ptrdiff_t>(cols);
    for (int row = 0; row < rows; ++row)
        std::transform(edges + row * width, edges + (row + 1) * width, map.row(row),
                       [](std::uint8_t edge) { return static_cast<std::uint8_t>(edge != 0); });
    if (significance && least_significance > 0) drop_faint(map, significance, least_significance);
    std::fill_n(kept, rows * width, std::uint8_t{0});
    const Components pieces = map.components();
    Checkpoints checkpoints;
    Extent extent(map);
    for (int i = 0; i < pieces.count(); ++i) {
        checkpoints.pass();
        extent.start();
        for (const auto [begin, end] : pieces.runs(i))
            extent.add(pieces.row_of(begin), pieces.col_of(begin), pieces.col_of(end - 1));
        if (extent.length() < min_length) continue;
        for (const auto [begin, end] : pieces.runs(i))
            std::fill_n(kept + pieces.row_of(begin) * width + pieces.col_of(begin), end - begin, std::uint8_t{1});
    }
}

}  // namespace rangeedge
