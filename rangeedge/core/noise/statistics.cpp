// SPDX-License-Identifier: Apache-2.0
#include "noise/statistics.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>

#include "base/parallel.hpp"
#include "base/simd.hpp"

namespace rangeedge {
namespace {

constexpr int lag = 6;                       // samples: noise of neighbours this far apart counts as independent
constexpr std::ptrdiff_t windows = 1 << 15;  // along rows, and along columns, that the estimate rests on at most
constexpr std::size_t max_bins = 8;
constexpr std::size_t bin_size = 50;      // differences that a bin needs
constexpr double trim = 0.75;             // share of the differences, the small ones, that the estimate rests on
constexpr double trimmed_normal = 0.607;  // deviation of a normal variable within its central 75 %
constexpr double quantised_share = 0.05;  // share of differences other than zero that tells steps from edges
constexpr double step_quantile = 0.05;    // quantile of these that stands for one step

// Values by rank, for many ranks: they are put into buckets by size; of a bucket only the ranks asked for are found.
class Ranked {
public:
    Ranked(const float* values, std::size_t count) : values_(count), starts_(buckets + 1, 0) {
        std::uint32_t highest = 0;
        for (std::size_t k = 0; k < count; ++k) {
            lowest_ = std::min(lowest_, key(values[k]));
            highest = std::max(highest, key(values[k]));
        }
        while ((highest - lowest_) >> shift_ >= buckets) ++shift_;
        for (std::size_t k = 0; k < count; ++k) ++starts_[bucket(values[k]) + 1];
        for (std::size_t b = 0; b < buckets; ++b) starts_[b + 1] += starts_[b];
        std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
        for (std::size_t k = 0; k < count; ++k) values_[next[bucket(values[k])]++] = values[k];
    }
    double at(std::size_t rank) {
        const auto above = std::upper_bound(starts_.begin(), starts_.end(), rank);
        const auto place = [this](std::size_t k) { return values_.begin() + static_cast<std::ptrdiff_t>(k); };
        std::nth_element(place(*(above - 1)), place(rank), place(*above));
        return static_cast<double>(values_[rank]);
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
    std::size_t count = 0;
    std::vector<float> sizes, ordinates;  // with `padding` more

    // Of windows that begin at y + i * step and whose samples are `apart`.
    template <class T>
    void add(const T* y, std::ptrdiff_t number, std::ptrdiff_t step, std::ptrdiff_t apart) {
        constexpr float most = std::numeric_limits<float>::max();
        std::size_t n = count;
        for (std::ptrdiff_t i = 0; i < number; ++i) {
            const T* first = y + i * step;
            const double y0 = static_cast<double>(first[0]), y1 = static_cast<double>(first[apart]);
            const double y2 = static_cast<double>(first[2 * apart]), y3 = static_cast<double>(first[3 * apart]);
            const auto size = static_cast<float>(std::abs(y3 - y0 - 3 * (y2 - y1)));
            const auto mean = static_cast<float>((y0 + y1 + y2 + y3) / 4);
            sizes[n] = size;
            ordinates[n] = mean;
            n += (size <= most) & (std::abs(mean) <= most);  // not so with NaN
        }
        count = n;
    }
};

template <class T>
Differences differences_of(const T* ordinate, std::ptrdiff_t rows, std::ptrdiff_t cols, std::ptrdiff_t apart) {
    const std::ptrdiff_t every = 1 + rows * cols / windows, used_cols = (cols + every - 1) / every;
    const std::ptrdiff_t down = std::max<std::ptrdiff_t>(0, rows - 3 * apart);
    const std::ptrdiff_t along = std::max<std::ptrdiff_t>(0, cols - 3 * apart);
    Differences differences;
    const auto room = static_cast<std::size_t>(down * used_cols + along * ((rows + every - 1) / every) + padding);
    differences.sizes.resize(room);
    differences.ordinates.resize(room);
    for (std::ptrdiff_t v = 0; v < down; ++v) differences.add(ordinate + v * cols, used_cols, every, apart * cols);
    for (std::ptrdiff_t v = 0; v < rows; v += every) differences.add(ordinate + v * cols, along, 1, apart);
    return differences;
}

constexpr int dropped = 20;  // bits of a value that its bucket does not tell: 8 buckets an octave are left

// The sum of the squares of values whose bits, as an integer, are below a limit.
template <int bytes>
RANGEEDGE_INLINE double squares_below_in(const float* values, std::size_t count, std::int32_t limit) {
    using D = Doubles<bytes>;
    using F = Floats<bytes>;
    D sum = D::all(0);
    float kept[F::count];
    for (std::size_t k = 0; k < count; k += F::count) {
        F v = F::load(values + k);
        v = from_bits(bits(v) & sign_mask(bits(v) - Ints<bytes>::all(limit)));
        if (count - k < F::count) v = keep_first(v, static_cast<int>(count - k));
        v.store(kept);
        for (int half = 0; half < F::count; half += D::count) {
            const D d = load_doubles<bytes>(kept + half);
            sum += d * d;
        }
    }
    return sum.sum();
}
RANGEEDGE_VERSIONS(double, squares_below, (const float* values, std::size_t count, std::int32_t limit),
                   (values, count, limit))

// Values, none negative, for one rank or two: only counted by buckets, and collected from the one that is asked for.
class Histogram {
public:
    // `padding` more values than `count` may be read.
    Histogram(const float* values, std::size_t count) : values_(values), count_(count) {
        std::size_t k = 0;
        for (; k + 4 <= count; k += 4)  // apart, since equal values follow each other
            for (std::size_t i = 0; i < 4; ++i) ++counts_[i][bucket(values[k + i])];
        for (; k < count; ++k) ++counts_[0][bucket(values[k])];
        for (std::size_t i = 1; i < 4; ++i)
            for (std::size_t b = 0; b < buckets; ++b) counts_[0][b] += counts_[i][b];
    }
    std::size_t zeros() const { return counts_[0][0]; }  // or all but zero
    // The sum of the squares of the smallest, as many as `count`.
    double squares(std::size_t count) {
        const auto [b, before] = find(count - 1);
        collect(b, count - 1 - before);
        double sum = squares_below(values_, count_, static_cast<std::int32_t>(b << dropped));
        for (std::size_t k = 0; k < count - before; ++k) {
            const auto v = static_cast<double>(within_[k]);
            sum += v * v;
        }
        return sum;
    }
    // Whether the value of that rank may exceed another one; only then it is worth finding.
    bool may_exceed(std::size_t rank, double other) const {
        const std::uint32_t above = static_cast<std::uint32_t>(find(rank).first + 1) << dropped;
        float most;
        std::memcpy(&most, &above, sizeof most);
        return !(static_cast<double>(most) <= other);
    }
    double at(std::size_t rank) {
        const auto [b, before] = find(rank);
        collect(b, rank - before);
        return static_cast<double>(within_[rank - before]);
    }

private:
    static constexpr std::size_t buckets = std::size_t{1} << (31 - dropped);
    static std::size_t bucket(float value) {
        std::uint32_t bits;
        std::memcpy(&bits, &value, sizeof bits);
        return bits >> dropped;
    }
    // The bucket of a rank, and how many values are in those before it.
    std::pair<std::size_t, std::size_t> find(std::size_t rank) const {
        std::size_t b = 0, before = 0;
        while (before + counts_[0][b] <= rank) before += counts_[0][b++];
        return {b, before};
    }
    // The values of a bucket, the one of rank n among them in its place.
    void collect(std::size_t b, std::size_t n) {
        within_.resize(counts_[0][b] + 1);
        std::size_t found = 0;
        for (std::size_t k = 0; k < count_; ++k) {
            within_[found] = values_[k];
            found += bucket(values_[k]) == b;
        }
        std::nth_element(within_.begin(), within_.begin() + static_cast<std::ptrdiff_t>(n), within_.end() - 1);
    }

