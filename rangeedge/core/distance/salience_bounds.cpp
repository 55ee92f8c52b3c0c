// SPDX-License-Identifier: Apache-2.0
#include "distance/salience_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/simd.hpp"

namespace rangeedge {
namespace {

// Floats that are not negative are ordered as their bits, and minima of integers may be taken in any order, so that
// loops run on several lanes.
std::int32_t bits(float value) {
    std::int32_t result;
    std::memcpy(&result, &value, sizeof result);
    return result;
}

float value_of(std::int32_t bits) {
    float result;
    std::memcpy(&result, &bits, sizeof result);
    return result;
}

// The number of a candidate takes the place of the last bits of a float: so a minimum finds its argument as well.
class Tag {
public:
    explicit Tag(int count) {
        while (~mask_ + 1 < count) mask_ *= 2;
    }

    float set(float value, int number) const { return value_of((bits(value) & mask_) | number); }
    int number(float tagged) const { return bits(tagged) & ~mask_; }

private:
    std::int32_t mask_ = -1;
};

// The least of w (t - x)^2 - pivot_w (t - pivot_x)^2 over t in [0, length].
inline float least_excess(float w, float x, float pivot_w, float pivot_x, float length) {
    const auto excess = [=](float t) { return w * ((t - x) * (t - x)) - pivot_w * ((t - pivot_x) * (t - pivot_x)); };
    const float vertex = (w * x - pivot_w * pivot_x) / (w - pivot_w);
    const float inside = std::min(std::max(0.0f, vertex), length);  // 0 where w = pivot_w and there is no vertex
    return std::min(std::min(excess(0.0f), excess(length)), excess(inside));
}

}  // namespace

RANGEEDGE_WIDE float bound(const Candidates& from, const Tile& tile, float aspect, float* lower) {
    const float *weight = from.weight.data(), *x = from.x.data(), *y = from.y.data();
    const float *left = from.left.data(), *right = from.right.data();
    const float *top = from.top.data(), *bottom = from.bottom.data();
    std::int32_t least = std::numeric_limits<std::int32_t>::max();
    const int count = from.count();
    for (int k = 0; k < count; ++k) {
        const float near_x = std::max(std::max(left[k] - tile.right, tile.left - right[k]), 0.0f);
        const float near_y = std::max(std::max(top[k] - tile.bottom, tile.top - bottom[k]), 0.0f);
        const float far_x = std::max(x[k] - tile.left, tile.right - x[k]);
        const float far_y = std::max(y[k] - tile.top, tile.bottom - y[k]);
        lower[k] = weight[k] * (near_x * near_x + aspect * (near_y * near_y));
        least = std::min(least, bits(weight[k] * (far_x * far_x + aspect * (far_y * far_y))));
    }
    return value_of(least);
}

RANGEEDGE_WIDE int find_pivot(const Candidates& from, const Tile& tile, float aspect, float* upper) {
    const Tag tag(from.count());
    const float *weight = from.weight.data(), *x = from.x.data(), *y = from.y.data();
    std::int32_t least = std::numeric_limits<std::int32_t>::max();
    const int count = from.count();
    for (int k = 0; k < count; ++k) {
        const float far_x = std::max(x[k] - tile.left, tile.right - x[k]);
        const float far_y = std::max(y[k] - tile.top, tile.bottom - y[k]);
        upper[k] = weight[k] * (far_x * far_x + aspect * (far_y * far_y));
        least = std::min(least, bits(tag.set(upper[k], k)));
    }
    return tag.number(value_of(least));
}

// Coordinates from the tile's corner keep the error of the vertex small.
RANGEEDGE_WIDE void exceed(const Candidates& from, int pivot, const Tile& tile, float aspect, const float* upper,
                           float* excess) {
    const float *weight = from.weight.data(), *x = from.x.data(), *y = from.y.data();
    const float left = tile.left, top = tile.top, width = tile.right - left, height = tile.bottom - top;
    const float pivot_w = weight[pivot], pivot_x = x[pivot] - left, pivot_y = y[pivot] - top;
    const float pivot_upper = upper[pivot];
    const int count = from.count();
    for (int k = 0; k < count; ++k)
        excess[k] = least_excess(weight[k], x[k] - left, pivot_w, pivot_x, width) +
                    least_excess(aspect * weight[k], y[k] - top, aspect * pivot_w, pivot_y, height) -
                    (upper[k] + pivot_upper) * slack;
}

PivotPlane plane_of_pivot(float weight, float x, float y, const Tile& tile, float unit_y) {
    const float s = 1.0f / std::sqrt(weight);
    const float dx = 0.5f * (tile.left + tile.right) - x, dy = unit_y * (0.5f * (tile.top + tile.bottom) - y);
    const float half_x = 0.5f * (tile.right - tile.left), half_y = unit_y * 0.5f * (tile.bottom - tile.top);
    const float radius = std::sqrt(half_x * half_x + half_y * half_y), distance = std::sqrt(dx * dx + dy * dy);
    if (distance < 2.0f * radius + 1.0f) return {(distance + radius) / s, 0.0f, 0.0f};
    // What a circle rises above its tangent within `radius`.
    const float bend = radius * radius / (2.0f * (distance - radius));
    return {(distance + bend) / s, dx / (distance * s), dy / (distance * s)};
}

RANGEEDGE_WIDE void exceed_as_planes(const Candidates& from, const PivotPlane& pivot, const Tile& tile, float unit_y,
                                     float* excess) {
    const float *left = from.left.data(), *right = from.right.data();
    const float *top = from.top.data(), *bottom = from.bottom.data();
    const float *peak = from.peak.data(), *slope_x = from.slope_x.data(), *slope_y = from.slope_y.data();
    const float middle_x = 0.5f * (tile.left + tile.right), middle_y = 0.5f * (tile.top + tile.bottom);
    const float tile_x = 0.5f * (tile.right - tile.left), tile_y = unit_y * 0.5f * (tile.bottom - tile.top);
    const float pivot_reach = std::abs(pivot.rise_x) * tile_x + std::abs(pivot.rise_y) * tile_y;
    const float pivot_0 = pivot.middle, rise_x = pivot.rise_x, rise_y = pivot.rise_y, per_unit = 1.0f / unit_y;
    const int count = from.count();
    for (int k = 0; k < count; ++k) {
        const float half_x = 0.5f * (right[k] - left[k]), half_y = unit_y * 0.5f * (bottom[k] - top[k]);
        const float dx = middle_x - 0.5f * (left[k] + right[k]), dy = unit_y * (middle_y - 0.5f * (top[k] + bottom[k]));
        const float distance = std::sqrt(dx * dx + dy * dy), inverse = 1.0f / std::max(distance, 1e-3f);
        const float ux = dx * inverse, uy = dy * inverse, gx = slope_x[k], gy = slope_y[k] * per_unit, s = peak[k];
        const float by_tile = std::abs(ux - s * rise_x) * tile_x + std::abs(uy - s * rise_y) * tile_y;
        const float by_block = std::abs(ux + pivot_0 * gx) * half_x + std::abs(uy + pivot_0 * gy) * half_y;
        const float slope_reach = std::abs(gx) * half_x + std::abs(gy) * half_y;
        const float rounding = (distance + pivot_0 * (s + slope_reach)) * (8.0f * slack);
        excess[k] = distance - pivot_0 * s - by_tile - by_block - pivot_reach * slope_reach - rounding;
    }
}

RANGEEDGE_WIDE void compare(int count, const float* weight, const float* x, const float* y, const Tile& tile,
                            float aspect, float* least, std::int32_t* number, float* second) {
    float column[tile_pixels], row[tile_pixels];
    for (int p = 0; p < tile_pixels; ++p) {
        column[p] = tile.left + static_cast<float>(p % tile_size);
        row[p] = tile.top + static_cast<float>(p / tile_size);
    }
    std::fill_n(least, tile_pixels, std::numeric_limits<float>::max());
    std::fill_n(second, tile_pixels, std::numeric_limits<float>::max());
    std::fill_n(number, tile_pixels, 0);
    for (int i = 0; i < count; ++i) {
        const float w = weight[i], xi = x[i], yi = y[i];
        for (int p = 0; p < tile_pixels; ++p) {
            const float dx = column[p] - xi, dy = row[p] - yi;
            const float value = w * (dx * dx + aspect * (dy * dy));
            second[p] = std::min(second[p], std::max(least[p], value));
            number[p] = value < least[p] ? i : number[p];
            least[p] = std::min(least[p], value);
        }
    }
}

RANGEEDGE_WIDE void mark_near(int count, const float* weight, const float* x, const float* y, float row, float col,
                              float aspect, float limit, std::uint8_t* marks) {
    for (int first = 0; first < count; first += lanes)
        for (int i = first; i < first + lanes; ++i) {
            const float dx = col - x[i], dy = row - y[i];
            marks[i] = weight[i] * (dx * dx + aspect * (dy * dy)) <= limit;
        }
}

RANGEEDGE_WIDE void weigh(const double* squared, const double* salience, double width, float* distance) {
    for (int p = 0; p < tile_pixels; ++p)
        distance[p] = static_cast<float>(width * (std::sqrt(squared[p]) / salience[p]));
}

}  // namespace rangeedge
