// SPDX-License-Identifier: Apache-2.0
#include "noise/fits.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "base/parallel.hpp"
#include "base/simd.hpp"
#include "noise/least_squares.hpp"
#include "noise/steps.hpp"
#include "noise/trimmed.hpp"

namespace rangeedge {
namespace {

constexpr int wave_level = 2;  // n = 16, which tells the waves
constexpr std::size_t depth_bins = 12;
constexpr std::size_t least_in_bin = 40;  // steps
constexpr double most_growth = 1.41;      // of a factor from n to 2 n, beyond what is measured
constexpr double smooth_growth = 5.66;    // the same of waves without an end, 2^2.5: more than that is no noise
// Of factors on slopes, at the most, where single values are noisy and waves have no end, as shapes have none: waves of
// eight times the deviation of single values.
constexpr double most_slope[FitFactors::levels] = {6, 14, 24, 36, 45};
const double most_shared = std::sqrt(5.0);  // over factors of one line: five lines that err alike
constexpr double value_per_slope = 0.5;     // of factors, at the least: a wrong slope makes the value at the end wrong
constexpr double least_factor = 0.5;        // errors that cancel each other are not relied on
constexpr double most_factor = 1e6;         // more is no noise, but the rounding of numbers that are hardly any
constexpr double median_magnitude = 0.67449;  // of a normal variable, where a median of deviations is looked for
constexpr double residual_factor = 1.25;  // for what the curves of splitting, through three samples, are off themselves
constexpr double most_residual = 12;      // times the factor on slopes of the shortest fits

using FoundSteps = std::optional<DirectionSteps>[2];  // along rows, and along columns

// The ordinate and the size of a step.
struct Size {
    double ordinate, slope;
};

// Puts those of every bin from `first` on, and before `last`, into its place, in any order.
void put_in_bins(std::vector<Size>& sizes, std::size_t first, std::size_t last) {
    if (last - first < 2) return;
    const auto at = [&](std::size_t bin) {
        return sizes.begin() + static_cast<std::ptrdiff_t>(bin * sizes.size() / depth_bins);
    };
    const std::size_t middle = (first + last) / 2;
    std::nth_element(at(first), at(middle), at(last),
                     [](const Size& a, const Size& b) { return a.ordinate < b.ordinate; });
    put_in_bins(sizes, first, middle);
    put_in_bins(sizes, middle, last);
}

// How the deviation of |D| for n = 16 grows with depth, in units of `single` on the whole.
Deviation waves_of(const FoundSteps& found, bool projective, const Deviation& single) {
    if (!projective) return single;
    std::vector<Size> steps;
    for (int direction = 0; direction < 2; ++direction) {
        const Steps& own = found[direction]->single[wave_level];
        for (std::size_t i = 0; i < own.size(); ++i) steps.push_back({own.ordinate[i], std::abs(own.slope[i])});
    }
    if (steps.size() < depth_bins * least_in_bin) return single;
    put_in_bins(steps, 0, depth_bins);
    std::vector<double> depths, deviations;
    std::vector<float> sizes(steps.size() + padding);
    for (std::size_t bin = 0; bin < depth_bins; ++bin) {
        const std::size_t begin = bin * steps.size() / depth_bins, end = (bin + 1) * steps.size() / depth_bins;
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) {
            sum += steps[i].ordinate;
            sizes[i - begin] = static_cast<float>(steps[i].slope);
        }
        const double z = static_cast<double>(end - begin) / sum;
        const double deviation = normal_deviation(sizes.data(), end - begin) * z * z;
        if (!(deviation > 0) || !std::isfinite(deviation) || !std::isfinite(z)) continue;
        depths.push_back(z);
        deviations.push_back(deviation);
    }
    const Deviation shape = fitted_deviation(depths, deviations, {0, 2, 3});
    std::size_t count = 0;
    for (const Size& s : steps) {
        const double z = 1 / s.ordinate;
        sizes[count] = static_cast<float>(single.of_length(z) / shape.of_length(z));
        count += std::isfinite(sizes[count]);
    }
    return count == 0 ? single : shape.times(static_cast<double>(ranked(sizes.data(), count, count / 2)));
}

// Factors at all levels from those that are measured, the rest by how the last ones grow.
void write_factors(const double* measured, double* factors) {
    double last = 1, before = 1;
    for (int level = 0; level < FitFactors::levels; ++level) {
        double factor = level < measured_levels ? measured[level] : std::nan("");
        if (!(factor == factor)) factor = last * std::max(1.0, std::min(most_growth, last / before));
        before = last, last = level == 0 ? factor : std::min(factor, smooth_growth * last);
        factors[level] = std::min(std::max(last, level == 0 ? 1.0 : least_factor), most_factor);
    }
}

void write_fit_noise(const DirectionSteps& found, Measure& measure, bool silent, double* numbers) {
    double measured[4][measured_levels];
    for (int level = 0; level < measured_levels; ++level) {
        const Measure::Factors own = measure.factors(found.single[level], 4 << level);
        const Measure::Factors together = measure.factors(found.shared[level], 4 << level);
        measured[0][level] = own.slope, measured[1][level] = own.gap;
        measured[2][level] = together.slope, measured[3][level] = together.gap;
    }
    for (int kind = 0; kind < 4; ++kind) write_factors(measured[kind], numbers + kind * FitFactors::levels);
    const bool waves_end = measured[0][wave_level + 1] <= most_growth * measured[0][wave_level];
    for (int level = 0; level < FitFactors::levels; ++level) {
        double *slope = numbers + level, *value = slope + FitFactors::levels;
        double *shared_slope = value + FitFactors::levels, *shared_value = shared_slope + FitFactors::levels;
        if (!silent && !waves_end) *slope = std::min(*slope, most_slope[level]);
        *value = std::min(std::max(*value, value_per_slope * *slope), *slope);
        *shared_slope = std::max(std::min(*shared_slope, most_shared * *slope), *slope);
        *shared_value =
            std::max({std::min(*shared_value, most_shared * *value), *value, value_per_slope * *shared_slope});
    }
    const double residual =
        residual_factor * median_magnitude * measure.factors(found.residuals, longest_residuals).gap;
    numbers[4 * FitFactors::levels] = residual >= 1 ? std::min(residual, most_residual * numbers[0]) : 1;
}

}  // namespace

template <class T>
FitNoiseEstimate fit_noise(const T* ordinate, int rows, int cols, bool projective, const Deviation& single, bool silent,
                           Team& team) {
    FoundSteps found;
    parallel_for(2, team, [&](int begin, int end, int) {
        Measure measure(single, single, projective);
        for (int i = begin; i < end; ++i) {
            if (i == 0)
                found[0].emplace(ordinate, rows, cols, cols, 1, silent);
            else
                found[1].emplace(ordinate, cols, rows, 1, cols, silent);
            found[i]->look(measure);
        }
    });
    FitNoiseEstimate estimate{};
    estimate.waves = waves_of(found, projective, single);
    double* const numbers[2] = {estimate.rows, estimate.cols};
    parallel_for(2, team, [&](int begin, int end, int) {
        Measure measure(single, estimate.waves, projective);
        for (int i = begin; i < end; ++i) write_fit_noise(*found[i], measure, silent, numbers[i]);
    });
    return estimate;
}

template FitNoiseEstimate fit_noise(const float*, int, int, bool, const Deviation&, bool, Team&);
template FitNoiseEstimate fit_noise(const double*, int, int, bool, const Deviation&, bool, Team&);

}  // namespace rangeedge
