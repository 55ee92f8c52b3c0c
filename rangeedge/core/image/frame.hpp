// Range images as scan lines read them.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace rangeedge {

// How pixels become samples of a plane curve (s, r). The ordinate y grows toward the viewer: inverse depth where
// `projective`, else height or negative depth. NaN marks an invalid pixel.
template <class T>
struct RangeImage {
    int rows, cols;
    const T* ordinate;    // (rows, cols), or null where `points` is given
    const T* points;      // (rows, cols, 3) in the camera frame, or null
    bool projective;      // rays from one point; else parallel to `axis`
    double to_plane[6];   // pixel (u, v, 1) to normalised image coordinates, or to lengths on the grid
    double axis[3];       // viewing direction of `points`

    bool valid_at(int col, int row) const {
        if (col < 0 || row < 0 || col >= cols || row >= rows) return false;
        const std::int64_t i = static_cast<std::int64_t>(row) * cols + col;
        return std::isfinite(ordinate ? ordinate[i] : points[3 * i] + points[3 * i + 1] + points[3 * i + 2]);
    }
};

// The inverse of depths given as T, in units of 1 / `factor`; NaN where a depth, or its inverse, is not positive and
// finite, or where `mask` (null: nowhere) is 0.
template <class T, class Real>
void invert_depth(const T* depth, std::size_t size, Real factor, const std::uint8_t* mask, Real* inverse);

// Adds `bit` where a pixel is valid and one of its eight neighbours in the image is not.
template <class T>
void mark_boundary(const RangeImage<T>& image, std::uint8_t bit, std::uint8_t* kind);

}  // namespace rangeedge
