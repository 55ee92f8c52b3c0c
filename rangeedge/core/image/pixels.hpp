// What is done to pixels one by one, before scan lines are read and after strengths are known: depths become inverse
// depths, and pixels beside those without data are marked. Neither is in the paper, whose images are dense.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>

#include "base/parallel.hpp"
#include "image/frame.hpp"

namespace rangeedge {

// The inverse of depths given as T, in units of 1 / `factor`; NaN where a depth, or its inverse, is not positive and
// finite, or where `mask` (null: nowhere) is 0.
template <class T, class Real>
void invert_depth(const T* depth, std::size_t size, Real factor, const std::uint8_t* mask, Real* inverse);

// Adds `bit` where a pixel is valid and one of its eight neighbours in the image is not.
template <class T>
void mark_boundary(const Frame<T>& frame, std::uint8_t bit, std::uint8_t* kind, Team& team);

}  // namespace rangeedge
