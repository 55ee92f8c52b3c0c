// SPDX-License-Identifier: Apache-2.0
#include "edges/select.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

#include "base/watch.hpp"
#include "image/components.hpp"

namespace rangeedge {
namespace {

constexpr double usual_length = 10;  // of the line whose significance is that of its pixels

// In how many columns a component has pixels.
int columns_of(const Components& parts, int i, int cols) {
    std::vector<char> seen(static_cast<std::size_t>(cols), 0);
    for (const auto [begin, end] : parts.runs(i)) std::fill_n(seen.begin() + parts.col_of(begin), end - begin, 1);
    return static_cast<int>(std::count(seen.begin(), seen.end(), 1));
}

}  // namespace

void keep_lines(const std::uint8_t* edges, int rows, int cols, bool wrap, int min_length, const float* significance,
                double least_significance, std::uint8_t* kept) {
    const auto stride = static_cast<std::size_t>(cols) + 2, width = static_cast<std::size_t>(cols);
    std::vector<std::uint8_t> image(stride * (static_cast<std::size_t>(rows) + 2), 0);
    for (std::size_t row = 0; row < static_cast<std::size_t>(rows); ++row)
        for (std::size_t col = 0; col < width; ++col)
            image[(row + 1) * stride + col + 1] = edges[row * width + col] != 0;
    std::fill_n(kept, static_cast<std::size_t>(rows) * width, std::uint8_t{0});
    const Components parts(image.data(), rows, cols, 8, wrap);
    Checkpoints checkpoints;
    for (int i = 0; i < parts.count(); ++i) {
        checkpoints.pass();
        int left = cols, right = -1, top = rows, bottom = -1;
        double squares = 0, pixels = 0;
        for (const auto [begin, end] : parts.runs(i)) {
            left = std::min(left, parts.col_of(begin)), right = std::max(right, parts.col_of(end - 1));
            top = std::min(top, parts.row_of(begin)), bottom = std::max(bottom, parts.row_of(begin));
            if (!significance) continue;
            const float* first =
                significance + static_cast<std::size_t>(parts.row_of(begin)) * width + parts.col_of(begin);
            squares = std::inner_product(first, first + (end - begin), first, squares);
            pixels += static_cast<double>(end - begin);
        }
        const int wide = wrap ? columns_of(parts, i, cols) : right - left + 1;
        const int length = std::max(wide, bottom - top + 1);
        if (length < min_length) continue;
        if (significance && !(squares * length >= least_significance * least_significance * usual_length * pixels))
            continue;
        for (const auto [begin, end] : parts.runs(i)) {
            const auto row = static_cast<std::size_t>(parts.row_of(begin));
            std::fill_n(kept + row * width + parts.col_of(begin), end - begin, std::uint8_t{1});
        }
    }
}

}  // namespace rangeedge
