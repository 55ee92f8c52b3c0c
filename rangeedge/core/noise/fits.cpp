// SPDX-License-Identifier: Apache-2.0
#include "noise/fits.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "base/array.hpp"
#include "base/parallel.hpp"
#include "noise/least_squares.hpp"
#include "noise/trimmed.hpp"

namespace rangeedge {
namespace {

constexpr int neighbours = 5;       // scan lines whose means are looked at
constexpr int most_groups = 12;     // of such neighbours, along rows, and along columns
constexpr int positions = 80;       // of windows on a scan line, at the most, and
constexpr int least_step = 8;       // samples from one to the next, at the least
constexpr int measured_levels = 4;  // n = 4, 8, 16, 32
constexpr int wave_level = 2;       // n = 16, which tells the waves
constexpr int longest = 64, shortest = 16;  // samples of a window whose residuals are looked at
constexpr double edge_step = 9;     // deviations by which a step is no noise
constexpr std::size_t least_windows = 40;  // that tell a deviation
constexpr std::size_t depth_bins = 12;
constexpr double most_growth = 1.41;       // of a factor from n to 2 n, beyond what is measured
constexpr double smooth_growth = 5.66;     // the same of waves without an end, 2^2.5: more than that is no noise
// Of factors on slopes, at the most, where single values are noisy: waves of eight times their deviation.
constexpr double most_slope[FitFactors::levels] = {6, 14, 24, 36, 45};
const double most_shared = std::sqrt(static_cast<double>(neighbours));  // over factors of one line: all err alike
constexpr double value_per_slope = 0.5;    // of factors, at the least: a wrong slope makes the value at the end wrong
constexpr double least_factor = 0.5;       // errors that cancel each other are not relied on
constexpr double median_magnitude = 0.67449;  // of a normal variable, where a median of deviations is looked for
constexpr double residual_factor = 1.25;   // for what the curves of splitting, through three samples, are off themselves
constexpr double most_residual = 12;       // times the factor on slopes of the shortest fits

double m2(double n) { return n * (n * n - 1) / 12; }

// Sums over the first samples of a scan line, from which those over any window follow. Ordinates are counted from the
// first one with data, places from the middle of the line.
class LineSums {
public:
    // Of `size` samples, `step` apart.
    template <class T>
    void read(const T* y, int size, std::ptrdiff_t step) {
        sums_.resize(size + 1);
        middle_ = (size - 1) / 2.0;
        base_ = 0;
        for (int k = 0; k < size; ++k)
            if (std::isfinite(y[k * step])) {
                base_ = static_cast<double>(y[k * step]);
                break;
            }
        Sums sum{};
        double last = 0;
        for (int k = 0; k < size; ++k) {
            sums_[k] = sum;
            const auto value = static_cast<double>(y[k * step]);
            const bool valid = std::isfinite(value);
            const double h = valid ? value - base_ : 0, t = k - middle_;
            sum.h += h, sum.ht += h * t, sum.htt += h * t * t, sum.hh += h * h;
            sum.invalid += !valid;
            sum.changes += h != last;
            last = h;
        }
        sums_[size] = sum;
    }

    // A straight line fitted to the n samples from k.
    struct Fit {
        double mean, slope;
    };
    Fit fit(int k, int n) const {
        const Window w = window(k, n);
        return {base_ + w.h / n, w.ht / m2(n)};
    }
    // Sum of squared residuals of the quadratic fitted to them.
    double residual_squares(int k, int n) const {
        const Window w = window(k, n);
        const double beta = (n * n - 1) / 12.0, norm2 = m2(n) * (n * n - 4.0) / 15, y2 = w.htt - beta * w.h;
        return std::max(0.0, w.hh - w.h * w.h / n - w.ht * w.ht / m2(n) - y2 * y2 / norm2);
    }
    bool valid(int k, int n) const { return sums_[k + n].invalid == sums_[k].invalid; }
    bool constant(int k, int n) const { return sums_[k + n].changes == sums_[k + 1].changes; }

private:
    struct Sums {
        double h, ht, htt, hh;
        int invalid, changes;
    };
    // Sums over a window, with t counted from its middle.
    struct Window {
        double h, ht, htt, hh;
    };
    Window window(int k, int n) const {
        const Sums &a = sums_[k], &b = sums_[k + n];
        const double shift = k + (n - 1) / 2.0 - middle_, h = b.h - a.h, ht = b.ht - a.ht - shift * h;
        return {h, ht, b.htt - a.htt - 2 * shift * (b.ht - a.ht) + shift * shift * h, b.hh - a.hh};
    }

