// The step to whose multiples the depths of an image were rounded, where all of them are multiples of one.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace rangeedge {

// Of inverse depths, NaN without data. 0 where depths take any value, or too few to tell rounding from the levels of a
// scene. Heights on a grid do not tell: those of an exact slope are multiples of a step, too.
template <class T>
double rounding_step(const T* inverse_depth, int rows, int cols);

}  // namespace rangeedge
