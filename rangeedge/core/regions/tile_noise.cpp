// Independent noise averages out: the mean of n pixels deviates by 1 / sqrt(n) of a pixel. That of stereo, of time of
// flight and of registered images does not, since neighbours err together. How far the means of tiles deviate is found
// as the noise of pixels is: third differences along rows and columns of tiles vanish on every quadratic, and are
// sqrt(20) times the deviation of a mean elsewhere. Edges are many among tiles, so the smallest quarter counts. Tiles
// of 4 and of 8 pixels see waves of about that length; their variances add up.
// SPDX-License-Identifier: Apache-2.0
#include "tile_noise.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace rangeedge {
namespace {

constexpr double quarter_of_normal = 0.31864;  // a quarter of all normal deviates are smaller than that
constexpr std::size_t least_differences = 64;

// Means of the tiles without invalid pixels, in standard deviations of a pixel; NaN for the others.
Array<float> tile_means(const SurfaceImage& image, int side, Team& team) {
    const int rows = image.rows() / side, cols = image.cols() / side;
    Array<float> mean(static_cast<std::size_t>(rows * cols));
    parallel_for(rows, team, [&](int first, int last, int) {
        for (int t = first * cols; t < last * cols; ++t) {
            double ordinate = 0, weight = 0;
            bool valid = true;
            for (int row = 0; row < side; ++row)
                for (int p = image.index(t / cols * side + row, t % cols * side), end = p + side; p < end; ++p) {
                    valid = valid && image.valid(p);
                    const Sample s = image.sample(p);
                    ordinate += s.ordinate, weight += s.weight;
                }
            const double n = side * side;
            mean[t] = valid ? static_cast<float>(ordinate / n * std::sqrt(weight / n))
                            : std::numeric_limits<float>::quiet_NaN();
        }
    });
    return mean;
}

double variance_of_means(const SurfaceImage& image, int side, Team& team) {
    const Array<float> mean = tile_means(image, side, team);
    const int rows = image.rows() / side, cols = image.cols() / side;
    std::vector<float> differences;
    const auto add = [&](int t, int step) {
        const float d = mean[t] - 3 * mean[t + step] + 3 * mean[t + 2 * step] - mean[t + 3 * step];
        if (std::isfinite(d)) differences.push_back(std::abs(d));
    };
    for (int row = 0; row < rows; ++row)
        for (int col = 0; col < cols; ++col) {
            if (col + 3 < cols) add(row * cols + col, 1);
            if (row + 3 < rows) add(row * cols + col, cols);
        }
    if (differences.size() < least_differences) return 0;
    const auto quarter = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 4);
    std::nth_element(differences.begin(), quarter, differences.end());
    const double d = static_cast<double>(*quarter) / quarter_of_normal;
    return d * d / 20;
}

}  // namespace

TileNoise tile_noise(const SurfaceImage& image, Team& team) {
    const double of_4 = variance_of_means(image, 4, team), of_8 = variance_of_means(image, 8, team);
    const double variance = 1 + of_4 + of_8;
    return {std::sqrt(variance), std::max(1.0, 64 * of_8 / variance)};
}

}  // namespace rangeedge
