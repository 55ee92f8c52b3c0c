// SPDX-License-Identifier: Apache-2.0
#include "chains/outline.hpp"

#include <array>
#include <cmath>
#include <cstddef>

#include "base/vector.hpp"
#include "base/watch.hpp"
#include "edges/neighbourhood.hpp"

namespace rangeedge {
namespace {

constexpr int other_edges = jump_bit | convex_bit | concave_bit;
constexpr int inward = 3;  // pixels from the outermost to the one that tells the slope

template <class T>
class Outliner {
public:
    Outliner(const Frame<T>& frame) : frame_(frame), axes_{} {
        axes_[2] = {frame.axis[0], frame.axis[1], frame.axis[2]};
        axes_[0] = across(axes_[2]), axes_[1] = cross(axes_[2], axes_[0]);
    }

    // Half way from the last pixel with data to the next one in a direction.
    Candidate candidate(int col, int row, int direction, bool before) const {
        const Step step = step_of(direction);
        const int sign = before ? 1 : -1, u = sign * step.dcol, v = sign * step.drow;  // outward
        const std::int32_t last = pixel(col, row), next = pixel(col + u, row + v);
        Candidate c{};
        c.x = static_cast<float>(col + u / 2.0), c.y = static_cast<float>(row + v / 2.0);
        c.kind = static_cast<std::uint8_t>(boundary_bit | (before ? occluding_bit : occluded_bit));
        c.direction = static_cast<std::uint8_t>(direction);
        c.before = before ? last : next, c.after = before ? next : last;
        const Vector end = on_plane(col, row);
        c.plane_position[0] = static_cast<float>(end.x), c.plane_position[1] = static_cast<float>(end.y);
        for (int k = 1; k <= inward; ++k)
            if (!frame_.valid_at(col - k * u, row - k * v)) return c;
        // The line through two pixels goes on half a pixel beyond the outer one.
        const Vector begin = on_plane(col - inward * u, row - inward * v);
        const Vector way{end.x - begin.x, end.y - begin.y, end.z - begin.z};
        const double length = std::hypot(way.x, way.y), share = 0.5 / inward;
        if (!(length > 0)) return c;
        c.plane_position[0] = static_cast<float>(end.x + share * way.x);
        c.plane_position[1] = static_cast<float>(end.y + share * way.y);
        c.plane_direction[0] = static_cast<float>(sign * way.x / length);
        c.plane_direction[1] = static_cast<float>(sign * way.y / length);
        const auto value = static_cast<float>(end.z + share * way.z);
        c.sides[0].value = c.sides[1].value = value;
        Side& own = c.sides[before ? 0 : 1];
        own.slope = static_cast<float>(sign * way.z / length), own.slope_variance = 1;
        return c;
    }

private:
    std::int32_t pixel(int col, int row) const {
        return static_cast<std::int32_t>(std::int64_t{row} * frame_.cols + col);
    }

    // Its place in the plane of the image, and its ordinate.
    Vector on_plane(int col, int row) const {
        const std::int64_t p = pixel(col, row);
        if (frame_.ordinate) {
            const double *m = frame_.to_plane, u = col, v = row;
            return {m[0] * u + m[1] * v + m[2], m[3] * u + m[4] * v + m[5], static_cast<double>(frame_.ordinate[p])};
        }
        const Vector point = frame_.point(p);
        const double depth = dot(point, axes_[2]), scale = frame_.projective ? 1 / depth : 1;
        return {dot(point, axes_[0]) * scale, dot(point, axes_[1]) * scale, frame_.projective ? scale : -depth};
    }

    const Frame<T>& frame_;
    std::array<Vector, 3> axes_;  // of the plane of the image, and of view
};

}  // namespace

template <class T>
CandidateList outline_candidates(const Frame<T>& frame, const std::uint8_t* kinds) {
    const Outliner<T> outliner(frame);
    CandidateList found;
    for (int row = 0; row < frame.rows; ++row) {
        Watch::checkpoint();
        for (int col = 0; col < frame.cols; ++col) {
            const std::uint8_t kind = kinds[std::ptrdiff_t{row} * frame.cols + col];
            if (!(kind & boundary_bit) || (kind & other_edges)) continue;
            for (const int direction : all_directions)
                for (const bool before : {false, true}) {
                    const Step step = step_of(direction);
                    const int u = col + (before ? step.dcol : -step.dcol), v = row + (before ? step.drow : -step.drow);
                    if (u < 0 || v < 0 || u >= frame.cols || v >= frame.rows || frame.valid_at(u, v)) continue;
                    found.push_back(outliner.candidate(col, row, direction, before));
                }
        }
    }
    return found;
}

template CandidateList outline_candidates(const Frame<float>&, const std::uint8_t*);
template CandidateList outline_candidates(const Frame<double>&, const std::uint8_t*);

}  // namespace rangeedge
