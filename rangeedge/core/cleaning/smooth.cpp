// SPDX-License-Identifier: Apache-2.0
#include "cleaning/smooth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/array.hpp"
#include "base/parallel.hpp"

namespace rangeedge {
namespace {

constexpr double few = 1.5;      // pixels, the radius of means that keep detail
constexpr double noisy = 3;      // deviations up to which means over few and over many pixels differ by noise
constexpr double outlying = 5;   // deviations from which on a pixel is something else than noise
constexpr int apart = 10;        // pixels, from where on means over few err independently while the form is the same
constexpr int every = 4;         // pixel counts where deviations are measured
constexpr float least = 1e-20f;  // weight of a mean that has any

using Pair = std::array<float, 2>;  // over few, over many pixels

// Sums of residuals and of their weights, over few and over many pixels.
struct Sums {
    std::array<float, 4> of{};

    void add(const std::array<float, 4>& factor, const Sums& s) {
        for (std::size_t k = 0; k < 4; ++k) of[k] += factor[k] * s.of[k];
    }
};

// The a of which the weights a^|d| have a standard deviation: its square is 2 a / (1 - a)^2.
float decay(double radius) {
    const double m = 1 / (radius * radius);
    return static_cast<float>(1 + m - std::sqrt(m * (m + 2)));
}

class Means {
public:
    // Of `residual`; NaN does not count. What means over few and over many pixels leave of it is averaged once more and
    // added, since a mean is too low on top of a bulge by about as much as the mean of what it leaves is too high.
    Means(const OrdinateMap& map, const Array<float>& residual, const std::int32_t* labels, double radius, int threads)
        : map_(map), labels_(labels), team_(threads), left_(map.size()), sums_(map.size()), mean_(map.size(), Pair{}) {
        const float fine = decay(std::min(few, radius)), coarse = decay(radius);
        factor_ = {fine, fine, coarse, coarse};
        for (int p = 0; p < map.size(); ++p) left_[p] = {residual[p], residual[p]};
        for (int round = 0; round < 2; ++round) {
            parallel_for(map.rows, team_, [&](int begin, int end, int) {
                for (int row = begin; row < end; ++row) along_row(row);
            });
            parallel_for(map.cols, team_, [&](int begin, int end, int) { along_columns(begin, end); });
            parallel_for(map.size(), team_, [&](int begin, int end, int) {
                for (int p = begin; p < end; ++p) take(p);
            });
        }
    }

    // The mean of the residuals at a pixel, over few pixels and over many.
    Pair at(int p) const { return mean_[p]; }

private:
    Sums own(int p) const {
        if (!(left_[p][0] == left_[p][0])) return {};
        return {{left_[p][0], 1, left_[p][1], 1}};
    }
    void take(int p) {
        const std::array<float, 4>& s = sums_[p].of;
        for (std::size_t k = 0; k < 2; ++k) {
            const float more = s[2 * k + 1] > least ? s[2 * k] / s[2 * k + 1] : 0;
            mean_[p][k] += more, left_[p][k] -= more;
        }
    }
    // Each pixel takes what the one before it has from as far back as the surface goes, then from the other side what
    // that one has without its own.
    void along_row(int row) {
        const int first = row * map_.cols, end = first + map_.cols;
        for (int p = first; p < end; ++p) {
            sums_[p] = own(p);
            if (p > first && labels_[p] == labels_[p - 1]) sums_[p].add(factor_, sums_[p - 1]);
        }
        Sums after{};
        for (int p = end - 1; p >= first; --p) {
            if (p + 1 == end || labels_[p] != labels_[p + 1]) after = {};
            for (std::size_t k = 0; k < 4; ++k) after.of[k] *= factor_[k];
            sums_[p].add({1, 1, 1, 1}, after);
            after.add({1, 1, 1, 1}, own(p));
        }
    }
    void along_columns(int begin, int end) {
        Array<Sums> carried(end - begin), before(static_cast<Array<Sums>::Index>(map_.rows) * (end - begin));
        for (int row = 0; row < map_.rows; ++row)
            for (int col = begin; col < end; ++col) {
                const int p = row * map_.cols + col;
                Sums& above = carried[col - begin];
                if (row == 0 || labels_[p] != labels_[p - map_.cols]) above = {};
                for (std::size_t k = 0; k < 4; ++k) above.of[k] *= factor_[k];
                before[static_cast<Array<Sums>::Index>(row) * (end - begin) + col - begin] = above;
                above.add({1, 1, 1, 1}, sums_[p]);
            }
        std::fill(carried.begin(), carried.end(), Sums{});
        for (int row = map_.rows - 1; row >= 0; --row)
            for (int col = begin; col < end; ++col) {
                const int p = row * map_.cols + col;
                Sums& below = carried[col - begin];
                if (row + 1 == map_.rows || labels_[p] != labels_[p + map_.cols]) below = {};
                for (std::size_t k = 0; k < 4; ++k) below.of[k] *= factor_[k];
                const Sums here = sums_[p];
                sums_[p].add({1, 1, 1, 1}, below);
                sums_[p].add({1, 1, 1, 1}, before[static_cast<Array<Sums>::Index>(row) * (end - begin) + col - begin]);
                below.add({1, 1, 1, 1}, here);
            }
    }

