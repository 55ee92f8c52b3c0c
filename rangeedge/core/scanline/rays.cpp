// SPDX-License-Identifier: Apache-2.0
#include "scanline/rays.hpp"

#include <algorithm>

namespace rangeedge {
namespace {

constexpr double flat = 2e-4;         // sagitta of an arc of rays, below which they lie in a plane
constexpr double widest_plane = 1.3;  // radians from its middle, over which a line is taken in the plane of an image

}  // namespace

Vector RayFit::ray(const Vector& point) const {
    const double size = ranges_ ? length(point) : dot(point, axis_);
    return {point.x / size, point.y / size, point.z / size};
}

bool RayFit::orient(const Vector& first, const Vector& last, const Vector& sum) {
    middle_ = ranges_ ? sum : axis_;
    if (!normalise(middle_)) return false;
    along_ = combination(ray(last), -1, ray(first));
    along_ = combination(along_, -dot(along_, middle_), middle_);
    if (!normalise(along_)) return false;
    across_ = cross(middle_, along_);
    return true;
}

// The offset v across the line is linear in x, the place along it, and in z: the share of the middle on a cone, of
// which a plane cuts the circle on the unit sphere, and x^2 through a lens.
void RayFit::add(const Vector& point) {
    const Vector e = ray(point);
    const double x = dot(e, along_), z = ranges_ ? dot(e, middle_) : x * x, v = dot(e, across_);
    if (n_ == 0) least_ = most_ = x;
    least_ = std::min(least_, x), most_ = std::max(most_, x);
    ++n_, x_ += x, z_ += z, v_ += v;
    xx_ += x * x, xz_ += x * z, zz_ += z * z, xv_ += x * v, zv_ += z * v;
}

Rays RayFit::fit() {
    const double x = x_ / n_, z = z_ / n_, v = v_ / n_;
    const double xx = xx_ / n_ - x * x, xz = xz_ / n_ - x * z, zz = zz_ / n_ - z * z;
    const double xv = xv_ / n_ - x * v, zv = zv_ / n_ - z * v;
    const double determinant = xx * zz - xz * xz, extent = most_ - least_;
    double by_x = xx > 0 ? xv / xx : 0, by_z = 0;
    if (determinant > 1e-12 * xx * xx) {
        const double found = (xx * zv - xz * xv) / determinant;
        // z changes by about a quarter of the squared extent, halved where it is a cosine.
        if (std::abs(found) * extent * extent / (ranges_ ? 8 : 4) > flat) {
            by_z = found;
            by_x = (zz * xv - xz * zv) / determinant;
        }
    }
    const double constant = v - by_x * x - by_z * z;
    if (!ranges_) {
        kind_ = Kind::lens;
        return {combination(middle_, constant, across_),
                combination(along_, by_x, across_),
                {by_z * across_.x, by_z * across_.y, by_z * across_.z}};
    }
    // The plane across . e - by_x along . e - by_z middle . e = constant; m is its normal.
    Vector m = combination(combination(across_, -by_x, along_), -by_z, middle_);
    const double h = by_z == 0 ? 0 : constant / length(m);  // cos(beta)
    normalise(m);
    centre_ = combination(middle_, -dot(middle_, m), m);
    if (!normalise(centre_)) centre_ = cross(along_, m);
    side_ = cross(m, centre_);
    if (dot(side_, along_) < 0) side_ = {-side_.x, -side_.y, -side_.z};
    const double reach = std::max(std::abs(least_), std::abs(most_));
    kind_ = h == 0 && reach < std::sin(widest_plane) ? Kind::plane : Kind::cone;
    if (kind_ == Kind::plane) return {centre_, side_, {0, 0, 0}};
    const double sine = std::sqrt(std::max(0.0, 1 - h * h));
    const Vector axial{h * m.x, h * m.y, h * m.z};
    Rays rays{combination(axial, sine, centre_), {sine * side_.x, sine * side_.y, sine * side_.z}, axial};
    rays.c2 = combination(axial, -sine, centre_);
    rays.c2 = {rays.c2.x / 4, rays.c2.y / 4, rays.c2.z / 4};
    return rays;
}

double RayFit::place(const Vector& point) const {
    if (kind_ == Kind::lens) return dot(ray(point), along_);
    const double x = dot(point, centre_), y = dot(point, side_);
    if (kind_ == Kind::plane) return y / x;
    return 2 * std::tan(std::atan2(y, x) / 2);
}

}  // namespace rangeedge
