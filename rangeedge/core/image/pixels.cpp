// SPDX-License-Identifier: Apache-2.0
#include "image/pixels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "base/simd.hpp"

namespace rangeedge {
namespace {

template <class T, class Real>
RANGEEDGE_INLINE void invert_all(const T* depth, std::size_t size, Real factor, Real* inverse) {
    constexpr Real largest = std::numeric_limits<Real>::max(), nan = std::numeric_limits<Real>::quiet_NaN();
    for (std::size_t i = 0; i < size; ++i) {
        const Real length = std::is_integral_v<T> ? static_cast<Real>(depth[i]) / factor : static_cast<Real>(depth[i]);
        const Real q = 1 / length;
        inverse[i] = ((q > 0) & (q <= largest)) ? q : nan;
    }
}

// By width of vector; templates cannot be.
RANGEEDGE_WIDE void invert(const float* depth, std::size_t size, float factor, float* inverse) {
    invert_all(depth, size, factor, inverse);
}
RANGEEDGE_WIDE void invert(const double* depth, std::size_t size, double factor, double* inverse) {
    invert_all(depth, size, factor, inverse);
}
RANGEEDGE_WIDE void invert(const std::uint16_t* depth, std::size_t size, float factor, float* inverse) {
    invert_all(depth, size, factor, inverse);
}

RANGEEDGE_WIDE void flag_invalid(const float* y, int n, std::uint8_t* flags) {
    for (int i = 0; i < n; ++i) flags[i] = !(std::abs(y[i]) <= std::numeric_limits<float>::max());
}
void flag_invalid(const double* y, int n, std::uint8_t* flags) {
    for (int i = 0; i < n; ++i) flags[i] = !(std::abs(y[i]) <= std::numeric_limits<double>::max());
}

// In every pixel's place whether it, or one beside it in its row, is flagged. `flags` may be read one before and after.
RANGEEDGE_WIDE void widen(const std::uint8_t* flags, int n, std::uint8_t* wide) {
    for (int i = 0; i < n; ++i) wide[i] = static_cast<std::uint8_t>(flags[i - 1] | flags[i] | flags[i + 1]);
}

RANGEEDGE_WIDE void add_bits(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below,
                             const std::uint8_t* invalid, int n, std::uint8_t bit, std::uint8_t* kind) {
    for (int i = 0; i < n; ++i) {
        const int beside = (above[i] | here[i] | below[i]) & (invalid[i] ^ 1);
        kind[i] = static_cast<std::uint8_t>(kind[i] | bit * beside);
    }
}

}  // namespace

template <class T, class Real>
void invert_depth(const T* depth, std::size_t size, Real factor, const std::uint8_t* mask, Real* inverse) {
    invert(depth, size, factor, inverse);
    if (!mask) return;
    for (std::size_t i = 0; i < size; ++i)
        if (!mask[i]) inverse[i] = std::numeric_limits<Real>::quiet_NaN();
}

template <class T>
void mark_boundary(const Frame<T>& frame, std::uint8_t bit, std::uint8_t* kind, Team& team) {
    // Of every pixel in three rows, the last one read and the two before it: whether it is invalid, and whether it or
    // one beside it in its row is. A column on either side stands for what lies beyond the image and counts as valid.
    const int cols = frame.cols;
    const auto width = static_cast<std::size_t>(cols) + 2;
    parallel_for(frame.rows, team, [&](int begin, int end, int) {
        std::vector<std::uint8_t> invalid(3 * width, 0), wide(3 * width, 0);
        const auto row_of = [&](std::vector<std::uint8_t>& flags, int row) {
            return flags.data() + static_cast<std::size_t>((row + 3) % 3) * width + 1;
        };
        for (int row = begin - 1; row <= end; ++row) {
            std::uint8_t *flags = row_of(invalid, row), *wider = row_of(wide, row);
            const std::int64_t first = static_cast<std::int64_t>(row) * cols;
            if (row < 0 || row == frame.rows)
                std::fill_n(flags, cols, std::uint8_t{0});
            else if (frame.ordinate)
                flag_invalid(frame.ordinate + first, cols, flags);
            else
                for (int col = 0; col < cols; ++col) flags[col] = !frame.valid_at(col, row);
            widen(flags, cols, wider);
            if (row > begin)
                add_bits(row_of(wide, row - 2), row_of(wide, row - 1), wider, row_of(invalid, row - 1), cols, bit,
                         kind + first - cols);
        }
    });
}

template void invert_depth(const float*, std::size_t, float, const std::uint8_t*, float*);
template void invert_depth(const double*, std::size_t, double, const std::uint8_t*, double*);
template void invert_depth(const std::uint16_t*, std::size_t, float, const std::uint8_t*, float*);
template void mark_boundary(const Frame<float>&, std::uint8_t, std::uint8_t*, Team&);
template void mark_boundary(const Frame<double>&, std::uint8_t, std::uint8_t*, Team&);

}  // namespace rangeedge