    Array<Sums> sums_;
    double middle_ = 0, base_ = 0;
};

// D and G of three adjacent windows, over what white noise of unit deviation gives them, and the ordinate there.
struct Step {
    double slope, gap, ordinate;
};

Step step_of(const LineSums& line, int k, int n) {
    const LineSums::Fit f1 = line.fit(k, n), f2 = line.fit(k + n, n), f3 = line.fit(k + 2 * n, n);
    const double slope = f1.slope - 2 * f2.slope + f3.slope;
    const double gap = f1.mean - 2 * f2.mean + f3.mean - (f3.slope - f1.slope) * n / 2;
    return {slope / std::sqrt(6 / m2(n)), gap / std::sqrt(6.0 / n + n * n / (2 * m2(n))), f2.mean};
}

// Deviations of steps over the noise at their ordinates.
class Measure {
public:
    Measure(const Deviation& single, const Deviation& waves, bool projective)
        : single_(single), waves_(waves), projective_(projective) {}

    double sigma(const Step& s, int n) const {
        const double y = std::abs(s.ordinate);
        return SampleNoise{single_.of_ordinate(y, projective_), waves_.of_ordinate(y, projective_)}.of_fit(n);
    }
    // Of the slopes or the gaps of fits to n samples; NaN where too few tell it.
    double factor(const std::vector<Step>& steps, double Step::* number, int n) {
        sizes_.clear();
        for (const Step& s : steps) {
            const double size = std::abs(s.*number) / sigma(s, n);
            if (std::isfinite(size)) sizes_.push_back(static_cast<float>(size));
        }
        if (sizes_.size() < least_windows) return std::nan("");
        // Short fits to quantised values are often exact.
        return n < 8 ? median_deviation(sizes_) : normal_deviation(sizes_);
    }

private:
    Deviation single_, waves_;
    bool projective_;
    std::vector<float> sizes_;
};

// Calls visit(k) for places of windows of n samples in a line, the same ones whichever end it begins at.
template <class Visit>
void for_each_window(int size, int n, Visit&& visit) {
    const int last = size - n;
    if (last < 0) return;
    const int step = std::max({least_step, n / 4, (last + positions - 1) / positions});
    for (int k = 0; 2 * k <= last; k += step) {
        visit(k);
        if (2 * k < last) visit(last - k);
    }
}

// What windows show along one direction: of one line, and of neighbouring lines together.
class DirectionSteps {
public:
    // Of `lines` scan lines of `size` samples; `line_step` and `sample_step` lead from one to the next. Where the image
    // is `silent`, constant windows count.
    template <class T>
    DirectionSteps(const T* ordinate, int lines, int size, std::ptrdiff_t line_step, std::ptrdiff_t sample_step,
                   bool silent)
        : size_(size), silent_(silent) {
        const int groups = std::min(most_groups, lines / neighbours), room = lines - neighbours;
        for (int group = 0; group < groups; ++group) {
            // Evenly spaced, and the same ones from either side.
            const int mirrored = groups - 1 - group;
            const auto place = [&](int i) { return static_cast<int>((2LL * i + 1) * room / (2LL * groups)); };
            const int first = group <= mirrored ? place(group) : room - place(mirrored);
            for (int i = 0; i < neighbours; ++i) {
                lines_.emplace_back();
                lines_.back().read(ordinate + (first + i) * line_step, size, sample_step);
            }
        }
        edges_.assign(lines_.size(), Array<int>(size + 1, 0));
    }

