// SPDX-License-Identifier: Apache-2.0
#include "noise/least_squares.hpp"

#include <cmath>
#include <utility>

namespace rangeedge {
namespace {

constexpr int most_powers = 4;

// Solves the normal equations of the columns that a set holds, by elimination with pivots; false where they are
// singular.
bool solve(const double (&matrix)[most_powers][most_powers], const double (&right)[most_powers],
           const std::vector<int>& set, double* solution) {
    const int n = static_cast<int>(set.size());
    double a[most_powers][most_powers + 1];
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j)
            a[i][j] = matrix[set[static_cast<std::size_t>(i)]][set[static_cast<std::size_t>(j)]];
        a[i][n] = right[set[static_cast<std::size_t>(i)]];
    }
    for (int i = 0; i < n; ++i) {
        int pivot = i;
        for (int k = i + 1; k < n; ++k)
            if (std::abs(a[k][i]) > std::abs(a[pivot][i])) pivot = k;
        if (!(std::abs(a[pivot][i]) > 1e-12)) return false;
        std::swap(a[i], a[pivot]);
        for (int k = i + 1; k < n; ++k)
            for (int j = n; j >= i; --j) a[k][j] -= a[k][i] / a[i][i] * a[i][j];
    }
    for (int i = n - 1; i >= 0; --i) {
        solution[i] = a[i][n];
        for (int j = i + 1; j < n; ++j) solution[i] -= a[i][j] * solution[j];
        solution[i] /= a[i][i];
    }
    return true;
}

}  // namespace

Deviation fitted_deviation(const std::vector<double>& depths, const std::vector<double>& deviations,
                           const std::vector<int>& powers) {
    // Columns z^p / deviation, to give 1, in units in which each has a mean square of 1.
    const int count = static_cast<int>(powers.size());
    double matrix[most_powers][most_powers] = {}, right[most_powers] = {}, scale[most_powers] = {};
    const auto entry = [&](std::size_t k, int i) {
        return std::pow(depths[k], powers[static_cast<std::size_t>(i)]) / deviations[k];
    };
    for (int i = 0; i < count; ++i) {
        for (std::size_t k = 0; k < depths.size(); ++k) scale[i] += entry(k, i) * entry(k, i);
        scale[i] = std::sqrt(scale[i]);
    }
    for (std::size_t k = 0; k < depths.size(); ++k)
        for (int i = 0; i < count; ++i) {
            right[i] += entry(k, i) / scale[i];
            for (int j = 0; j < count; ++j) matrix[i][j] += entry(k, i) / scale[i] * entry(k, j) / scale[j];
        }
    // The best of all sets of powers whose coefficients come out positive.
    Deviation best{};
    double least = HUGE_VAL;
    for (int mask = 1; mask < 1 << count; ++mask) {
        std::vector<int> set;
        for (int i = 0; i < count; ++i)
            if (mask >> i & 1) set.push_back(i);
        double solution[most_powers];
        if (!solve(matrix, right, set, solution)) continue;
        double squares = static_cast<double>(depths.size());
        bool positive = true;
        double c[most_powers] = {};
        for (std::size_t i = 0; i < set.size(); ++i) {
            positive &= solution[i] >= 0;
            squares -= solution[i] * right[set[i]];
            c[powers[static_cast<std::size_t>(set[i])]] = solution[i] / scale[set[i]];
        }
        if (!positive || !(squares < least)) continue;
        least = squares;
        best = {c[0], c[1], c[2], c[3]};
    }
    return best;
}

}  // namespace rangeedge
