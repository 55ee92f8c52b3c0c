// SPDX-License-Identifier: Apache-2.0
#include "edges/normals.hpp"

#include <algorithm>
#include <cmath>

#include "base/angle.hpp"

namespace rangeedge {
namespace {

constexpr float largest_precision = 1e30f;  // of a slope: the inverse of its variance
// Below which shares the determinant of the squares of directions belongs to parallel ones: of the trace squared, to
// which rounding adds, and of the product of the diagonal, the cosine squared being nearly 1.
constexpr double rounding_share = 1e-9, parallel_share = 0.02;

// Of a candidate, beside its place: the direction of its scan line and its position in the plane of the image, and the
// precision and value of the slope, and the ordinate, on either side.
enum TangentField {
    direction_x = first_field,
    direction_y,
    position_x,
    position_y,
    precision_before,
    precision_after,
    slope_before,
    slope_after,
    value_before,
    value_after,
    end_of_fields
};
static_assert(end_of_fields == tangent_fields);

// For the gradient of a surface's ordinate from slopes along several directions, by weighted least squares.
struct GradientSums {
    float xx, xy, yy, xm, ym, value;

    // The surface's normal; false where the directions do not fix it.
    bool normal(bool projective, const double position[2], double weight, double n[3]) const {
        const double x2 = xx, y2 = yy, determinant = x2 * y2 - double{xy} * xy;
        if (!(determinant > rounding_share * (x2 + y2) * (x2 + y2))) return false;
        if (!(determinant > parallel_share * x2 * y2)) return false;
        n[0] = (y2 * xm - double{xy} * ym) / determinant, n[1] = (x2 * ym - double{xy} * xm) / determinant;
        // q = gx X + gy Y + g0 is the plane gx x + gy y + g0 z = 1.
        n[2] = projective ? value / weight - n[0] * position[0] - n[1] * position[1] : 1;
        return true;
    }
};

// Sums over the tangents on either side of an edge.
struct TangentSums {
    GradientSums sides[2];
    float weight, position[2];
};

template <int bytes>
RANGEEDGE_INLINE TangentSums tangent_sums_in(const NeighbourGrid::Near& near, int forward_directions) {
    using F = Floats<bytes>;
    using I = Ints<bytes>;
    const auto load = [&near](int field, int k) RANGEEDGE_ALWAYS { return F::load(near.grid->field(field) + k); };
    const F zero = F::all(0);
    const I forward_bits = I::all(forward_directions << NeighbourGrid::direction_shift), none = I::all(0);
    const int* bits_of_all = near.grid->kinds_of_all();
    F weight = zero, u = zero, v = zero;
    F xx[2] = {zero, zero}, xy[2] = {zero, zero}, yy[2] = {zero, zero};
    F xm[2] = {zero, zero}, ym[2] = {zero, zero}, values[2] = {zero, zero};
    for_each_lanes<bytes>(near, [&](int k, const F& w, const F&, const F&) RANGEEDGE_ALWAYS {
        const F x = load(direction_x, k), y = load(direction_y, k);
        weight += w, u += w * load(position_x, k), v += w * load(position_y, k);
        // A neighbour whose line crosses the edge the other way has the sides exchanged.
        const I forward = sign_mask(none - (I::load(bits_of_all + k) & forward_bits));
        for (int i = 0; i < 2; ++i) {
            const auto on_side = [&](int field) RANGEEDGE_ALWAYS {
                return select(forward, load(field + i, k), load(field + 1 - i, k));
            };
            const F p = w * on_side(precision_before), m = on_side(slope_before), px = p * x, py = p * y;
            xx[i] += px * x, xy[i] += px * y, yy[i] += py * y;
            xm[i] += px * m, ym[i] += py * m;
            values[i] += w * on_side(value_before);
        }
    });
    TangentSums sums{};
    for (int i = 0; i < 2; ++i)
        sums.sides[i] = {xx[i].sum(), xy[i].sum(), yy[i].sum(), xm[i].sum(), ym[i].sum(), values[i].sum()};
    sums.weight = weight.sum();
    sums.position[0] = u.sum(), sums.position[1] = v.sum();
    return sums;
}
RANGEEDGE_VERSIONS(TangentSums, tangent_sums, (const NeighbourGrid::Near& near, int forward_directions),
                   (near, forward_directions))

}  // namespace

double normal_angle(const NeighbourGrid::Near& near, bool projective) {
    const CommonLine line = common_line(near);
    if (!line.found) return -1;
    int forward = 0;  // the directions whose lines cross the edge the way the normal of the line points
    for (const int direction : all_directions) {
        const Step step = step_of(direction);
        if (step.dcol * line.normal[0] + step.drow * line.normal[1] > 0) forward |= direction;
    }
    const TangentSums sums = tangent_sums(near, forward);
    const double position[2] = {sums.position[0] / sums.weight, sums.position[1] / sums.weight};
    double a[3], b[3];
    for (int i = 0; i < 2; ++i)
        if (!sums.sides[i].normal(projective, position, sums.weight, i ? b : a)) return -1;
    const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    const double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    return angle_between(std::sqrt(x * x + y * y + z * z), dot);
}

void fill_tangents(const CandidateList& candidates, NeighbourGrid& grid) {
    grid.for_each([&](std::size_t i, std::ptrdiff_t k) {
        const Candidate& c = candidates[i];
        // Zero times infinity would spoil sums in which a candidate has no weight.
        const auto finite = [](float v) { return std::isfinite(v) ? v : 0.0f; };
        for (int axis = 0; axis < 2; ++axis) {
            grid.field(direction_x + axis)[k] = finite(c.plane_direction[axis]);
            grid.field(position_x + axis)[k] = finite(c.plane_position[axis]);
        }
        for (int side = 0; side < 2; ++side) {
            const Side& s = c.sides[side];
            // A slope that its samples do not fix says nothing.
            const bool fixed = s.slope_variance < endless && std::isfinite(s.slope);
            grid.field(precision_before + side)[k] = fixed ? std::min(1 / s.slope_variance, largest_precision) : 0;
            grid.field(slope_before + side)[k] = finite(s.slope);
            grid.field(value_before + side)[k] = finite(s.value);
        }
    });
}

}  // namespace rangeedge