    const OrdinateMap& map_;
    const std::int32_t* labels_;
    Team team_;
    Array<Pair> left_;
    Array<Sums> sums_;
    Array<Pair> mean_;
    std::array<float, 4> factor_{};
};

// The deviation of values on every surface, if their noise is normal: from the median of their magnitudes.
template <class F>
std::vector<float> deviations(const OrdinateMap& map, const std::int32_t* labels, int count, F&& value) {
    std::vector<std::vector<float>> found(static_cast<std::size_t>(count));
    for (int row = 0; row < map.rows; ++row)
        for (int col = row % every; col < map.cols; col += every) {
            const int p = row * map.cols + col;
            if (labels[p] <= 0 || !map.valid(p)) continue;
            const float here = std::abs(value(p));
            if (here == here) found[static_cast<std::size_t>(labels[p])].push_back(here);
        }
    std::vector<float> deviation(found.size());
    for (std::size_t label = 0; label < found.size(); ++label) {
        std::vector<float>& own = found[label];
        if (own.empty()) continue;
        const auto middle = own.begin() + static_cast<std::ptrdiff_t>(own.size() / 2);
        std::nth_element(own.begin(), middle, own.end());
        deviation[label] = 1.4826f * *middle;
    }
    return deviation;
}

}  // namespace

void smooth_surfaces(const OrdinateMap& map, const std::vector<Surface>& surfaces, const std::int32_t* labels,
                     double radius, int threads, float* smoothed) {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    const int count = static_cast<int>(surfaces.size());
    const auto label_of = [&](int p) { return static_cast<std::size_t>(labels[p]); };
    const auto surface_at = [&](int p) { return surfaces[label_of(p)].value(map.x_of(p), map.y_of(p)); };
    Array<float> residual(map.size(), nan);
    for (int p = 0; p < map.size(); ++p)
        if (labels[p] > 0 && map.valid(p))
            residual[p] = static_cast<float>(static_cast<double>(map.ordinate[p]) - surface_at(p));
    const std::vector<float> spread = deviations(map, labels, count, [&](int p) { return residual[p]; });
    Array<float> inlying = residual;
    for (int p = 0; p < map.size(); ++p)
        if (labels[p] > 0 && std::abs(residual[p]) > static_cast<float>(outlying) * spread[label_of(p)])
            inlying[p] = nan;

    const Means means(map, inlying, labels, radius, threads);
    const auto detail_at = [&](int p) {
        const auto [fine, coarse] = means.at(p);
        return fine - coarse;
    };
    const std::vector<float> difference = deviations(map, labels, count, [&](int p) {
        const int q = p % map.cols + apart < map.cols ? p + apart : p - apart;
        return q < 0 || labels[q] != labels[p] ? nan : (detail_at(p) - detail_at(q)) / std::sqrt(2.0f);
    });
    const auto mean_at = [&](int p) {
        const float coarse = means.at(p)[1], detail = detail_at(p),
                    limit = static_cast<float>(noisy) * difference[label_of(p)];
        // From the one to the other without a step.
        return coarse + (std::abs(detail) > limit ? 1 - limit * limit / (detail * detail) : 0) * detail;
    };
    const std::vector<float> noise = deviations(map, labels, count, [&](int p) { return residual[p] - mean_at(p); });
    for (int p = 0; p < map.size(); ++p) {
        smoothed[p] = nan;
        if (labels[p] <= 0) continue;
        const float mean = mean_at(p);
        if (std::abs(residual[p] - mean) > static_cast<float>(outlying) * noise[label_of(p)]) continue;
        smoothed[p] = static_cast<float>(surface_at(p) + static_cast<double>(mean));
    }
}

}  // namespace rangeedge
