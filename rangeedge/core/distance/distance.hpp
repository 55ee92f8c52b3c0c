// Distance and salience distance transforms. Images are dense rows of pixels. Every transform writes `distance`, and
// `labels` unless it is null: the index row * cols + col of the source that each distance is measured to, the lowest
// one where several are nearest. Without any source distances are +infinity and labels -1.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace rangeedge {

// How pixels lie: `width` and `height` of one as lengths; with `wrap` the last column is followed by the first.
struct Grid {
    int rows, cols;
    double width = 1.0, height = 1.0;
    bool wrap = false;

    std::size_t index(int row, int col) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(cols) + static_cast<std::size_t>(col);
    }
    // Squared lengths along columns in units of those along rows.
    double aspect() const { return (height / width) * (height / width); }
};

// Length to the nearest non-zero pixel.
void distance_transform(const std::uint8_t* edges, const Grid& grid, float* distance, std::int32_t* labels,
                        int threads);

// Length of the shortest way to the nearest non-zero pixel around those of `barrier`.
void geodesic_transform(const std::uint8_t* edges, const std::uint8_t* barrier, const Grid& grid, float* distance,
                        std::int32_t* labels, int threads);

// min over q of |p - q| / s(q). The salience s is value / 255 for 8 bits and the value itself, at most 1, for floats;
// sources are the pixels where it is at least 2^-30.
template <class T>
void salience_multiplicative(const T* salience, const Grid& grid, float* distance, std::int32_t* labels, int threads);

// sqrt(min over q of |p - q|^2 + lambda^2 (1 / s(q)^2 - 1)), the second term in multiples of 2^-20 pixels^2.
template <class T>
void salience_additive(const T* salience, const Grid& grid, double lambda, float* distance, std::int32_t* labels,
                       int threads);

// What one step of salience is: 1/255 in 8-bit maps.
template <class T>
constexpr double salience_unit = 1.0;
template <>
inline constexpr double salience_unit<std::uint8_t> = 255.0;

// What is less salient counts as zero, so that weights have a bounded range.
constexpr double least_salience = 0x1p-30;

}  // namespace rangeedge
