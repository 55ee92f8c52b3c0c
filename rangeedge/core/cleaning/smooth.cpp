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
constexpr int strip = 16;        // columns that are gone along together

template <std::size_t N>
using Sums = std::array<float, N>;

template <std::size_t N>
void add(Sums<N>& to, const Sums<N>& sums) {
    for (std::size_t k = 0; k < N; ++k) to[k] += sums[k];
}
template <std::size_t N>
void scale(Sums<N>& sums, const Sums<N>& factor) {
    for (std::size_t k = 0; k < N; ++k) sums[k] *= factor[k];
}

// The a of which the weights a^|d| have a standard deviation: its square is 2 a / (1 - a)^2.
float decay(double radius) {
    const double m = 1 / (radius * radius);
    return static_cast<float>(1 + m - std::sqrt(m * (m + 2)));
}

class Means {
public:
    // Of `residual`; NaN does not count. What means over few and over many pixels leave of it is averaged once more and
    // added, since a mean is too low on top of a bulge by about as much as the mean of what it leaves is too high.
    Means(const OrdinateMap& map, const Array<float>& residual, const std::int32_t* labels, double radius, Team& team)
        : map_(map), labels_(labels), team_(team), mean_(map.size()), weight_(map.size()) {
        const float few_decay = decay(std::min(few, radius)), many_decay = decay(radius);
        const auto known = [&](int p) { return residual[p] == residual[p]; };
        average<4>(
            {few_decay, many_decay, few_decay, many_decay},
            [&](int p) { return known(p) ? Sums<4>{residual[p], residual[p], 1, 1} : Sums<4>{}; },
            [&](int p, const Sums<4>& s) {
                weight_[p] = {s[2], s[3]};
                mean_[p] = {over(s[0], s[2]), over(s[1], s[3])};
            });
        average<2>(
            {few_decay, many_decay},
            [&](int p) { return known(p) ? Sums<2>{residual[p] - mean_[p][0], residual[p] - mean_[p][1]} : Sums<2>{}; },
            [&](int p, const Sums<2>& s) {
                mean_[p][0] += over(s[0], weight_[p][0]), mean_[p][1] += over(s[1], weight_[p][1]);
            });
    }

    // The mean of the residuals at a pixel, over few pixels and over many.
    Sums<2> at(int p) const { return mean_[p]; }

private:
    static float over(float sum, float weight) { return weight > least ? sum / weight : 0; }

    // Calls take(p, sum of own(q) factor^(columns and rows apart)) for all pixels p.
    template <std::size_t N, class Own, class Take>
    void average(const Sums<N>& factor, Own&& own, Take&& take) {
        Array<Sums<N>> sums(map_.size());
        parallel_for(map_.rows, team_, [&](int begin, int end, int) {
            for (int row = begin; row < end; ++row) along_row(row, factor, own, sums);
        });
        parallel_for((map_.cols + strip - 1) / strip, team_, [&](int begin, int end, int) {
            Array<Sums<N>> before(static_cast<typename Array<Sums<N>>::Index>(map_.rows) * strip);
            for (int k = begin; k < end; ++k)
                along_columns(k * strip, std::min((k + 1) * strip, map_.cols), factor, sums, before, take);
        });
    }
    // Each pixel takes what the one before it has from as far back as the surface goes, and what the one after it has.
    template <std::size_t N, class Own>
    void along_row(int row, const Sums<N>& factor, Own&& own, Array<Sums<N>>& sums) const {
        const int first = row * map_.cols, end = first + map_.cols;
        Sums<N> before{}, after{};
        for (int p = first; p < end; ++p) {
            if (p > first && labels_[p] != labels_[p - 1]) before = {};
            scale(before, factor);
            add(before, own(p));
            sums[p] = before;
        }
        for (int p = end - 1; p >= first; --p) {
            if (p + 1 < end && labels_[p] != labels_[p + 1]) after = {};
            scale(after, factor);
            add(sums[p], after);
            add(after, own(p));
        }
    }
    template <std::size_t N, class Take>
    void along_columns(int begin, int end, const Sums<N>& factor, const Array<Sums<N>>& sums, Array<Sums<N>>& before,
                       Take&& take) const {
        std::array<Sums<N>, strip> carried{};
        const auto carry = [&](int col, int p, int beside) -> Sums<N>& {
            Sums<N>& own = carried[static_cast<std::size_t>(col - begin)];
            if (labels_[p] != labels_[beside]) own = {};
            scale(own, factor);
            return own;
        };
        for (int row = 0; row < map_.rows; ++row)
            for (int col = begin; col < end; ++col) {
                const int p = row * map_.cols + col;
                Sums<N>& above = carry(col, p, row > 0 ? p - map_.cols : p);
                before[row * strip + col - begin] = above;
                add(above, sums[p]);
            }
        carried = {};
        for (int row = map_.rows - 1; row >= 0; --row)
            for (int col = begin; col < end; ++col) {
                const int p = row * map_.cols + col;
                Sums<N>& below = carry(col, p, row + 1 < map_.rows ? p + map_.cols : p);
                Sums<N> all = before[row * strip + col - begin];
                add(all, below);
                add(all, sums[p]);
                add(below, sums[p]);
                take(p, all);
            }
    }

