// The lines of sight of a scan line that need not lie in a plane: rows of a scanner that turns lie on cones, those of a
// lens with distortion on other surfaces.
//
// The ray of the sample at w has the direction P(w), of which every component is a quadratic in w. A point on it is
// P(w) / y, and a plane n . X = d of the scene then has
//
//     y(w) = n . P(w) / d,
//
// a quadratic whatever the plane, as the paper wants it. P is chosen by the rays:
//
// - On a cone of half-angle beta around the axis m, with t the angle around it from the middle of the line and a, b
//   unit vectors across m at t = 0 and t = 90 degrees, the unit ray is cos(beta) m + sin(beta) (cos(t) a + sin(t) b).
//   With w = 2 tan(t / 2), so that cos(t) = (1 - w^2/4) / (1 + w^2/4) and sin(t) = w / (1 + w^2/4),
//
//       P(w) = (1 + w^2/4) cos(beta) m + sin(beta) ((1 - w^2/4) a + w b).
//
// - In a plane, with w = tan(t), P(w) = a + w b, and planes are straight lines.
// - Through a lens, w is measured along the line in the image plane z = 1, the offset from it is a quadratic in w, and
//   P(w) = w d + offset(w) n + (0, 0, 1).
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "base/vector.hpp"

namespace rangeedge {

// P(w) = c0 + c1 w + c2 w^2.
struct Rays {
    Vector c0{0, 0, 1}, c1{1, 0, 0}, c2{0, 0, 0};

    Vector at(double w) const { return combination(combination(c0, w, c1), w * w, c2); }
    Vector slope(double w) const { return combination(c1, 2 * w, c2); }
};

// A curve at w as it appears in the image plane z = 1: the ray is at P / Pz, and inverse depths along z are y / Pz.
struct PlaneImage {
    PlaneImage(const Rays& rays, double w) {
        const Vector p = rays.at(w), turn = rays.slope(w);
        by_value = 1 / p.z;
        position[0] = p.x * by_value, position[1] = p.y * by_value;
        const double dx = (turn.x - turn.z * position[0]) * by_value, dy = (turn.y - turn.z * position[1]) * by_value;
        const double per_place = 1 / std::hypot(dx, dy);
        direction[0] = dx * per_place, direction[1] = dy * per_place;
        by_slope = by_value * per_place;
        outward = turn.z * by_value;
    }
    // Of inverse depth by place in the image, where y has this value and slope m.
    double slope(double value, double m) const { return (m - outward * value) * by_slope; }

    double position[2], direction[2];
    double by_value, by_slope, outward;
};

// Finds P and the places of samples. Rays are added first, in the order of the line.
class RayFit {
public:
    // `axis` is the direction of view, `ranges` says whether rays are unit vectors or have z = 1 along it.
    RayFit(const Vector& axis, bool ranges) : axis_(axis), ranges_(ranges) {}

    // Of the first and last point, and of the sum of the rays; false where they fix no line.
    bool orient(const Vector& first, const Vector& last, const Vector& sum);
    void add(const Vector& point);
    Rays fit();

    double place(const Vector& point) const;
    // The ray to a point, of the length that sums and fits take.
    Vector ray(const Vector& point) const;

private:
    enum class Kind { lens, plane, cone };

    Vector axis_;
    bool ranges_;
    Kind kind_ = Kind::plane;
    Vector middle_{0, 0, 1}, along_{1, 0, 0}, across_{0, 1, 0};
    Vector centre_{0, 0, 1}, side_{1, 0, 0};  // a and b
    double n_ = 0, x_ = 0, z_ = 0, v_ = 0, xx_ = 0, xz_ = 0, zz_ = 0, xv_ = 0, zv_ = 0;
    double least_ = 0, most_ = 0;  // of x
};

}  // namespace rangeedge
