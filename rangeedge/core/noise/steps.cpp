// SPDX-License-Identifier: Apache-2.0
#include "noise/steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/simd.hpp"
#include "image/hole.hpp"
#include "noise/trimmed.hpp"

namespace rangeedge {
namespace {

constexpr int neighbours = 5;    // scan lines whose means are looked at
constexpr int most_groups = 12;  // of such neighbours, along rows, and along columns
constexpr int positions = 80;    // of windows on a scan line, at the most, and
constexpr int least_step = 8;    // samples from one to the next, at the least
constexpr int shortest_residuals = 16;
constexpr double edge_step = 20;           // deviations by which a step is no noise
constexpr std::size_t least_windows = 40;  // that tell a deviation

// The places of windows of n samples in a line, the same ones whichever end it begins at.
std::vector<int> places_of(int size, int n) {
    std::vector<int> places;
    const int last = size - n, step = std::max({least_step, n / 4, (last + positions - 1) / positions});
    for (int k = 0; 2 * k <= last; k += step) {
        places.push_back(k);
        if (2 * k < last) places.push_back(last - k);
    }
    return places;
}

// Interpolates the small holes of a line, as fits to it are made (scanline/bridge.hpp).
template <class T>
void bridge(T* y, int size) {
    int last = -1;  // sample with data
    for (int k = 0; k < size; ++k) {
        if (!std::isfinite(y[k])) continue;
        const Hole hole{last + 1, k};
        if (last >= 0 && hole.size() > 0 && hole.size() <= most_bridged) interpolate(hole, y);
        last = k;
    }
}

double finite_deviation(std::vector<float>& sizes, bool by_median) {
    constexpr float most = std::numeric_limits<float>::max();
    sizes.erase(std::remove_if(sizes.begin(), sizes.end(), [](float s) { return !(s <= most); }), sizes.end());
    const std::size_t count = sizes.size();
    if (count < least_windows) return std::nan("");
    sizes.resize(count + padding);
    return by_median ? median_deviation(sizes.data(), count) : normal_deviation(sizes.data(), count);
}

}  // namespace

Measure::Factors Measure::factors(const Steps& steps, int n) {
    slopes_.resize(steps.size());
    gaps_.resize(steps.size());
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const double per_sigma = 1 / sigma(steps.ordinate[i], n);
        slopes_[i] = static_cast<float>(std::abs(steps.slope[i]) * per_sigma);
        gaps_[i] = static_cast<float>(std::abs(steps.gap[i]) * per_sigma);
    }
    const bool by_median = n < 8;  // short fits to quantised values are often exact
    return {finite_deviation(slopes_, by_median), finite_deviation(gaps_, by_median)};
}

template <class T>
DirectionSteps::DirectionSteps(const T* ordinate, int lines, int size, std::ptrdiff_t line_step,
                               std::ptrdiff_t sample_step, bool silent)
    : size_(size), silent_(silent) {
    const int groups = std::min(most_groups, lines / neighbours), room = lines - neighbours;
    lines_.resize(static_cast<std::size_t>(groups * neighbours));
    Array<T> samples(static_cast<std::ptrdiff_t>(neighbours) * size);
    for (int group = 0; group < groups; ++group) {
        // Evenly spaced, and the same ones from either side.
        const int mirrored = groups - 1 - group;
        const auto place = [&](int i) { return static_cast<int>((2LL * i + 1) * room / (2LL * groups)); };
        const T* first = ordinate + (group <= mirrored ? place(group) : room - place(mirrored)) * line_step;
        for (int k = 0; k < size; ++k)
            for (int i = 0; i < neighbours; ++i) samples[i * size + k] = first[i * line_step + k * sample_step];
        for (int i = 0; i < neighbours; ++i) {
            bridge(samples.data() + i * size, size);
            lines_[static_cast<std::size_t>(group * neighbours + i)].read(samples.data() + i * size, size);
        }
    }
}

void DirectionSteps::look(Measure& measure) {
    for (int level = 0; level < measured_levels; ++level)
        look_at_steps(WindowSize(4 << level), measure, single[level], shared[level]);
    for (int n = longest_residuals; n >= shortest_residuals && residuals.size() < least_windows; n /= 2)
        look_at_residuals(WindowSize(n));
}

void DirectionSteps::look_at_steps(const WindowSize& window, Measure& measure, Steps& own, Steps& together) {
    const int n = window.n;
    const std::vector<int> places = places_of(size_, 3 * n);
    const double per_slope = std::sqrt(1 / (6 * window.per_m2));
    const double per_gap = 1 / std::sqrt(6.0 / n + n * n * window.per_m2 / 2);
    const double worth = 1 / std::sqrt(static_cast<double>(neighbours));
    struct Place {
        std::size_t line;
        int k;
    };
    std::vector<Place> found;
    const std::size_t most = places.size() * lines_.size();
    found.reserve(most), own.reserve(most), together.reserve(most / neighbours);
    for (std::size_t first = 0; first < lines_.size(); first += neighbours)
        for (const int k : places) {
            const std::size_t before = own.size();
            for (std::size_t i = first; i < first + neighbours; ++i) {
                const LineSums& line = lines_[i];
                if (!tells(line, k, 3 * n)) continue;
                const LineSums::Fit f1 = line.fit(k, window), f2 = line.fit(k + n, window),
                                    f3 = line.fit(k + 2 * n, window);
                own.add((f1.slope - 2 * f2.slope + f3.slope) * per_slope,
                        (f1.mean - 2 * f2.mean + f3.mean - (f3.slope - f1.slope) * n / 2) * per_gap, f2.mean);
                found.push_back({i, k});
            }
            if (own.size() - before < neighbours) continue;
            double slope = 0, gap = 0, ordinate = 0;
            for (std::size_t i = before; i < own.size(); ++i)
                slope += own.slope[i], gap += own.gap[i], ordinate += own.ordinate[i];
            together.add(worth * slope, worth * gap, ordinate / neighbours);
        }
    // Steps far beyond the rest are edges, which lie in the middle window.
    const Measure::Factors factors = measure.factors(own, n);
    std::vector<char> touched(lines_.size(), 0);
    for (std::size_t i = 0; i < found.size(); ++i) {
        const double limit = edge_step * measure.sigma(own.ordinate[i], n);
        if (!(std::abs(own.slope[i]) > limit * factors.slope || std::abs(own.gap[i]) > limit * factors.gap)) continue;
        lines_[found[i].line].block(found[i].k + n, n);
        touched[found[i].line] = 1;
    }
    for (std::size_t i = 0; i < lines_.size(); ++i)
        if (touched[i]) lines_[i].count_blocked();
}

void DirectionSteps::look_at_residuals(const WindowSize& window) {
    residuals = {};
    const std::vector<int> places = places_of(size_, window.n);
    for (const LineSums& line : lines_)
        for (const int k : places)
            if (tells(line, k, window.n))
                residuals.add(0, std::sqrt(line.residual_squares(k, window) / (window.n - 3)),
                              line.fit(k, window).mean);
}

template DirectionSteps::DirectionSteps(const float*, int, int, std::ptrdiff_t, std::ptrdiff_t, bool);
template DirectionSteps::DirectionSteps(const double*, int, int, std::ptrdiff_t, std::ptrdiff_t, bool);

}  // namespace rangeedge
