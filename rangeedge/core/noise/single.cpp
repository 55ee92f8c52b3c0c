// SPDX-License-Identifier: Apache-2.0
#include "noise/single.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "base/parallel.hpp"
#include "base/simd.hpp"
#include "noise/trimmed.hpp"

namespace rangeedge {
namespace {

constexpr int most_windows = 1 << 13;        // along rows, and along columns
constexpr std::size_t fewest_windows = 200;  // that tell the noise
constexpr int farthest = 4;                  // samples between those that are taken for neighbours
constexpr int constant_run = 8;              // equal samples in whose middle windows say nothing
constexpr int long_run = 32;                 // equal samples that no window may touch
constexpr std::size_t most_bins = 8;
constexpr std::size_t least_bin = 50;    // windows
constexpr double quantised_share = 0.3;  // of windows with equal neighbours: more have values with a step
constexpr double exact_share = 0.7;      // of constant windows: at least so many has an image of constant faces
constexpr double flicker_share = 0.1;    // of other windows with equal neighbours that change twice: more are noise
constexpr double fewest_levels = 8;      // that values take which are multiples of a step
const double per_difference = std::sqrt(20.0);  // deviation of a third difference of independent values

// Of windows of four samples: the magnitude of the third difference, the mean ordinate, and the least difference of
// neighbours other than zero, 0 where no two of them are equal. The mean is independent of the difference, so that bins
// of it do not select among the differences.
struct Windows {
    std::size_t count = 0;
    std::vector<float> differences, ordinates, steps;  // with `padding` more
    std::size_t constant = 0, changing_twice = 0;      // windows not counted; those with two changes and an equal pair
    bool counts_constant = false;

    void reserve(std::size_t windows) {
        for (auto* values : {&differences, &ordinates, &steps}) values->resize(count + windows + padding);
    }
    // All windows of one line, of samples `apart`.
    template <class T>
    void add_line(const T* y, int size, int apart) {
        const int number = size - 3 * apart;
        if (number <= 0) return;
        mark_constant(y, size, apart);
        reserve(static_cast<std::size_t>(number));
        for (int k = 0; k < number; ++k) {
            const bool is_constant = still_[static_cast<std::size_t>(k)] != 0;
            constant += is_constant;
            add(y + k, apart, counts_constant | !is_constant);
        }
    }

    void add(const Windows& others) {
        reserve(others.count);
        const auto append = [&](std::vector<float>& values, const std::vector<float>& more) {
            std::copy_n(more.begin(), others.count, values.begin() + static_cast<std::ptrdiff_t>(count));
        };
        append(differences, others.differences);
        append(ordinates, others.ordinates);
        append(steps, others.steps);
        count += others.count, constant += others.constant, changing_twice += others.changing_twice;
    }

private:
    // Marks the windows in the middle of constant runs, and those that have a sample of a long one.
    template <class T>
    void mark_constant(const T* y, int size, int apart) {
        still_.assign(static_cast<std::size_t>(size), 0);
        for (int phase = 0; phase < apart; ++phase)
            for (int k = phase; k < size;) {
                const int first = k;
                do k += apart;
                while (k < size && y[k] == y[first]);
                const int length = (k - first) / apart;
                if (length < constant_run) continue;
                const bool is_long = length >= long_run;
                const int begin = is_long ? first - 3 * apart : first + 2 * apart;
                const int end = is_long ? k : k - 5 * apart;
                for (int i = begin; i < end; i += apart)
                    if (i >= 0) still_[static_cast<std::size_t>(i)] = 1;
            }
    }
    template <class T>
    RANGEEDGE_INLINE void add(const T* y, int apart, bool counts) {
        constexpr float most = std::numeric_limits<float>::max();
        const double y0 = static_cast<double>(y[0]), y1 = static_cast<double>(y[apart]);
        const double y2 = static_cast<double>(y[2 * apart]), y3 = static_cast<double>(y[3 * apart]);
        const double a = std::abs(y1 - y0), b = std::abs(y2 - y1), c = std::abs(y3 - y2);
        const auto difference = static_cast<float>(std::abs(y3 - y0 - 3 * (y2 - y1)));
        const auto mean = static_cast<float>((y0 + y1 + y2 + y3) / 4);
        const auto least = [](double p, double q) { return p == 0 || (q < p && q > 0) ? q : p; };
        const int changes = (a != 0) + (b != 0) + (c != 0);
        differences[count] = difference;
        ordinates[count] = mean;
        steps[count] = static_cast<float>(changes < 3 ? least(least(a, b), c) : 0);
        counts &= (difference <= most) & (std::abs(mean) <= most);  // not so with NaN
        count += counts;
        changing_twice += counts & (changes == 2);
    }

