// SPDX-License-Identifier: Apache-2.0
#include "noise/quantum.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace rangeedge {
namespace {

constexpr int looked_at = 32;              // rows, and columns, of which each pixel of both is looked at
constexpr std::size_t fewest_levels = 16;  // that values take
constexpr double coarsest = 0.01;          // of a distance: no step is larger
constexpr int most_parts = 3;
constexpr double off_lattice = 0.15;  // steps that a value may lie off a multiple

// The i-th of these along an image of `size`; the other way, where the j-th is taken, decides how far it is moved, so
// that all rows and columns have their turn. The same ones whichever end is the first.
int place(int i, int j, int size) {
    const int own = std::min(i, looked_at - 1 - i), other = std::min(j, looked_at - 1 - j);
    const auto k =
        static_cast<int>(static_cast<long long>(own) * size / looked_at) + other % std::max(1, size / looked_at);
    return own == i ? k : size - 1 - k;
}

// The step of which all depths are multiples, apart from an offset, given nearly; 0 if they are not.
double multiples_of(double step, const std::vector<double>& depths) {
    for (const double depth : depths) {  // the farther from the first, the better they tell the step
        const double from_first = depth - depths.front(), steps = std::round(from_first / step);
        if (std::abs(from_first - steps * step) > off_lattice * step) return 0;
        if (steps > 0) step = from_first / steps;
    }
    return step;
}

}  // namespace

template <class T>
double rounding_step(const T* inverse_depth, int rows, int cols) {
    std::vector<double> depths;
    for (int i = 0; i < looked_at; ++i)
        for (int j = 0; j < looked_at; ++j) {
            const int v = place(i, j, rows), u = place(j, i, cols);
            const double depth = 1 / static_cast<double>(inverse_depth[static_cast<std::ptrdiff_t>(v) * cols + u]);
            if (std::isfinite(depth)) depths.push_back(depth);
        }
    if (depths.size() < fewest_levels) return 0;
    std::sort(depths.begin(), depths.end());
    // Apart from the rounding of their type, and of the inverse.
    const double same = 4 * static_cast<double>(std::numeric_limits<T>::epsilon()) * depths.back();
    double step = HUGE_VAL;
    std::size_t levels = 1;
    for (std::size_t i = 1; i < depths.size(); ++i) {
        const double gap = depths[i] - depths[i - 1];
        if (!(gap > same)) continue;
        step = std::min(step, gap);
        ++levels;
    }
    if (levels < fewest_levels || !(step > 4 * same) || step > coarsest * depths[depths.size() / 2]) return 0;
    // Where no two values are next to each other, the step is a part of the least gap.
    for (int parts = 1; parts <= most_parts && step > parts * 4 * same; ++parts)
        if (const double found = multiples_of(step / parts, depths); found > 0) return found;
    return 0;
}

template double rounding_step(const float*, int, int);
template double rounding_step(const double*, int, int);

}  // namespace rangeedge
