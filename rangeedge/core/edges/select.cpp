// SPDX-License-Identifier: Apache-2.0
#include "edges/select.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "image/components.hpp"

namespace rangeedge {
namespace {

constexpr double usual_length = 10;  // of the line whose significance is that of its pixels

// An image with the margin of one pixel that components need.
struct Framed {
    int rows, cols;
    std::size_t stride;
    std::vector<std::uint8_t> pixels;

    Framed(int image_rows, int image_cols)
        : rows(image_rows), cols(image_cols), stride(static_cast<std::size_t>(cols) + 2),
          pixels(stride * (static_cast<std::size_t>(rows) + 2), 0) {}

    std::uint8_t* row(int i) { return pixels.data() + stride * (static_cast<std::size_t>(i) + 1) + 1; }
    Components components() const { return Components(pixels.data(), rows, cols, 8); }
};

// The longer side of a bounding box.
struct Box {
    int left, right = -1, top, bottom = -1;

    Box(int rows, int cols) : left(cols), top(rows) {}
    void add(int row, int first, int last) {
        left = std::min(left, first), right = std::max(right, last);
        top = std::min(top, row), bottom = std::max(bottom, row);
    }
    int length() const { return std::max(right - left, bottom - top) + 1; }
};

// Each pixel with the eight around it.
Framed widened(Framed& edges) {
    Framed wide(edges.rows, edges.cols);
    for (int row = 0; row < edges.rows; ++row) {
        const std::uint8_t* from = edges.row(row);
        for (int near = std::max(0, row - 1); near <= std::min(edges.rows - 1, row + 1); ++near) {
            std::uint8_t* to = wide.row(near);
            for (int col = 0; col < edges.cols; ++col)
                to[col] = static_cast<std::uint8_t>(to[col] | from[col - 1] | from[col] | from[col + 1]);
        }
    }
    return wide;
}

// Removes the lines, whose pieces may lie a few pixels apart, that are not significant.
void drop_faint(Framed& edges, const float* significance, double least) {
    const Components lines = widened(edges).components();
    for (int i = 0; i < lines.count(); ++i) {
        Box box(edges.rows, edges.cols);
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
            box.add(row, col, col);
            squares += s * s, pixels += 1;
        });
        if (squares * box.length() >= least * least * usual_length * pixels) continue;
        for_each_pixel([](int, int, std::uint8_t& own) { own = 0; });
    }
}

}  // namespace

void keep_lines(const std::uint8_t* edges, int rows, int cols, int min_length, const float* significance,
                double least_significance, std::uint8_t* kept) {
    Framed image(rows, cols);
    const auto width = static_cast<std::ptrdiff_t>(cols);
    for (int row = 0; row < rows; ++row)
        std::transform(edges + row * width, edges + (row + 1) * width, image.row(row),
                       [](std::uint8_t edge) { return static_cast<std::uint8_t>(edge != 0); });
    if (significance && least_significance > 0) drop_faint(image, significance, least_significance);
    std::fill_n(kept, rows * width, std::uint8_t{0});
    const Components pieces = image.components();
    for (int i = 0; i < pieces.count(); ++i) {
        Box box(rows, cols);
        for (const auto [begin, end] : pieces.runs(i))
            box.add(pieces.row_of(begin), pieces.col_of(begin), pieces.col_of(end - 1));
        if (box.length() < min_length) continue;
        for (const auto [begin, end] : pieces.runs(i))
            std::fill_n(kept + pieces.row_of(begin) * width + pieces.col_of(begin), end - begin, std::uint8_t{1});
    }
}

}  // namespace rangeedge
