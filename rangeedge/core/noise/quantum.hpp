// The step to whose multiples the lengths of an image were rounded, where all of them are multiples of one.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace rangeedge {

// 0 where lengths take any value, or too few to tell rounding from the levels of a scene. Of ordinates, NaN without data.
template <class T>
double rounding_step(const T* ordinate, int rows, int cols, bool projective);

}  // namespace rangeedge
