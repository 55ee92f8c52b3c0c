// The runs of each label are brought together first. Then every label is a task of its own, which visits its pixels in
// raster order, so that sums do not depend on the number of threads.
// SPDX-License-Identifier: Apache-2.0
#include "regions/description.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "base/array.hpp"
#include "base/parallel.hpp"
#include "regions/surface.hpp"

namespace rangeedge {
namespace {

constexpr double least_relief = 1e-6;  // of the rms of a plane, in ranges of the ordinate
constexpr int least_curved = 40;       // pixels; fewer tell no curvature

class LabelRuns {
public:
    struct Run {
        int row, begin, end;  // columns [begin, end)
    };

    explicit LabelRuns(const LabelImage& image) : start_(image.count + 1, 0) {
        for_runs(image, [&](std::int32_t label, const Run&) { ++start_[label + 1]; });
        for (int i = 0; i < image.count; ++i) start_[i + 1] += start_[i];
        runs_.resize(start_[image.count]);
        Array<int> next = start_;
        for_runs(image, [&](std::int32_t label, const Run& run) { runs_[next[label]++] = run; });
    }

    template <class F>
    void for_runs_of(int label, F&& visit) const {
        for (int k = start_[label]; k < start_[label + 1]; ++k) visit(runs_[k]);
    }

private:
    template <class F>
    static void for_runs(const LabelImage& image, F&& visit) {
        for (int row = 0; row < image.rows; ++row) {
            Watch::checkpoint();
            const std::int32_t* const labels =
                image.labels + static_cast<std::size_t>(row) * static_cast<std::size_t>(image.cols);
            for (int col = 0; col < image.cols;) {
                Run run{row, col, col};
                while (run.end < image.cols && labels[run.end] == labels[col]) ++run.end;
                visit(labels[col], run);
                col = run.end;
            }
        }
    }

    Array<int> start_;
    Array<Run> runs_;
};

using Point = std::array<double, 3>;

// Monomials of three coordinates up to degree 4: each is one of a degree lower times a coordinate.
struct Monomials {
    std::array<int, moment_count> factor{}, axis{};

    constexpr Monomials() {
        int place[5][5][5] = {};
        int n = 1;
        for (int degree = 1; degree <= 4; ++degree)
            for (int i = degree; i >= 0; --i)
                for (int j = degree - i; j >= 0; --j, ++n) {
                    const int k = degree - i - j, along = i ? 0 : j ? 1 : 2;
                    place[i][j][k] = n;
                    axis[static_cast<std::size_t>(n)] = along;
                    factor[static_cast<std::size_t>(n)] = place[i - (along == 0)][j - (along == 1)][k - (along == 2)];
                }
    }
};
constexpr Monomials monomials;

class Description {
public:
    Description(const LabelImage& image, const double* points) : image_(image), points_(points), runs_(image) {}

    template <class F>
    void for_pixels(int label, F&& visit) const {
        runs_.for_runs_of(label, [&](const LabelRuns::Run& run) {
            const std::size_t row = static_cast<std::size_t>(run.row) * static_cast<std::size_t>(image_.cols);
            Watch::checkpoint();
            for (int col = run.begin; col < run.end; ++col) visit(row + static_cast<std::size_t>(col), run.row, col);
        });
    }
    Point normalised(std::size_t pixel, const double* origin, double scale) const {
        const double* const p = points_ + 3 * pixel;
        return {(p[0] - origin[0]) / scale, (p[1] - origin[1]) / scale, (p[2] - origin[2]) / scale};
    }
    void measure(int label, double* origin, double& scale, double* moments) const;
    bool is_curved(int label, const double* ordinate) const;

private:
    const LabelImage& image_;
    const double* points_;
    LabelRuns runs_;
};

void Description::measure(int label, double* origin, double& scale, double* moments) const {
    Point low, high;
    low.fill(HUGE_VAL), high.fill(-HUGE_VAL);
    double count = 0;
    for_pixels(label, [&](std::size_t pixel, int, int) {
        for (std::size_t c = 0; c < 3; ++c) {
            low[c] = std::min(low[c], points_[3 * pixel + c]);
            high[c] = std::max(high[c], points_[3 * pixel + c]);
        }
        ++count;
    });
    if (count == 0) return;
    double half = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        origin[c] = low[c] / 2 + high[c] / 2;
        half = std::max(half, high[c] / 2 - low[c] / 2);
    }
    scale = half > 0 ? half : 1;
    std::array<double, moment_count> sum{}, term{};
    for_pixels(label, [&](std::size_t pixel, int, int) {
        const Point p = normalised(pixel, origin, scale);
        term[0] = 1;
        for (std::size_t n = 1; n < moment_count; ++n)
            term[n] =
                term[static_cast<std::size_t>(monomials.factor[n])] * p[static_cast<std::size_t>(monomials.axis[n])];
        for (std::size_t n = 0; n < moment_count; ++n) sum[n] += term[n];
    });
    for (std::size_t n = 0; n < moment_count; ++n) moments[n] = sum[n] / count;
}

bool Description::is_curved(int label, const double* ordinate) const {
    double low = HUGE_VAL, high = -HUGE_VAL, x = 0, y = 0;
    int count = 0;
    for_pixels(label, [&](std::size_t pixel, int row, int col) {
        low = std::min(low, ordinate[pixel]), high = std::max(high, ordinate[pixel]);
        x += col, y += row;
        ++count;
    });
    if (count < least_curved || !(high > low)) return false;
    const double middle = low / 2 + high / 2, range = high - low;
    SurfaceSums sums(x / count, y / count, 0);
    for_pixels(label, [&](std::size_t pixel, int row, int col) {
        sums.add({static_cast<double>(col), static_cast<double>(row), (ordinate[pixel] - middle) / range, 1});
    });
    const double of_plane = sums.rms(sums.plane()), of_quadratic = sums.rms(sums.quadratic());
    return of_plane > least_relief && of_quadratic < curved_gain * of_plane;
}

}  // namespace