    // The steps of all lengths, the shorter ones first: where one of these is an edge, longer windows do not count.
    void look(Measure& measure) {
        for (int level = 0; level < measured_levels; ++level) {
            const int n = 4 << level;
            std::vector<Found> found;
            for (std::size_t i = 0; i < lines_.size(); ++i)
                for_each_window(size_, 3 * n, [&](int k) {
                    if (tells(i, k, 3 * n)) found.push_back({step_of(lines_[i], k, n), i, k});
                });
            std::vector<Step>& steps = single[level];
            for (const Found& f : found) steps.push_back(f.step);
            add_shared(found, shared[level]);
            mark_edges(found, measure.factor(steps, &Step::slope, n), measure.factor(steps, &Step::gap, n), n, measure);
        }
        for (int n = longest; n >= shortest && residuals.size() < least_windows; n /= 2) {
            residuals.clear();
            for (std::size_t i = 0; i < lines_.size(); ++i)
                for_each_window(size_, n, [&](int k) {
                    if (!tells(i, k, n)) return;
                    const double deviation = std::sqrt(lines_[i].residual_squares(k, n) / (n - 3));
                    residuals.push_back({0, deviation, lines_[i].fit(k, n).mean});
                });
        }
    }

    std::vector<Step> single[measured_levels], shared[measured_levels];
    std::vector<Step> residuals;  // deviations of samples from long fits, as gaps

private:
    struct Found {
        Step step;
        std::size_t line;
        int place;
    };

    bool tells(std::size_t line, int k, int n) const {
        const LineSums& sums = lines_[line];
        return sums.valid(k, n) && (silent_ || !sums.constant(k, n)) && edges_[line][k + n] == edges_[line][k];
    }
    // The means of the steps of all lines of a group at one place; `found` is in the order of lines, then of places.
    static void add_shared(const std::vector<Found>& found, std::vector<Step>& shared) {
        std::vector<Found> group;
        for (std::size_t i = 0; i < found.size();) {
            const std::size_t first = i, number = found[i].line / neighbours;
            while (i < found.size() && found[i].line / neighbours == number) ++i;
            group.assign(found.begin() + static_cast<std::ptrdiff_t>(first), found.begin() + static_cast<std::ptrdiff_t>(i));
            std::stable_sort(group.begin(), group.end(), [](const Found& a, const Found& b) { return a.place < b.place; });
            for (std::size_t j = 0; j + neighbours <= group.size();) {
                if (group[j].place != group[j + neighbours - 1].place) {
                    ++j;
                    continue;
                }
                Step sum{};
                for (std::size_t k = j; k < j + neighbours; ++k) {
                    const Step& s = group[k].step;
                    sum.slope += s.slope, sum.gap += s.gap, sum.ordinate += s.ordinate;
                }
                const double worth = 1 / std::sqrt(static_cast<double>(neighbours));
                shared.push_back({worth * sum.slope, worth * sum.gap, sum.ordinate / neighbours});
                j += neighbours;
            }
        }
    }
    // Steps far beyond the rest, whose middle window becomes an edge.
    void mark_edges(const std::vector<Found>& found, double slope, double gap, int n, const Measure& measure) {
        std::vector<Array<int>> marks(lines_.size(), Array<int>(size_ + 1, 0));
        for (const Found& f : found) {
            const double limit = edge_step * measure.sigma(f.step, n);
            if (!(std::abs(f.step.slope) > limit * slope || std::abs(f.step.gap) > limit * gap)) continue;
            ++marks[f.line][f.place + n];
            --marks[f.line][f.place + 2 * n];
        }
        for (std::size_t i = 0; i < lines_.size(); ++i) {
            int inside = 0, before = 0, last = 0;
            for (int k = 0; k < size_; ++k) {
                inside += marks[i][k];
                const int here = edges_[i][k + 1] - last;  // marked before
                last = edges_[i][k + 1];
                before += here > 0 || inside > 0;
                edges_[i][k + 1] = before;
            }
        }
    }

