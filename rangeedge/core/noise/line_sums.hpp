// Straight lines and quadratics fitted to any window of a scan line, in a few steps each.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "base/array.hpp"

namespace rangeedge {

// How many samples a window has, and what fits to as many need. m2 is the sum of squared distances from their middle.
struct WindowSize {
    explicit WindowSize(int samples)
        : n(samples), per_n(1.0 / n), per_m2(12.0 / (static_cast<double>(n) * (static_cast<double>(n) * n - 1))) {}

    int n;
    double per_n, per_m2;
};

// Sums over the first samples of a scan line, from which those over any window follow. Ordinates are counted from the
// first one with data, places from the middle of the line.
class LineSums {
public:
    template <class T>
    void read(const T* y, int size) {
        sums_.resize(size + 1);
        changes_.resize(size + 1);
        blocked_.assign(size, 0);
        middle_ = (size - 1) / 2.0;
        int begin = 0;
        while (begin < size && !std::isfinite(y[begin])) ++begin;
        base_ = begin < size ? static_cast<double>(y[begin]) : 0;
        Sums sum{};
        double last = 0;
        int changes = 0;
        for (int k = 0; k < size; ++k) {
            sums_[k] = sum, changes_[k] = changes;
            const auto value = static_cast<double>(y[k]);
            const bool valid = std::isfinite(value);
            const double h = valid ? value - base_ : 0, t = k - middle_;
            sum.h += h, sum.ht += h * t, sum.htt += h * t * t, sum.hh += h * h;
            blocked_[k] = !valid;
            changes += h != last;
            last = h;
        }
        sums_[size] = sum, changes_[size] = changes;
        count_blocked();
    }

    // From now on windows with one of the n samples from k do not count; count_blocked() makes it so.
    void block(int k, int n) { std::fill_n(blocked_.begin() + k, n, std::uint8_t{1}); }
    void count_blocked() {
        before_.resize(blocked_.size() + 1);
        int before = 0;
        for (std::ptrdiff_t k = 0; k < blocked_.size(); ++k) before_[k] = before, before += blocked_[k];
        before_[blocked_.size()] = before;
    }
    // Whether all n samples from k have data and none is blocked; whether all are equal.
    bool counts(int k, int n) const { return before_[k + n] == before_[k]; }
    bool constant(int k, int n) const { return changes_[k + n] == changes_[k + 1]; }

    // A straight line fitted to the samples from k.
    struct Fit {
        double mean, slope;
    };
    Fit fit(int k, const WindowSize& size) const {
        const Sums &a = sums_[k], &b = sums_[k + size.n];
        const double h = b.h - a.h, shift = k + (size.n - 1) / 2.0 - middle_;
        return {base_ + h * size.per_n, (b.ht - a.ht - shift * h) * size.per_m2};
    }
    // Sum of squared residuals of the quadratic fitted to them.
    double residual_squares(int k, const WindowSize& size) const {
        const Sums &a = sums_[k], &b = sums_[k + size.n];
        const double n = size.n, shift = k + (n - 1) / 2 - middle_, h = b.h - a.h, ht = b.ht - a.ht - shift * h;
        const double htt = b.htt - a.htt - 2 * shift * (b.ht - a.ht) + shift * shift * h;
        const double y2 = htt - (n * n - 1) / 12 * h, norm2 = (n * n - 4) / (15 * size.per_m2);
        return std::max(0.0, b.hh - a.hh - h * h * size.per_n - ht * ht * size.per_m2 - y2 * y2 / norm2);
    }

private:
    struct Sums {
        double h, ht, htt, hh;
    };
    Array<Sums> sums_;
    Array<std::uint8_t> blocked_;
    Array<int> before_, changes_;  // how many blocked samples, and changes of the value, there are before each sample
    double middle_ = 0, base_ = 0;
};

}  // namespace rangeedge
