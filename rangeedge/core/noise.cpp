// SPDX-License-Identifier: Apache-2.0
#include "noise.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "parallel.hpp"

namespace rangeedge {
namespace {

constexpr int lag = 6;                        // samples: noise of neighbours this far apart counts as independent
constexpr std::ptrdiff_t windows = 1 << 15;   // along rows, and along columns, that the estimate rests on at most
constexpr std::size_t most_bins = 8;
constexpr std::size_t bin_size = 50;          // differences that a bin needs
constexpr double trim = 0.75;                 // share of the differences, the small ones, that the estimate rests on
constexpr double trimmed_normal = 0.607;      // deviation of a normal variable within its central 75 %
constexpr double quantised = 0.05;            // share of differences other than zero that tells steps from edges
constexpr double least_moved = 0.05;          // quantile of these that stands for one step

// Values by rank. They are put into buckets by size; of a bucket only the ranks asked for are found.
class Ranked {
public:
    explicit Ranked(const std::vector<float>& values) : values_(values.size()), starts_(buckets + 1, 0) {
        std::uint32_t highest = 0;
        for (const float v : values) lowest_ = std::min(lowest_, key(v)), highest = std::max(highest, key(v));
        while (values.size() > 0 && (highest - lowest_) >> shift_ >= buckets) ++shift_;
        for (const float v : values) ++starts_[bucket(v) + 1];
        for (std::size_t b = 0; b < buckets; ++b) starts_[b + 1] += starts_[b];
        std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
        for (const float v : values) values_[next[bucket(v)]++] = v;
    }
    std::size_t size() const { return values_.size(); }
    double at(std::size_t rank) {
        const auto above = std::upper_bound(starts_.begin(), starts_.end(), rank);
        const auto place = [this](std::size_t k) { return values_.begin() + static_cast<std::ptrdiff_t>(k); };
        std::nth_element(place(*(above - 1)), place(rank), place(*above));
        return static_cast<double>(values_[rank]);
    }
    // The sum of the squares of the `count` smallest.
    double squares(std::size_t count) {
        if (count == 0) return 0;
        at(count - 1);
        double sums[4] = {};
        for (std::size_t k = 0; k < count; ++k) sums[k % 4] += static_cast<double>(values_[k]) * static_cast<double>(values_[k]);
        return (sums[0] + sums[1]) + (sums[2] + sums[3]);
    }

private:
    static constexpr std::uint32_t buckets = 1 << 12;

    // In the order of the values.
    static std::uint32_t key(float value) {
        std::uint32_t bits;
        std::memcpy(&bits, &value, sizeof bits);
        return bits >> 31 ? ~bits : bits | 0x80000000u;
    }
    std::size_t bucket(float value) const { return (key(value) - lowest_) >> shift_; }

    std::vector<float> values_;
    std::vector<std::uint32_t> starts_;  // of the buckets in values_
    std::uint32_t lowest_ = ~0u;
    int shift_ = 0;
};

// |y0 - 3 y1 + 3 y2 - y3| of samples a lag apart, and the means of the four. The mean of a window is independent of
// its difference, so that bins of it do not select among the differences. Windows with invalid pixels are left out, and
// of a large image every so many lines are enough.
struct Differences {
    std::vector<float> sizes, ordinates;