    int size_;
    bool silent_;
    std::vector<LineSums> lines_;
    std::vector<Array<int>> edges_;  // of every line, how many samples before the k-th one lie on an edge
};

// How the deviation of |D| for n = 16 grows with depth, in units of `single` on the whole.
Deviation waves_of(const std::vector<DirectionSteps>& found, bool projective, const Deviation& single) {
    if (!projective) return single;
    std::vector<Step> steps;
    for (const DirectionSteps& f : found) {
        const std::vector<Step>& own = f.single[wave_level];
        steps.insert(steps.end(), own.begin(), own.end());
    }
    if (steps.size() < depth_bins * least_windows) return single;
    std::sort(steps.begin(), steps.end(), [](const Step& a, const Step& b) { return a.ordinate < b.ordinate; });
    std::vector<double> depths, deviations;
    std::vector<float> sizes;
    for (std::size_t bin = 0; bin < depth_bins; ++bin) {
        const std::size_t begin = bin * steps.size() / depth_bins, end = (bin + 1) * steps.size() / depth_bins;
        sizes.clear();
        for (std::size_t i = begin; i < end; ++i) sizes.push_back(static_cast<float>(std::abs(steps[i].slope)));
        const double z = 1 / steps[(begin + end) / 2].ordinate, deviation = normal_deviation(sizes) * z * z;
        if (!(deviation > 0) || !std::isfinite(deviation)) continue;
        depths.push_back(z);
        deviations.push_back(deviation);
    }
    const Deviation shape = fitted_deviation(depths, deviations, {0, 2, 3});
    sizes.clear();
    for (const Step& s : steps) {
        const double ratio = single.of_length(1 / s.ordinate) / shape.of_length(1 / s.ordinate);
        if (std::isfinite(ratio)) sizes.push_back(static_cast<float>(ratio));
    }
    if (sizes.empty()) return single;
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return shape.times(static_cast<double>(*middle));
}

// Factors at all levels from those that are measured, the rest by how the last ones grow.
void write_factors(const double* measured, double* factors) {
    double last = 1, before = 1;
    for (int level = 0; level < FitFactors::levels; ++level) {
        double factor = level < measured_levels ? measured[level] : std::nan("");
        if (!(factor == factor)) factor = last * std::max(1.0, std::min(most_growth, last / before));
        before = last, last = level == 0 ? factor : std::min(factor, smooth_growth * last);
        factors[level] = std::max(last, level == 0 ? 1.0 : least_factor);
    }
}

void write_fit_noise(const DirectionSteps& found, Measure& measure, bool silent, double* numbers) {
    double measured[4][measured_levels];
    for (int level = 0; level < measured_levels; ++level) {
        const int n = 4 << level;
        measured[0][level] = measure.factor(found.single[level], &Step::slope, n);
        measured[1][level] = measure.factor(found.single[level], &Step::gap, n);
        measured[2][level] = measure.factor(found.shared[level], &Step::slope, n);
        measured[3][level] = measure.factor(found.shared[level], &Step::gap, n);
    }
    for (int kind = 0; kind < 4; ++kind)
        write_factors(measured[kind], numbers + kind * FitFactors::levels);
    for (int level = 0; level < FitFactors::levels; ++level) {
        double *slope = numbers + level, *value = slope + FitFactors::levels;
        double *shared_slope = value + FitFactors::levels, *shared_value = shared_slope + FitFactors::levels;
        if (!silent) *slope = std::min(*slope, most_slope[level]);
        *value = std::min(std::max(*value, value_per_slope * *slope), *slope);
        *shared_slope = std::max(std::min(*shared_slope, most_shared * *slope), *slope);
        *shared_value = std::max({std::min(*shared_value, most_shared * *value), *value, value_per_slope * *shared_slope});
    }
    const double residual = residual_factor * median_magnitude * measure.factor(found.residuals, &Step::gap, longest);
    numbers[4 * FitFactors::levels] = residual >= 1 ? std::min(residual, most_residual * numbers[0]) : 1;
}

}  // namespace

template <class T>
FitNoiseEstimate fit_noise(const T* ordinate, int rows, int cols, bool projective, const Deviation& single,
                           bool silent, int threads) {
    std::vector<DirectionSteps> found;
    found.emplace_back(ordinate, rows, cols, cols, 1, silent);
    found.emplace_back(ordinate, cols, rows, 1, cols, silent);
    Team team(std::min(threads, 2));
    parallel_for(2, team, [&](int begin, int end, int) {
        Measure measure(single, single, projective);
        for (int i = begin; i < end; ++i) found[static_cast<std::size_t>(i)].look(measure);
    });
    FitNoiseEstimate estimate{};
    estimate.waves = waves_of(found, projective, single);
    parallel_for(2, team, [&](int begin, int end, int) {
        Measure measure(single, estimate.waves, projective);
        for (int i = begin; i < end; ++i) write_fit_noise(found[static_cast<std::size_t>(i)], measure, silent, i == 0 ? estimate.rows : estimate.cols);
    });
    return estimate;
}

template FitNoiseEstimate fit_noise(const float*, int, int, bool, const Deviation&, bool, int);
template FitNoiseEstimate fit_noise(const double*, int, int, bool, const Deviation&, bool, int);

}  // namespace rangeedge
