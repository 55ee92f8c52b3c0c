// Distance and salience distance transforms. Images are dense rows of width pixels; every transform writes `distance`,
// and `labels` unless it is null: the index row * width + col of the source that each distance is measured to, the
// lowest one where several are nearest. Without any source distances are +infinity and labels -1.
#pragma once

#include <cstdint>

namespace rangeedge {

// Euclidean distance to the nearest non-zero pixel.
void distance_transform(const std::uint8_t* edges, int height, int width, float* distance, std::int32_t* labels,
                        int threads);

// min over q of |p - q| / s(q). The salience s is value / 255 for 8 bits and the value itself, at most 1, for floats;
// sources are the pixels where it is at least 2^-30.
template <class T>
void salience_multiplicative(const T* salience, int height, int width, float* distance, std::int32_t* labels,
                             int threads);

// sqrt(min over q of |p - q|^2 + lambda^2 (1 / s(q)^2 - 1)), the second term in multiples of 2^-20.
template <class T>
void salience_additive(const T* salience, int height, int width, double lambda, float* distance, std::int32_t* labels,
                       int threads);

}  // namespace rangeedge
