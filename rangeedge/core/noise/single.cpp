// SPDX-License-Identifier: Apache-2.0
#include "noise/single.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/parallel.hpp"
#include "base/simd.hpp"
#include "noise/trimmed.hpp"

namespace rangeedge {
namespace {

constexpr std::ptrdiff_t most_windows = 1 << 15;  // along rows, and along columns
constexpr std::size_t fewest_windows = 200;       // that tell the noise
constexpr int farthest = 4;                       // samples between those that are taken for neighbours
constexpr std::size_t most_bins = 8;
constexpr std::size_t least_bin = 50;      // windows
constexpr double quantised_share = 0.3;    // of windows with equal neighbours: more have values with a step
constexpr std::size_t ranked_windows = 4096;  // that tell the borders of bins
constexpr double coarsest_step = 5e-3;
const double per_difference = std::sqrt(20.0);  // deviation of a third difference of independent values

// Of windows of four samples: the magnitude of the third difference, the mean ordinate, and the least difference of
// neighbours other than zero, 0 where no two of them are equal. The mean is independent of the difference, so that bins
// of it do not select among the differences.
struct Windows {
    std::size_t count = 0;
    std::vector<float> differences, ordinates, steps;  // with `padding` more

    void reserve(std::ptrdiff_t windows) {
        for (auto* values : {&differences, &ordinates, &steps}) values->resize(count + static_cast<std::size_t>(windows) + padding);
    }
    // The window that begins at y, of samples `apart`; two more on either side are of the same line.
    template <class T>
    RANGEEDGE_INLINE void add(const T* y, std::ptrdiff_t apart) {
        constexpr float most = std::numeric_limits<float>::max();
        const double y0 = static_cast<double>(y[0]), y1 = static_cast<double>(y[apart]);
        const double y2 = static_cast<double>(y[2 * apart]), y3 = static_cast<double>(y[3 * apart]);
        const double a = std::abs(y1 - y0), b = std::abs(y2 - y1), c = std::abs(y3 - y2);
        const auto difference = static_cast<float>(std::abs(y3 - y0 - 3 * (y2 - y1)));
        const auto mean = static_cast<float>((y0 + y1 + y2 + y3) / 4);
        const auto least = [](double p, double q) { return p == 0 || (q < p && q > 0) ? q : p; };
        differences[count] = difference;
        ordinates[count] = mean;
        steps[count] = static_cast<float>((a == 0) | (b == 0) | (c == 0) ? least(least(a, b), c) : 0);
        const bool constant = (a == 0) & (b == 0) & (c == 0) & (y[-2 * apart] == y[-apart]) & (y[-apart] == y[0]) &
                              (y[3 * apart] == y[4 * apart]) & (y[4 * apart] == y[5 * apart]);
        count += (difference <= most) & (std::abs(mean) <= most) & !constant;  // not so with NaN
    }
    // Every so many of `number` windows that begin side by side, the same ones whichever end is the first.
    template <class T>
    void add_line(const T* y, std::ptrdiff_t number, std::ptrdiff_t every, std::ptrdiff_t apart) {
        for (std::ptrdiff_t i = 0; 2 * i < number; i += every) {
            add(y + i, apart);
            if (2 * i < number - 1) add(y + number - 1 - i, apart);
        }
    }
};

template <class T>
Windows windows_of(const T* ordinate, std::ptrdiff_t rows, std::ptrdiff_t cols, std::ptrdiff_t apart) {
    const std::ptrdiff_t every = 1 + rows * cols / most_windows;
    const std::ptrdiff_t margin = 2 * apart;  // samples on either side of a window
    const std::ptrdiff_t down = std::max<std::ptrdiff_t>(0, rows - 3 * apart - 2 * margin);
    const std::ptrdiff_t along = std::max<std::ptrdiff_t>(0, cols - 3 * apart - 2 * margin);
    Windows windows;
    windows.reserve(down * (cols / every + 2) + along * (rows / every + 2));
    for (std::ptrdiff_t v = 0; v < down; ++v)
        windows.add_line(ordinate + (v + margin) * cols, cols, every, apart * cols);
    for (std::ptrdiff_t i = 0; i < rows; ++i) {
        if (std::min(i, rows - 1 - i) % every != 0) continue;
        const T* line = ordinate + i * cols;
        for (std::ptrdiff_t u = 0; u < along; ++u) windows.add(line + u + margin, apart);
    }
    return windows;
}

// The deviation of rounding to the step that quantised values show; 0 of others.
double rounding_deviation(const float* steps, std::size_t count, double coarsest) {
    std::vector<float> equal;
    for (std::size_t k = 0; k < count; ++k)
        if (steps[k] > 0) equal.push_back(steps[k]);
    if (equal.empty() || static_cast<double>(equal.size()) < quantised_share * static_cast<double>(count)) return 0;
    const auto middle = equal.begin() + static_cast<std::ptrdiff_t>(equal.size() / 2);
    std::nth_element(equal.begin(), middle, equal.end());
    const auto step = static_cast<double>(*middle);
    return step <= coarsest ? step / std::sqrt(12.0) : 0;
}

// The deviation that third differences show, not below that of rounding.
double deviation_of(const float* differences, const float* steps, std::size_t count, double coarsest) {
    const double rounding = rounding_deviation(steps, count, coarsest);
    return std::max(trimmed_deviation(differences, count) / per_difference, rounding);
}

// The windows of one range of ordinates.
struct Bin {
    std::vector<float> differences, steps;
    double sum = 0;  // of ordinates
};

// As many windows in each, but for the coarseness of the borders.
std::vector<Bin> bins_of(const Windows& windows) {
    const std::size_t count = windows.count, every = 1 + count / ranked_windows;
    std::vector<float> ranked;
    for (std::size_t k = 0; k < count; k += every) ranked.push_back(windows.ordinates[k]);
    std::sort(ranked.begin(), ranked.end());
    std::vector<Bin> bins(std::max<std::size_t>(1, std::min(most_bins, count / least_bin)));
    std::vector<float> borders;
    for (std::size_t i = 1; i < bins.size(); ++i) borders.push_back(ranked[i * ranked.size() / bins.size()]);
    for (std::size_t k = 0; k < count; ++k) {
        std::size_t own = 0;
        for (const float border : borders) own += windows.ordinates[k] > border;
        bins[own].differences.push_back(windows.differences[k]);
        bins[own].steps.push_back(windows.steps[k]);
        bins[own].sum += static_cast<double>(windows.ordinates[k]);
    }
    return bins;
}

}  // namespace

template <class T>
SingleNoise single_noise(const T* ordinate, int rows, int cols, bool projective, int threads) {
    SingleNoise result;
    Windows windows;
    for (int apart = 1; apart <= farthest && windows.count < fewest_windows; ++apart) {
        Windows found = windows_of(ordinate, rows, cols, apart);
        if (found.count > windows.count) windows = std::move(found);
    }
    if (windows.count == 0) return result;
    const auto seen = windows.ordinates.begin();
    const auto [low, high] = std::minmax_element(seen, seen + static_cast<std::ptrdiff_t>(windows.count));
    result.lowest = static_cast<double>(*low), result.highest = static_cast<double>(*high);
    // Of values that were rounded, at the most: a share of the distance, or of the range of heights.
    const auto coarsest = [&](double ordinate_there) {
        return coarsest_step * (projective ? std::abs(ordinate_there) : result.highest - result.lowest);
    };
    const double coarsest_of_all = coarsest((result.lowest + result.highest) / 2);
    std::vector<Bin> bins = bins_of(windows);
    bins.erase(std::remove_if(bins.begin(), bins.end(), [](const Bin& b) { return b.steps.size() < 2; }), bins.end());
    result.ordinates.resize(bins.size());
    result.deviations.resize(bins.size());
    Team team(std::min(threads, 2));  // for more there is too little to do
    std::atomic<std::size_t> taken{0};
    team.run([&](int) {
        for (std::size_t i; (i = taken++) <= bins.size();) {
            if (i == 0) {
                result.deviation = deviation_of(windows.differences.data(), windows.steps.data(), windows.count, coarsest_of_all);
                std::vector<float> sizes(windows.differences);
                sizes.resize(windows.count);
                result.quiet = std::max(quartile_deviation(sizes) / per_difference,
                                        rounding_deviation(windows.steps.data(), windows.count, coarsest_of_all));
                continue;
            }
            Bin& bin = bins[i - 1];
            const std::size_t count = bin.steps.size();
            bin.differences.resize(count + padding);
            result.ordinates[i - 1] = bin.sum / static_cast<double>(count);
            result.deviations[i - 1] =
                deviation_of(bin.differences.data(), bin.steps.data(), count, coarsest(result.ordinates[i - 1]));
        }
    });
    return result;
}

template SingleNoise single_noise(const float*, int, int, bool, int);
template SingleNoise single_noise(const double*, int, int, bool, int);

}  // namespace rangeedge
