// SPDX-License-Identifier: Apache-2.0
#include "noise/trimmed.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "base/simd.hpp"

namespace rangeedge {
namespace {

constexpr double kept_share = 0.75;
constexpr double kept_deviation = 0.607;       // of a normal variable of deviation 1, within its central 75 %
constexpr double median_magnitude = 0.67449;   // of that variable
constexpr double quarter_magnitude = 0.31864;  // the lower quartile of its magnitudes
constexpr double tenth_magnitude = 0.12566;    // and their lowest tenth
constexpr double quarter_spread = 1.8;         // of that quartile of n values, as a part of it, times the root of n
constexpr double tenth_spread = 3;
constexpr int dropped_bits = 20;  // of a float that its bucket does not tell: 8 buckets an octave are left

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

// Magnitudes counted by buckets of their leading bits; within a bucket they are sorted only where a rank falls into it.
class Histogram {
public:
    Histogram(const float* values, std::size_t count) : values_(values), count_(count) {
        std::size_t k = 0;
        for (; k + 4 <= count; k += 4)  // apart, since equal values follow each other
            for (std::size_t i = 0; i < 4; ++i) ++counts_[i][bucket(values[k + i])];
        for (; k < count; ++k) ++counts_[0][bucket(values[k])];
        for (std::size_t i = 1; i < 4; ++i)
            for (std::size_t b = 0; b < buckets; ++b) counts_[0][b] += counts_[i][b];
    }
    // The value of a rank, 0 being that of the smallest.
    float value(std::size_t rank) const {
        const Place place = find(rank);
        return place.within[place.rank];
    }
    // The sum of the squares of the smallest, as many as `count` > 0.
    double squares(std::size_t count) const {
        const Place place = find(count - 1);
        double sum = squares_below(values_, count_, static_cast<std::int32_t>(place.bucket << dropped_bits));
        for (std::size_t k = 0; k <= place.rank; ++k)
            sum += static_cast<double>(place.within[k]) * static_cast<double>(place.within[k]);
        return sum;
    }

private:
    // The values of one bucket, in order at their own rank.
    struct Place {
        std::size_t bucket, rank;
        std::vector<float> within;
    };
    Place find(std::size_t rank) const {
        Place place{0, rank, {}};
        while (counts_[0][place.bucket] <= place.rank) place.rank -= counts_[0][place.bucket++];
        place.within.resize(counts_[0][place.bucket] + 1);
        std::size_t found = 0;
        for (std::size_t k = 0; k < count_; ++k) {  // without branches: each is written, and then counted if it belongs
            place.within[found] = values_[k];
            found += bucket(values_[k]) == place.bucket;
        }
        place.within.pop_back();
        const auto begin = place.within.begin();
        std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(place.rank), place.within.end());
        return place;
    }

    static constexpr std::size_t buckets = std::size_t{1} << (31 - dropped_bits);
    static std::size_t bucket(float value) {
        std::uint32_t bits;
        std::memcpy(&bits, &value, sizeof bits);
        return bits >> dropped_bits;
    }

    const float* values_;
    std::size_t count_;
    std::uint32_t counts_[4][buckets] = {};
};

}  // namespace

double trimmed_deviation(const float* magnitudes, std::size_t count) {
    const auto kept = static_cast<std::size_t>(kept_share * static_cast<double>(count));
    if (kept == 0) return 0;
    return std::sqrt(Histogram(magnitudes, count).squares(kept) / static_cast<double>(kept)) / kept_deviation;
}

float ranked(const float* magnitudes, std::size_t count, std::size_t rank) {
    return Histogram(magnitudes, count).value(rank);
}

std::vector<float> ranked(const float* magnitudes, std::size_t count, const std::vector<std::size_t>& ranks) {
    const Histogram histogram(magnitudes, count);
    std::vector<float> values;
    for (const std::size_t rank : ranks) values.push_back(histogram.value(rank));
    return values;
}

double quartile_deviation(const float* magnitudes, std::size_t count) {
    return count == 0 ? 0 : static_cast<double>(ranked(magnitudes, count, count / 4)) / quarter_magnitude;
}

double median_deviation(const float* magnitudes, std::size_t count) {
    return count == 0 ? 0 : static_cast<double>(ranked(magnitudes, count, count / 2)) / median_magnitude;
}

double normal_deviation(const float* magnitudes, std::size_t count) {
    if (count == 0) return 0;
    const Histogram histogram(magnitudes, count);
    const double error = 2 / std::sqrt(static_cast<double>(count));
    const auto by_rank = [&](std::size_t rank, double magnitude, double spread) {
        return (1 + spread * error) * static_cast<double>(histogram.value(rank)) / magnitude;
    };
    return std::min({by_rank(count / 2, median_magnitude, 0), by_rank(count / 4, quarter_magnitude, quarter_spread),
                     by_rank(count / 10, tenth_magnitude, tenth_spread)});
}

}  // namespace rangeedge
