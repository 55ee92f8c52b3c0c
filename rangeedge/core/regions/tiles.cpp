// SPDX-License-Identifier: Apache-2.0
#include "tiles.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace rangeedge {
namespace {

constexpr double quarter_of_normal = 0.31864;  // a quarter of all normal deviates are smaller than that
constexpr std::size_t least_differences = 64;

}  // namespace

Tiles::Tiles(const SurfaceImage& image, int size)
    : side(size), rows_(image.rows() / side), cols_(image.cols() / side),
      sums_(static_cast<std::size_t>(rows_ * cols_)), first_(sums_.size()), open_(sums_.size(), 0) {
    for (int t = 0; t < rows_ * cols_; ++t) first_[t] = image.index(t / cols_ * side, t % cols_ * side);
}

TilePyramid::TilePyramid(const SurfaceImage& image, Team& team) : large(image, 8), small(image, 4) {
    parallel_for(small.rows(), team, [&](int begin, int end, int) {
        for (int t = small.index(begin, 0); t < small.index(end, 0); ++t) small.add_up(image, t);
    });
    parallel_for(large.rows(), team, [&](int begin, int end, int) {
        for (int row = begin; row < end; ++row)
            for (int col = 0; col < large.cols(); ++col) large.add_up(small, row, col);
    });
}

void Tiles::add_up(const SurfaceImage& image, int t) {
    const auto all = [&](auto&& visit) {
        for (int row = 0; row < side; ++row)
            for (int p = first_[t] + row * image.stride(), stop = p + side; p < stop; ++p)
                if (!visit(p)) return false;
        return true;
    };
    if (!all([&](int p) { return image.open(p); })) return;
    const Sample middle = image.sample(first_[t] + (side / 2) * (image.stride() + 1));
    SurfaceSums sums(middle.x, middle.y, middle.ordinate);
    all([&](int p) {
        sums.add(image.sample(p));
        return true;
    });
    sums_[t] = sums;
    open_[t] = 1;
}

void Tiles::add_up(const Tiles& quarters, int row, int col) {
    const int t = quarters.index(2 * row, 2 * col), below = t + quarters.cols();
    for (const int q : {t, t + 1, below, below + 1})
        if (!quarters.is_open(q)) return;
    SurfaceSums sums = quarters.sums(t);
    for (const int q : {t + 1, below, below + 1}) sums.add(quarters.sums(q));
    sums_[index(row, col)] = sums;
    open_[index(row, col)] = 1;
}

// Independent noise averages out: the mean of n pixels deviates by 1 / sqrt(n) of a pixel. That of stereo, of time of
// flight and of registered images does not, since neighbours err together. How far the means of tiles deviate is found
// as the noise of pixels is: third differences along rows and columns of tiles vanish on every quadratic, and are
// sqrt(20) times the deviation of a mean elsewhere. Edges are many among tiles, so the smallest quarter counts. Tiles
// of 4 and of 8 pixels see waves of about that length; their variances add up.
static double variance_of_means(const Tiles& tiles) {
    const auto mean = [&](int t) {
        const SurfaceSums& s = tiles.sums(t);
        return s.mean_ordinate() * std::sqrt(s.weight() / s.count());  // in standard deviations of a pixel
    };
    std::vector<double> differences;
    const auto add = [&](int t, int step) {
        for (int k = 0; k < 4; ++k)
            if (!tiles.is_open(t + k * step)) return;
        differences.push_back(std::abs(mean(t) - 3 * mean(t + step) + 3 * mean(t + 2 * step) - mean(t + 3 * step)));
    };
    for (int row = 0; row < tiles.rows(); ++row)
        for (int col = 0; col < tiles.cols(); ++col) {
            if (col + 3 < tiles.cols()) add(tiles.index(row, col), 1);
            if (row + 3 < tiles.rows()) add(tiles.index(row, col), tiles.cols());
        }
    if (differences.size() < least_differences) return 0;
    const auto quarter = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 4);
    std::nth_element(differences.begin(), quarter, differences.end());
    return *quarter * *quarter / (quarter_of_normal * quarter_of_normal * 20);
}

TileNoise tile_noise(const TilePyramid& tiles) {
    const double of_small = variance_of_means(tiles.small), of_large = variance_of_means(tiles.large);
    const double variance = 1 + of_small + of_large;
    return {std::sqrt(variance), std::max(1.0, tiles.large.side * tiles.large.side * of_large / variance)};
}

}  // namespace rangeedge
