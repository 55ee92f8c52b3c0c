// The surfaces of labelled regions over the image plane: what holes are filled with, and what noise is noise of.
//
// Ordinates are heights or inverse depths, of which planes are affine functions of the image plane: a surface seen
// through a camera continues across a hole as a straight line does.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "regions/surface.hpp"

namespace rangeedge {

// Maps of rows * cols pixels.
struct OrdinateMap {
    int rows, cols;
    const float* x;         // place on the image plane, in about pixels; null: the column
    const float* y;         // null: the row
    const float* ordinate;  // NaN: no data

    int size() const { return rows * cols; }
    double x_of(int p) const { return x ? static_cast<double>(x[p]) : p % cols; }
    double y_of(int p) const { return y ? static_cast<double>(y[p]) : p / cols; }
    bool valid(int p) const { return std::isfinite(ordinate[p]); }
};

// For every label 0 .. count - 1 a plane, or a quadratic where that leaves much less of its pixels.
std::vector<Surface> fit_surfaces(const OrdinateMap& map, const std::int32_t* labels, int count);

}  // namespace rangeedge
