// How noisy the values of a range image are. A measured length z has the standard deviation
//
//     sigma(z) = a + b z + c z^2,
//
// or one that is given for every pixel, as far as neighbours tell it. Kernels work on ordinates: heights, or inverse
// depths q = 1 / z, which are off by sigma(z) / z^2 where z is off by sigma(z).
//
// On most cameras neighbours err together, over 5 to 30 pixels, since their values come from common windows, filters
// or interpolation. Such waves cancel out within few samples, so that sigma does not know them, and decide what fits to
// many samples are worth. So the noise of a fit is a function of its number n of samples. Its slope and its values at
// either end have the deviations that white noise of the deviation
//
//     sigma_n = sigma + w(n) (waves - sigma),   w from 0 for n <= 2 to 1 for n >= 16,
//
// would give them, times a factor that depends on n alone: 1 where noise is white, some 10 to 20 for the slope of 16
// samples of an active stereo camera. waves(z) = a' + b' z + c' z^2 + d' z^3 is how waves grow with the depth, scaled
// to be as large as sigma on the whole. The noise of neighbouring scan lines is correlated as well, so that their mean
// is worth less than their number promises: factors of the second kind say what it is worth, in units of one line.
//
// The paper has no model of the noise: its threshold epsilon is chosen for each scanner (paper, 6).
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace rangeedge {

// Directions of scan lines.
enum Direction : std::uint8_t { rows_bit = 1, cols_bit = 2, diag45_bit = 4, diag135_bit = 8 };
constexpr Direction all_directions[] = {rows_bit, cols_bit, diag45_bit, diag135_bit};

// The deviation of a length z, c0 + c1 z + c2 z^2 + c3 z^3.
struct Deviation {
    double c0 = 0, c1 = 0, c2 = 0, c3 = 0;

    double of_length(double z) const { return c0 + (c1 + (c2 + c3 * z) * z) * z; }
    // Of an ordinate by its magnitude y: times q^2 where that is an inverse depth.
    double of_ordinate(double y, bool projective) const {
        return projective ? ((c0 * y + c1) * y + c2) + (c3 > 0 ? c3 / y : 0) : of_length(y);
    }
    Deviation times(double factor) const { return {factor * c0, factor * c1, factor * c2, factor * c3}; }
};

// Factors by the number n of samples of a fit: given at n = 4, 8, ... 64, 1 for n <= 2, linear in log n between these.
class FitFactors {
public:
    static constexpr int levels = 5, largest = 64;

    FitFactors() { std::fill_n(factors_, largest + 1, 1.0); }
    explicit FitFactors(const double* at_levels);
    // The larger of two, at every number.
    FitFactors(const FitFactors& a, const FitFactors& b);

    double operator[](int n) const { return factors_[std::max(0, std::min(n, largest))]; }
    const double* data() const { return factors_; }

private:
    double factors_[largest + 1];
};

// The noise of fits along one direction of scan lines, in units of that of white noise.
struct FitNoise {
    FitFactors slope, value;                // of one line
    FitFactors shared_slope, shared_value;  // of neighbouring lines together
    FitFactors join;                        // of slope and value, the larger one
    double residual = 1;                    // deviation of samples from fits longer than the waves, in waves(z)

    FitNoise() = default;
    // From FitFactors::levels numbers for each of the four factors, and the deviation of residuals.
    explicit FitNoise(const double* numbers);
    static constexpr int size = 4 * FitFactors::levels + 1;
};

struct Noise {
    Deviation single;  // sigma
    Deviation waves;   // of fits to many samples
    FitNoise rows, cols, diagonals;
    const float* map = nullptr;  // sigma at every pixel of the image, of lengths, or null

    const FitNoise& along(int direction) const {
        return direction == rows_bit ? rows : direction == cols_bit ? cols : diagonals;
    }

    double sigma(double ordinate, std::int64_t pixel, bool projective) const {
        return at_least_finest(map ? mapped(ordinate, pixel, projective)
                                   : single.of_ordinate(std::abs(ordinate), projective));
    }
    double waves_at(double ordinate, std::int64_t pixel, bool projective) const {
        return at_least_finest(map ? mapped(ordinate, pixel, projective)
                                   : waves.of_ordinate(std::abs(ordinate), projective));
    }
    // The share w(n) of the waves in the noise of a fit to n samples.
    static double wave_share(int n) {
        constexpr double shares[] = {0,      0,     0,      0.2,  0.4,    0.475, 0.55,   0.625, 0.7,
                                     0.7375, 0.775, 0.8125, 0.85, 0.8875, 0.925, 0.9625, 1};
        return shares[std::max(0, std::min(n, 16))];
    }
    static constexpr double finest = 1e-30;  // no deviation is smaller, lest it be divided by

private:
    double mapped(double ordinate, std::int64_t pixel, bool projective) const {
        return static_cast<double>(map[pixel]) * (projective ? ordinate * ordinate : 1);
    }
    static double at_least_finest(double sigma) { return sigma > finest ? sigma : finest; }
};

// The noise at one place.
struct SampleNoise {
    double sigma, waves;
    // sigma_n, with which a fit to n samples counts.
    double of_fit(int n) const { return sigma + Noise::wave_share(n) * (waves - sigma); }
};
inline SampleNoise mean_of(const SampleNoise& a, const SampleNoise& b) {
    return {(a.sigma + b.sigma) / 2, (a.waves + b.waves) / 2};
}

}  // namespace rangeedge