void label_statistics(const LabelImage& image, int threads, std::int32_t* boxes, double* centroids) {
    const LabelRuns runs(image);
    Team team(threads);
    parallel_each(image.count, team, [&](int label, int) {
        int left = image.cols, top = image.rows, right = 0, bottom = 0;
        long long area = 0, x = 0, y = 0;
        runs.for_runs_of(label, [&](const LabelRuns::Run& run) {
            const long long n = run.end - run.begin;
            left = std::min(left, run.begin), right = std::max(right, run.end);
            top = std::min(top, run.row), bottom = run.row + 1;
            area += n, y += n * run.row, x += n * (run.begin + run.end - 1LL) / 2;  // the product is even
        });
        if (area == 0) left = top = 0;
        std::int32_t* const box = boxes + 5 * static_cast<std::size_t>(label);
        box[0] = left, box[1] = top, box[2] = right - left, box[3] = bottom - top;
        box[4] = static_cast<std::int32_t>(area);
        double* const centroid = centroids + 2 * static_cast<std::size_t>(label);
        centroid[0] = static_cast<double>(x) / static_cast<double>(area);
        centroid[1] = static_cast<double>(y) / static_cast<double>(area);
    });
}

void region_moments(const LabelImage& image, const double* points, const double* ordinate, int threads, double* origins,
                    double* scales, double* moments, std::uint8_t* curved) {
    const Description description(image, points);
    Team team(threads);
    parallel_each(image.count - 1, team, [&](int k, int) {
        const auto label = static_cast<std::size_t>(k + 1);
        description.measure(k + 1, origins + 3 * label, scales[label], moments + moment_count * label);
        curved[label] = description.is_curved(k + 1, ordinate);
    });
}

void quadric_misfits(const LabelImage& image, const double* points, int threads, const double* origins,
                     const double* scales, const double* quadrics, const double* floors, double* misfits) {
    const Description description(image, points);
    Team team(threads);
    parallel_each(image.count, team, [&](int k, int) {
        const auto label = static_cast<std::size_t>(k);
        if (!(floors[label] > 0)) return;
        const double* const q = quadrics + 10 * label;
        double sum = 0, count = 0;
        description.for_pixels(k, [&](std::size_t pixel, int, int) {
            const auto [x, y, z] = description.normalised(pixel, origins + 3 * label, scales[label]);
            const double value = q[0] * x * x + q[1] * y * y + q[2] * z * z + q[3] * x * y + q[4] * x * z +
                                 q[5] * y * z + q[6] * x + q[7] * y + q[8] * z + q[9];
            const double gx = 2 * q[0] * x + q[3] * y + q[4] * z + q[6], gy = q[3] * x + 2 * q[1] * y + q[5] * z + q[7],
                         gz = q[4] * x + q[5] * y + 2 * q[2] * z + q[8];
            const double slope = std::max(std::sqrt(gx * gx + gy * gy + gz * gz), floors[label]);
            sum += value / slope * (value / slope);
            ++count;
        });
        misfits[label] = count > 0 ? std::sqrt(sum / count) : 0;
    });
}

}  // namespace rangeedge
