// A range image as every kernel takes it. Whatever a scanner delivers, its pixels become samples of plane curves, since
// the pixels of a row, a column or a diagonal lie in a plane with the viewpoint, or with the direction of view: the one
// condition of the method (paper, 4.1, last paragraph).
//
// The ordinate of a pixel grows toward the viewer, as z does in the paper: it is a height where lines of sight are
// parallel, and the inverse depth where they meet in one point, of which planes are affine functions of the image
// coordinates. NaN marks a pixel without data.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstdint>

#include "base/vector.hpp"
#include "image/noise.hpp"

namespace rangeedge {

template <class T>
struct Frame {
    int rows, cols;
    const T* ordinate;   // (rows, cols), or null where `points` is given
    const T* points;     // (rows, cols, 3) in the camera frame, or null
    bool projective;     // rays from one point; else parallel to `axis`
    double to_plane[6];  // pixel (u, v, 1) to normalised image coordinates, or to lengths on the grid
    double axis[3];      // direction of view in the frame of `points`
    bool curved;         // whether the rays of a line of points need not lie in a plane
    bool ranges;         // whether their depth is measured along the rays, not along `axis`
    Noise noise;

    Vector point(std::int64_t pixel) const {
        const T* p = points + 3 * pixel;
        return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
    }
    bool valid_at(int col, int row) const {
        if (col < 0 || row < 0 || col >= cols || row >= rows) return false;
        const std::int64_t i = static_cast<std::int64_t>(row) * cols + col;
        return std::isfinite(ordinate ? ordinate[i] : points[3 * i] + points[3 * i + 1] + points[3 * i + 2]);
    }
};

}  // namespace rangeedge