    const OrdinateMap& map_;
    const std::int32_t* labels_;
    Team& team_;
    Array<Sums<2>> mean_, weight_;
};

// The deviation of values on every surface, if their noise is normal: from the median of their magnitudes.
template <class F>
std::vector<float> deviations(const OrdinateMap& map, const std::int32_t* labels, int count, F&& value) {
    std::vector<std::vector<float>> found(static_cast<std::size_t>(count));
    for (int row = 0; row < map.rows; ++row)
        for (int col = row % every; col < map.cols; col += every) {
            const int p = row * map.cols + col;
            if (labels[p] <= 0 || !map.valid(p)) continue;
            const float here = std::abs(value(row, col));
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

// A pixel `apart` from one, in the same row, or in the same column of a narrow image; -1 where there is none.
int pixel_apart(const OrdinateMap& map, int row, int col) {
    const bool narrow = map.cols < 2 * apart;
    const int p = row * map.cols + col, step = narrow ? apart * map.cols : apart;
    const int at = narrow ? row : col, count = narrow ? map.rows : map.cols;
    return at + apart < count ? p + step : at >= apart ? p - step : -1;
}

}  // namespace

void smooth_surfaces(const OrdinateMap& map, const std::vector<Surface>& surfaces, const std::int32_t* labels,
                     double radius, int threads, float* smoothed) {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    const int count = static_cast<int>(surfaces.size());
    Team team(threads);
    const auto for_labelled = [&](auto&& visit) {
        parallel_for(map.rows, team, [&](int begin, int end, int) {
            for (int row = begin; row < end; ++row)
                for (int p = row * map.cols, col = 0; col < map.cols; ++p, ++col)
                    if (labels[p] > 0) visit(p, row, col, static_cast<std::size_t>(labels[p]));
        });
    };
    const auto surface_at = [&](int p, int row, int col, std::size_t label) {
        return surfaces[label].value(map.x ? static_cast<double>(map.x[p]) : col,
                                     map.y ? static_cast<double>(map.y[p]) : row);
    };
    Array<float> residual(map.size(), nan);
    for_labelled([&](int p, int row, int col, std::size_t label) {
        if (map.valid(p))
            residual[p] = static_cast<float>(static_cast<double>(map.ordinate[p]) - surface_at(p, row, col, label));
    });
    const std::vector<float> spread =
        deviations(map, labels, count, [&](int row, int col) { return residual[row * map.cols + col]; });
    Array<float> inlying = residual;
    for_labelled([&](int p, int, int, std::size_t label) {
        if (std::abs(residual[p]) > static_cast<float>(outlying) * spread[label]) inlying[p] = nan;
    });

    const Means means(map, inlying, labels, radius, team);
    const auto detail_at = [&](int p) {
        const auto [fine, coarse] = means.at(p);
        return fine - coarse;
    };
    const std::vector<float> difference = deviations(map, labels, count, [&](int row, int col) {
        const int p = row * map.cols + col, q = pixel_apart(map, row, col);
        return q < 0 || labels[q] != labels[p] ? nan : (detail_at(p) - detail_at(q)) / std::sqrt(2.0f);
    });
    const auto mean_at = [&](int p, std::size_t label) {
        const float coarse = means.at(p)[1], detail = detail_at(p),
                    limit = static_cast<float>(noisy) * difference[label];
        // From the one to the other without a step.
        return coarse + (std::abs(detail) > limit ? 1 - limit * limit / (detail * detail) : 0) * detail;
    };
    const std::vector<float> noise = deviations(map, labels, count, [&](int row, int col) {
        const int p = row * map.cols + col;
        return residual[p] - mean_at(p, static_cast<std::size_t>(labels[p]));
    });
    std::fill(smoothed, smoothed + map.size(), nan);
    for_labelled([&](int p, int row, int col, std::size_t label) {
        const float mean = mean_at(p, label);
        if (std::abs(residual[p] - mean) > static_cast<float>(outlying) * noise[label]) return;
        smoothed[p] = static_cast<float>(surface_at(p, row, col, label) + static_cast<double>(mean));
    });
}

}  // namespace rangeedge
