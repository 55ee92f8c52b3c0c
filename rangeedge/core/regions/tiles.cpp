// SPDX-License-Identifier: Apache-2.0
#include "regions/tiles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace rangeedge {
namespace {

constexpr double quarter_of_normal = 0.31864;  // a quarter of all normal deviates are smaller than that
constexpr std::size_t least_differences = 64, most_differences = 16384;

// Independent noise averages out: the mean of n pixels deviates by 1 / sqrt(n) of a pixel. That of stereo, of time of
// flight and of registered images does not, since neighbours err together. How far the means of tiles deviate is found
// as the noise of pixels is: third differences along rows and columns of tiles vanish on every quadratic, and are
// sqrt(20) times the deviation of a mean elsewhere. Edges are many among tiles, so the smallest quarter counts. Tiles
// of 4, 8 and 16 pixels see waves of about that length; their variances add up.
// Means of the open tiles of a grid, NaN of the others.
struct Means {
    int rows, cols;
    Array<double> mean;

    explicit Means(const Tiles& tiles) : rows(tiles.rows()), cols(tiles.cols()), mean(tiles.count()) {
        for (int t = 0; t < tiles.count(); ++t)
            mean[t] = tiles.is_open(t) ? tiles.mean(t) : std::numeric_limits<double>::quiet_NaN();
    }
    // Of tiles twice as large.
    Means doubled() const {
        Means m = *this;
        m.rows = rows / 2, m.cols = cols / 2;
        for (int t = 0; t < m.rows * m.cols; ++t) {
            const int k = t / m.cols * 2 * cols + t % m.cols * 2;
            m.mean[t] = (mean[k] + mean[k + 1] + mean[k + cols] + mean[k + cols + 1]) / 4;
        }
        return m;
    }
    double variance() const;
};

double Means::variance() const {
    std::vector<double> differences;
    const auto add = [&](int t, int step) {
        const double d = mean[t] - 3 * mean[t + step] + 3 * mean[t + 2 * step] - mean[t + 3 * step];
        if (!std::isnan(d)) differences.push_back(std::abs(d));
    };
    // Of a large image, some rows tell as much as all.
    const int step = 1 + rows * cols / static_cast<int>(most_differences);
    for (int row = 0; row < rows; row += step)
        for (int col = 0; col < cols; ++col) {
            if (col + 3 < cols) add(row * cols + col, 1);
            if (row + 3 < rows) add(row * cols + col, cols);
        }
    if (differences.size() < least_differences) return 0;
    const auto quarter = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 4);
    std::nth_element(differences.begin(), quarter, differences.end());
    return *quarter * *quarter / (quarter_of_normal * quarter_of_normal * 20);
}

}  // namespace

Tiles::Tiles(const SurfaceImage& image, int side)
    : image_(image), side_(side), rows_(image.rows() / side), cols_(image.cols() / side), open_(rows_ * cols_, 0),
      mean_(open_.size()) {}

SurfaceSums Tiles::add_up(int t) const {
    const int first = first_pixel(t), stride = image_.stride();
    for (int row = 0; row < side_; ++row)
        for (int p = first + row * stride, end = p + side_; p < end; ++p)
            if (!image_.open(p)) return {};
    const Sample middle = image_.sample(first + (side_ / 2) * (stride + 1));
    SurfaceSums sums(middle.x, middle.y, middle.ordinate);
    for (int col = 0; col < side_; ++col) {
        const double x = image_.sample(first + col).x;
        std::array<double, 5> w{};
        std::array<double, 3> wf{};
        double wff = 0;
        for (int row = 0; row < side_; ++row) {
            const Sample s = image_.sample(first + col + row * stride);
            if (!image_.regular()) {
                sums.add(s);
                continue;
            }
            const double v = row - side_ / 2, vv = v * v, f = s.ordinate - middle.ordinate, p = s.weight * f;
            w[0] += s.weight, w[1] += s.weight * v, w[2] += s.weight * vv;
            w[3] += s.weight * (v * vv), w[4] += s.weight * (vv * vv);
            wf[0] += p, wf[1] += p * v, wf[2] += p * vv, wff += p * f;
        }
        if (image_.regular()) sums.add_column(x, side_, w, wf, wff);
    }
    return sums;
}