    // Of `count` windows: the i-th begins at y + i * step, its samples are `apart`.
    template <class T>
    void add(const T* y, std::ptrdiff_t count, std::ptrdiff_t step, std::ptrdiff_t apart) {
        const std::size_t end = sizes.size() + static_cast<std::size_t>(count);
        std::size_t found = sizes.size();
        sizes.resize(end);
        ordinates.resize(end);
        constexpr float most = std::numeric_limits<float>::max();
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            const T* first = y + i * step;
            const double y0 = static_cast<double>(first[0]), y1 = static_cast<double>(first[apart]);
            const double y2 = static_cast<double>(first[2 * apart]), y3 = static_cast<double>(first[3 * apart]);
            sizes[found] = static_cast<float>(std::abs(y3 - y0 - 3 * (y2 - y1)));
            ordinates[found] = static_cast<float>((y0 + y1 + y2 + y3) / 4);
            found += sizes[found] <= most && std::abs(ordinates[found]) <= most;  // not so with NaN
        }
        sizes.resize(found);
        ordinates.resize(found);
    }
};

template <class T>
Differences differences_of(const T* ordinate, std::ptrdiff_t rows, std::ptrdiff_t cols, std::ptrdiff_t apart) {
    Differences differences;
    const std::ptrdiff_t every = 1 + rows * cols / windows;
    for (std::ptrdiff_t v = 0; v + 3 * apart < rows; ++v)  // down the columns
        differences.add(ordinate + v * cols, (cols + every - 1) / every, every, apart * cols);
    for (std::ptrdiff_t v = 0; v < rows; v += every)
        if (cols > 3 * apart) differences.add(ordinate + v * cols, cols - 3 * apart, 1, apart);
    return differences;
}

// Deviation of the noise behind third differences, of which few lie across edges.
double trimmed_deviation(const std::vector<float>& differences) {
    Ranked ranked(differences);
    const auto kept = static_cast<std::size_t>(trim * static_cast<double>(ranked.size()));
    if (kept == 0) return 0;
    const double sigma = std::sqrt(ranked.squares(kept) / static_cast<double>(kept) / 20) / trimmed_normal;
    // Where values are coarsely quantised most differences are zero and the others multiples of the step; the least of
    // these, unless they are so few that they are edges, bounds the deviation by that of rounding.
    const auto zeros = static_cast<std::size_t>(std::count(differences.begin(), differences.end(), 0.0f));
    const auto moved = static_cast<double>(ranked.size() - zeros);
    if (moved == 0 || moved < quantised * static_cast<double>(ranked.size())) return sigma;
    return std::max(sigma, ranked.at(zeros + static_cast<std::size_t>(least_moved * moved)) / std::sqrt(12.0));
}

// The deviation by ordinate, for bins of equally many differences.
void fill_bins(const Differences& differences, int threads, NoiseStatistics& result) {
    const std::size_t size = differences.sizes.size();
    const std::size_t count = std::max<std::size_t>(1, std::min(most_bins, size / bin_size));
    Ranked ranked(differences.ordinates);
    result.lowest = ranked.at(0), result.highest = ranked.at(size - 1);
    std::vector<float> borders;
    for (std::size_t i = 1; i < count; ++i) {
        const double at = static_cast<double>(i) / static_cast<double>(count) * static_cast<double>(size - 1);
        const auto below = static_cast<std::size_t>(at);
        const double low = ranked.at(below), high = ranked.at(below + 1);
        borders.push_back(static_cast<float>(low + (at - static_cast<double>(below)) * (high - low)));
    }
    std::vector<std::vector<float>> bins(count);
    for (auto& bin : bins) bin.reserve(2 * size / count);
    for (std::size_t k = 0; k < size; ++k) {
        std::size_t bin = 0;
        for (const float border : borders) bin += differences.ordinates[k] > border;
        bins[bin].push_back(differences.sizes[k]);
    }
    std::size_t start = 0;
    for (const auto& bin : bins) {
        const std::size_t end = start + bin.size();
        if (start < end) result.ordinates.push_back((ranked.at((start + end - 1) / 2) + ranked.at((start + end) / 2)) / 2);
        start = end;
    }
    bins.erase(std::remove_if(bins.begin(), bins.end(), [](const auto& bin) { return bin.empty(); }), bins.end());
    result.deviations.resize(bins.size());
    parallel_for(static_cast<int>(bins.size()), threads, [&](int begin, int end, int) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
            result.deviations[i] = trimmed_deviation(bins[i]);
    });
}

}  // namespace

template <class T>
NoiseStatistics noise_statistics(const T* ordinate, int rows, int cols, int threads) {
    NoiseStatistics result;
    Differences near;
    parallel_for(2, threads, [&](int begin, int end, int) {
        for (int i = begin; i < end; ++i) {
            if (i == 0) {
                near = differences_of(ordinate, rows, cols, 1);
                result.near = trimmed_deviation(near.sizes);
            } else {
                result.far = trimmed_deviation(differences_of(ordinate, rows, cols, lag).sizes);
            }
        }
    });
    if (!near.sizes.empty()) fill_bins(near, threads, result);
    return result;
}

template NoiseStatistics noise_statistics(const float*, int, int, int);
template NoiseStatistics noise_statistics(const double*, int, int, int);

}  // namespace rangeedge