    const float* values_;
    std::size_t count_;
    std::uint32_t counts_[4][buckets] = {};
    std::vector<float> within_;  // one more than there are
};

// Deviation of the noise behind third differences, of which few lie across edges. `padding` more may be read.
double trimmed_deviation(const float* differences, std::size_t count) {
    const auto size = static_cast<double>(count);
    const auto kept = static_cast<std::size_t>(trim * size);
    if (kept == 0) return 0;
    Histogram histogram(differences, count);
    const double sigma = std::sqrt(histogram.squares(kept) / static_cast<double>(kept) / 20) / trimmed_normal;
    // Where values are coarsely quantised most differences are zero and the others multiples of the step; the least of
    // these, unless they are so few that they are edges, bounds the deviation by that of rounding.
    const double others = size - static_cast<double>(histogram.zeros());
    if (others == 0 || others < quantised_share * size) return sigma;
    const std::size_t least = histogram.zeros() + static_cast<std::size_t>(step_quantile * others);
    const double rounding = std::sqrt(12.0);
    return histogram.may_exceed(least, sigma * rounding) ? std::max(sigma, histogram.at(least) / rounding) : sigma;
}

// The differences in bins of as many each, by ordinate, with `padding` more, and the median ordinates of these.
std::vector<std::vector<float>> binned(const Differences& differences, NoiseStatistics& result) {
    const std::size_t size = differences.count;
    const std::size_t count = std::max<std::size_t>(1, std::min(max_bins, size / bin_size));
    Ranked ranked(differences.ordinates.data(), size);
    result.lowest = ranked.at(0), result.highest = ranked.at(size - 1);
    std::array<float, max_bins> borders;
    borders.fill(std::numeric_limits<float>::infinity());
    for (std::size_t i = 1; i < count; ++i) {
        const double at = static_cast<double>(i) / static_cast<double>(count) * static_cast<double>(size - 1);
        const auto below = static_cast<std::size_t>(at);
        const double low = ranked.at(below), high = ranked.at(below + 1);
        borders[i - 1] = static_cast<float>(low + (at - static_cast<double>(below)) * (high - low));
    }
    std::vector<std::vector<float>> bins(count);
    for (auto& bin : bins) bin.reserve(size / count + size / 16 + padding);
    for (std::size_t k = 0; k < size; ++k) {
        std::size_t bin = 0;
        for (const float border : borders) bin += differences.ordinates[k] > border;
        bins[bin].push_back(differences.sizes[k]);
    }
    bins.erase(std::remove_if(bins.begin(), bins.end(), [](const auto& bin) { return bin.empty(); }), bins.end());
    std::size_t start = 0;
    for (auto& bin : bins) {
        const std::size_t end = start + bin.size();
        result.ordinates.push_back((ranked.at((start + end - 1) / 2) + ranked.at((start + end) / 2)) / 2);
        start = end;
        bin.resize(bin.size() + padding);
    }
    return bins;
}

}  // namespace

template <class T>
NoiseStatistics noise_statistics(const T* ordinate, int rows, int cols, int threads) {
    NoiseStatistics result;
    Differences near;
    std::vector<std::vector<float>> bins;
    Team team(std::min(threads, 2));  // for more there is too little to do
    parallel_for(2, team, [&](int begin, int end, int) {
        for (int i = begin; i < end; ++i) {
            if (i == 0) {
                near = differences_of(ordinate, rows, cols, 1);
                if (near.count > 0) bins = binned(near, result);
            } else {
                const Differences far = differences_of(ordinate, rows, cols, lag);
                result.far = trimmed_deviation(far.sizes.data(), far.count);
            }
        }
    });
    // That of all, and those of the bins.
    result.deviations.resize(bins.size());
    std::atomic<std::size_t> taken{0};
    team.run([&](int) {
        for (std::size_t i; (i = taken++) <= bins.size();) {
            if (i == 0)
                result.near = trimmed_deviation(near.sizes.data(), near.count);
            else
                result.deviations[i - 1] = trimmed_deviation(bins[i - 1].data(), bins[i - 1].size() - padding);
        }
    });
    return result;
}

template NoiseStatistics noise_statistics(const float*, int, int, int);
template NoiseStatistics noise_statistics(const double*, int, int, int);

}  // namespace rangeedge