// Columns first, many at once, then those of each tile.
void Tiles::add_up_row(int row, SurfaceSums* sums) const {
    if (!image_.regular()) {
        for (int col = 0; col < cols_; ++col) sums[col] = add_up(index(row, col));
        return;
    }
    const int n = cols_ * side_, first = image_.index(row * side_, 0);
    Array<double> values(10 * n);
    Array<std::uint8_t> closed(n);
    const auto part = [&](int k) { return values.data() + static_cast<std::ptrdiff_t>(k) * n; };
    double* const base = part(9);
    const auto middle = [&](int col) { return image_.sample(first + col * side_ + side_ / 2 * (image_.stride() + 1)); };
    for (int col = 0; col < cols_; ++col) std::fill_n(base + col * side_, side_, middle(col).ordinate);
    const SurfaceImage::ColumnSums columns{
        {part(0), part(1), part(2), part(3), part(4)}, {part(5), part(6), part(7)}, part(8), closed.data()};
    image_.sum_columns(first, side_, n, base, columns);
    for (int col = 0; col < cols_; ++col) {
        const int begin = col * side_, end = begin + side_;
        sums[col] = {};
        if (std::any_of(closed.begin() + begin, closed.begin() + end, [](std::uint8_t c) { return c != 0; })) continue;
        const Sample m = middle(col);
        sums[col] = SurfaceSums(m.x, m.y, m.ordinate);
        for (int k = begin; k < end; ++k) {
            const auto& [w, wf, wff, unused] = columns;
            sums[col].add_column(k, side_, {w[0][k], w[1][k], w[2][k], w[3][k], w[4][k]},
                                 {wf[0][k], wf[1][k], wf[2][k]}, wff[k]);
        }
    }
}

void Tiles::set(int t, const SurfaceSums& sums) {
    open_[t] = 1;
    mean_[t] = sums.mean_ordinate() * std::sqrt(sums.weight() / sums.count());
    if (!sums_.empty()) sums_[t] = sums;
}

TilePyramid::TilePyramid(const SurfaceImage& image, Team& team) : large(image, 8), small(image, 4) {
    large.keep();
    // Two rows of small tiles at a time, which make one of large ones.
    parallel_for((small.rows() + 1) / 2, team, [&](int first, int last, int) {
        Array<SurfaceSums> quarters(2 * small.cols());
        for (int row = first; row < last; ++row) {
            const int two = std::min(2, small.rows() - 2 * row);
            for (int k = 0; k < two; ++k) small.add_up_row(2 * row + k, quarters.data() + k * small.cols());
            for (int k = 0; k < two * small.cols(); ++k)
                if (quarters[k].count()) small.set(2 * row * small.cols() + k, quarters[k]);
            for (int col = 0; row < large.rows() && col < large.cols(); ++col) {
                const int above = 2 * col, below = above + small.cols();
                SurfaceSums sums = quarters[above];
                bool open = sums.count() > 0;
                for (const int k : {above + 1, below, below + 1}) {
                    open = open && quarters[k].count() > 0;
                    if (open) sums.add(quarters[k]);
                }
                if (open) large.set(large.index(row, col), sums);
            }
        }
    });
}

TileNoise tile_noise(const TilePyramid& tiles) {
    const Means of_8(tiles.large);
    const double at_4 = Means(tiles.small).variance(), at_8 = of_8.variance(), at_16 = of_8.doubled().variance();
    const double variance = 1 + at_4 + at_8 + at_16;
    return {std::sqrt(variance), std::max({1.0, 64 * at_8 / variance, 256 * at_16 / variance})};
}

}  // namespace rangeedge