    std::vector<std::uint8_t> still_;
};

// The lines of a direction that are looked at, the same ones from either side.
std::vector<int> sampled(int lines, int every) {
    std::vector<int> chosen;
    for (int i = 0; i < lines; ++i)
        if (std::min(i, lines - 1 - i) % every == 0) chosen.push_back(i);
    return chosen;
}

template <class T>
void add_rows(const T* ordinate, int rows, int cols, int every, int apart, Windows& windows) {
    for (const int v : sampled(rows, every)) {
        Watch::checkpoint();
        windows.add_line(ordinate + static_cast<std::ptrdiff_t>(v) * cols, cols, apart);
    }
}

template <class T>
void add_columns(const T* ordinate, int rows, int cols, int every, int apart, Windows& windows) {
    // Columns are copied, several at a time, since the image lies row by row.
    const std::vector<int> columns = sampled(cols, every);
    std::vector<T> copies(columns.size() * static_cast<std::size_t>(rows));
    for (std::size_t v = 0; v < static_cast<std::size_t>(rows); ++v) {
        Watch::checkpoint();
        const T* row = ordinate + v * static_cast<std::size_t>(cols);
        for (std::size_t i = 0; i < columns.size(); ++i)
            copies[i * static_cast<std::size_t>(rows) + v] = row[columns[i]];
    }
    for (std::size_t i = 0; i < columns.size(); ++i) {
        Watch::checkpoint();
        windows.add_line(copies.data() + i * static_cast<std::size_t>(rows), rows, apart);
    }
}

// Those along rows, and then those along columns.
template <class T>
Windows windows_of(const T* ordinate, int rows, int cols, int apart, bool counts_constant, Team& team) {
    const int every = 1 + static_cast<int>(static_cast<std::int64_t>(rows) * cols / most_windows);
    Windows windows, along_columns;
    windows.counts_constant = along_columns.counts_constant = counts_constant;
    parallel_each(2, team, [&](int i, int) {
        if (i == 0)
            add_rows(ordinate, rows, cols, every, apart, windows);
        else
            add_columns(ordinate, rows, cols, every, apart, along_columns);
    });
    windows.add(along_columns);
    return windows;
}

// The step that quantised values show; 0 of others.
double quantisation(const float* steps, std::size_t count) {
    const auto equal = count - static_cast<std::size_t>(std::count(steps, steps + count, 0.0f));
    if (equal == 0 || static_cast<double>(equal) < quantised_share * static_cast<double>(count)) return 0;
    return static_cast<double>(ranked(steps, count, count - equal + equal / 2));
}

// Whether nearly all is constant, and what is not are clean steps between few levels.
bool is_exact(const Windows& w, double extent) {
    const double all = static_cast<double>(w.constant + w.count), step = quantisation(w.steps.data(), w.count);
    return step > extent / fewest_levels && static_cast<double>(w.constant) >= exact_share * all &&
           static_cast<double>(w.changing_twice) <= flicker_share * static_cast<double>(w.count);
}

// The deviation that third differences show, not below that of rounding.
double deviation_of(const float* differences, const float* steps, std::size_t count) {
    return std::max(trimmed_deviation(differences, count) / per_difference,
                    quantisation(steps, count) / std::sqrt(12.0));
}

// Windows in the order of ranges of their ordinates, which are positive.
struct Bins {
    std::vector<float> differences, steps;  // with `padding` more
    std::vector<std::size_t> starts;        // of each bin, and the end of the last one
    std::vector<double> ordinates;          // the mean of each
};

// As many windows in each, but for equal ordinates.
Bins bins_of(const Windows& windows) {
    const std::size_t count = windows.count, number = std::max<std::size_t>(1, std::min(most_bins, count / least_bin));
    std::vector<std::size_t> ranks;
    for (std::size_t i = 1; i < number; ++i) ranks.push_back(i * count / number);
    const std::vector<float> borders = ranked(windows.ordinates.data(), count, ranks);
    std::vector<std::uint8_t> own(count, 0);
    for (const float border : borders)
        for (std::size_t k = 0; k < count; ++k)
            own[k] = static_cast<std::uint8_t>(own[k] + (windows.ordinates[k] > border));
    Bins bins{std::vector<float>(count + padding), std::vector<float>(count + padding),
              std::vector<std::size_t>(number + 1, 0), std::vector<double>(number, 0.0)};
    for (std::size_t k = 0; k < count; ++k) ++bins.starts[own[k] + std::size_t{1}];
    for (std::size_t i = 0; i < number; ++i) bins.starts[i + 1] += bins.starts[i];
    std::vector<std::size_t> next(bins.starts.begin(), bins.starts.end() - 1);
    for (std::size_t k = 0; k < count; ++k) {
        const std::size_t at = next[own[k]]++;
        bins.differences[at] = windows.differences[k];
        bins.steps[at] = windows.steps[k];
        bins.ordinates[own[k]] += static_cast<double>(windows.ordinates[k]);
    }
    for (std::size_t i = 0; i < number; ++i)
        bins.ordinates[i] /= static_cast<double>(std::max<std::size_t>(1, bins.starts[i + 1] - bins.starts[i]));
    return bins;
}

}  // namespace

template <class T>
SingleNoise single_noise(const T* ordinate, int rows, int cols, bool by_ordinate, Team& team) {
    SingleNoise result;
    Windows windows;
    int apart = 1;
    for (int next = 1; next <= farthest && windows.count < fewest_windows; ++next) {
        Windows found = windows_of(ordinate, rows, cols, next, false, team);
        if (found.count > windows.count || next == 1) windows = std::move(found), apart = next;
    }
    if (windows.count == 0) return result;
    const auto extremes = [&] {
        const auto begin = windows.ordinates.begin();
        const auto [low, high] = std::minmax_element(begin, begin + static_cast<std::ptrdiff_t>(windows.count));
        result.lowest = static_cast<double>(*low), result.highest = static_cast<double>(*high);
    };
    extremes();
    if (is_exact(windows, result.highest - result.lowest)) {
        windows = windows_of(ordinate, rows, cols, apart, true, team);
        extremes();
        windows.steps.assign(windows.steps.size(), 0.0f);
    }
    const Bins bins = by_ordinate ? bins_of(windows) : Bins{};
    const std::size_t number = bins.ordinates.size();
    std::vector<double> deviations(number);
    std::atomic<std::size_t> taken{0};
    team.run([&](int) {
        for (std::size_t i; (i = taken++) <= number;) {
            if (i == 0) {
                result.deviation = deviation_of(windows.differences.data(), windows.steps.data(), windows.count);
                result.quiet = std::max(quartile_deviation(windows.differences.data(), windows.count) / per_difference,
                                        quantisation(windows.steps.data(), windows.count) / std::sqrt(12.0));
                continue;
            }
            const std::size_t start = bins.starts[i - 1], count = bins.starts[i] - start;
            deviations[i - 1] = deviation_of(bins.differences.data() + start, bins.steps.data() + start, count);
        }
    });
    for (std::size_t i = 0; i < number; ++i) {
        if (bins.starts[i + 1] - bins.starts[i] < 2) continue;
        result.ordinates.push_back(bins.ordinates[i]);
        result.deviations.push_back(deviations[i]);
    }
    return result;
}

template SingleNoise single_noise(const float*, int, int, bool, Team&);
template SingleNoise single_noise(const double*, int, int, bool, Team&);

}  // namespace rangeedge
