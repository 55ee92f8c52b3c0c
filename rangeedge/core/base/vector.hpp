// Vectors in space.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>

namespace rangeedge {

struct Vector {
    double x, y, z;
};
inline double dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vector cross(const Vector& a, const Vector& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Vector combination(const Vector& a, double k, const Vector& b) {
    return {a.x + k * b.x, a.y + k * b.y, a.z + k * b.z};
}
inline double length(const Vector& a) { return std::sqrt(dot(a, a)); }
inline bool is_finite(const Vector& a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }
inline bool normalise(Vector& a) {
    const double size = length(a);
    if (!(size > 0) || !std::isfinite(size)) return false;
    a = {a.x / size, a.y / size, a.z / size};
    return true;
}
// A direction across an axis: that of x, where that is none along it.
inline Vector across(const Vector& axis) {
    Vector right{1, 0, 0};
    right = combination(right, -dot(axis, right), axis);
    return normalise(right) ? right : Vector{0, 1, 0};
}

}  // namespace rangeedge
