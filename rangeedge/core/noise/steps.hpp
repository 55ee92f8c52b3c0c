// The steps D and G between fits to adjacent windows (fits.hpp), all over an image, and their deviations.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <vector>

#include "image/noise.hpp"
#include "noise/line_sums.hpp"

namespace rangeedge {

constexpr int measured_levels = 4;     // n = 4, 8, 16, 32
constexpr int longest_residuals = 64;  // samples of a window whose residuals are looked at

// Steps in slope and in value, over what white noise of unit deviation would give them, and the ordinates there.
struct Steps {
    std::vector<double> slope, gap, ordinate;

    std::size_t size() const { return ordinate.size(); }
    void reserve(std::size_t count) {
        for (auto* numbers : {&slope, &gap, &ordinate}) numbers->reserve(count);
    }
    void add(double own_slope, double own_gap, double own_ordinate) {
        slope.push_back(own_slope), gap.push_back(own_gap), ordinate.push_back(own_ordinate);
    }
};

// Deviations of steps over the noise at their ordinates.
class Measure {
public:
    Measure(const Deviation& single, const Deviation& waves, bool projective)
        : single_(single), waves_(waves), projective_(projective) {}

    double sigma(double ordinate, int n) const {
        const double y = std::abs(ordinate);
        return SampleNoise{single_.of_ordinate(y, projective_), waves_.of_ordinate(y, projective_)}.of_fit(n);
    }
    // Of slopes and gaps of fits to n samples; NaN where too few tell it.
    struct Factors {
        double slope, gap;
    };
    Factors factors(const Steps& steps, int n);

private:
    Deviation single_, waves_;
    bool projective_;
    std::vector<float> slopes_, gaps_;
};

// What windows show along one direction: of one line, and of neighbouring lines together.
class DirectionSteps {
public:
    // Of `lines` scan lines of `size` samples; `line_step` and `sample_step` lead from one to the next. Where the image
    // is `silent`, constant windows count.
    template <class T>
    DirectionSteps(const T* ordinate, int lines, int size, std::ptrdiff_t line_step, std::ptrdiff_t sample_step,
                   bool silent);

    // The steps of all lengths, the shorter ones first: where one of these is an edge, longer windows do not count.
    void look(Measure& measure);

    Steps single[measured_levels], shared[measured_levels];
    Steps residuals;  // deviations of samples from long fits, as gaps

private:
    bool tells(const LineSums& line, int k, int n) const {
        return line.counts(k, n) && (silent_ || !line.constant(k, n));
    }
    void look_at_steps(const WindowSize& window, Measure& measure, Steps& own, Steps& together);
    void look_at_residuals(const WindowSize& window);

    int size_;
    bool silent_;
    std::vector<LineSums> lines_;  // group after group of neighbours
};

}  // namespace rangeedge
