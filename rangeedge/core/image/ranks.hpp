// Values by their rank: medians and percentiles of whole images.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

namespace rangeedge {

// How many of the values are no NaN.
template <class T>
std::int64_t count_numbers(const T* values, std::int64_t size);

// Those of them that have these ranks, which ascend from 0 on.
template <class T>
std::vector<T> values_of_ranks(const T* values, std::int64_t size, const std::vector<std::int64_t>& ranks);

}  // namespace rangeedge
