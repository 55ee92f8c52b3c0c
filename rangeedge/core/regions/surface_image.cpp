// SPDX-License-Identifier: Apache-2.0
#include "regions/surface_image.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>

#include "base/simd.hpp"

namespace rangeedge {
namespace {

constexpr double flat = 1.25;        // rms in standard deviations up to which a plane is one
constexpr double resolution = 1e-6;  // of ordinates in single precision
constexpr int sample_step = 61;      // one pixel in so many tells the typical noise

// The least and the greatest of n ordinates and 0, each in as many lanes; NaN and infinities do not count.
constexpr int lanes = 16;
struct Range {
    float low[lanes]{}, high[lanes]{};

    double extent() const {
        return static_cast<double>(*std::max_element(high, high + lanes)) -
               static_cast<double>(*std::min_element(low, low + lanes));
    }
};

RANGEEDGE_WIDE void extend(Range& range, const float* ordinate, int n) {
    Range r = range;
    const auto extend_lane = [&](int k, float value) RANGEEDGE_ALWAYS {
        const float f = std::isfinite(value) ? value : 0.0f;
        r.low[k] = f < r.low[k] ? f : r.low[k], r.high[k] = f > r.high[k] ? f : r.high[k];
    };
    int i = 0;
    for (; i + lanes <= n; i += lanes)
        for (int k = 0; k < lanes; ++k) extend_lane(k, ordinate[i + k]);
    for (; i < n; ++i) extend_lane(0, ordinate[i]);
    range = r;
}

// The standard deviations of n pixels from `first`.
RANGEEDGE_WIDE void deviations(const RangeMap& map, std::int64_t first, int n, double least, double* __restrict sigma) {
    const float* const ordinate = map.ordinate + first;
    const Noise& noise = map.noise;
    const double offset = map.offset;
    const bool projective = map.projective;
    for (int k = 0; k < n; ++k) {
        const double s = noise.sigma(offset + static_cast<double>(ordinate[k]), first + k, projective);
        sigma[k] = s > least ? s : least;
    }
}

}  // namespace

SurfaceImage::SurfaceImage(const RangeMap& map, double lateral, Team& team)
    : rows_(map.rows), cols_(map.cols), projective_(map.projective), regular_(!map.x && !map.y), lateral_(lateral),
      offset_(map.offset), to_plane_(map.to_plane), pixel_(static_cast<std::size_t>(size())), state_(size(), none) {
    Array<Range> ranges(team.size());
    parallel_for(rows_, team, [&](int first, int last, int thread) {
        extend(ranges[thread], map.ordinate + first * cols_, (last - first) * cols_);
    });
    Range all;
    for (const Range& r : ranges) extend(all, r.low, lanes), extend(all, r.high, lanes);
    const double least = std::max({resolution * all.extent(), map.rounding, std::numeric_limits<double>::min()});
    std::vector<double> sigmas;
    for (int k = 0; k < rows_ * cols_; k += sigmas.empty() ? 1 : sample_step - k % sample_step)
        if (std::isfinite(map.ordinate[k])) deviations(map, k, 1, least, &sigmas.emplace_back());
    if (sigmas.empty()) sigmas.push_back(1);
    const auto middle = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 2);
    std::nth_element(sigmas.begin(), middle, sigmas.end());
    unit_ = *middle;
    // Every thread writes its rows first, so that it also is the one that has their memory allocated.
    parallel_for(rows_ + 2, team, [&](int first, int last, int) {
        std::vector<double> sigma(static_cast<std::size_t>(cols_));
        for (int row = first - 1; row < last - 1; ++row) {
            Pixel* const pixel = &pixel_[static_cast<std::size_t>(index(row, 0))];
            if (row < 0 || row >= rows_) {
                std::fill_n(pixel - 1, stride(), Pixel{});
                continue;
            }
            pixel[-1] = pixel[cols_] = {};
            deviations(map, std::int64_t{row} * cols_, cols_, least, sigma.data());
            fill_row(map, row, sigma.data());
        }
    });
}

RANGEEDGE_WIDE void SurfaceImage::fill_row(const RangeMap& map, int row, const double* __restrict sigma) {
    const std::ptrdiff_t first = std::ptrdiff_t{row} * cols_;
    const int n = cols_;
    const float* const ordinate = map.ordinate + first;
    Pixel* __restrict const pixel = &pixel_[static_cast<std::size_t>(index(row, 0))];
    std::uint8_t* __restrict const state = &state_[index(row, 0)];
    const double per_unit = 1 / unit_;
    RANGEEDGE_INDEPENDENT
    for (int k = 0; k < n; ++k) {
        const bool seen = std::isfinite(ordinate[k]);
        const double s = sigma[k] * per_unit;
        const float f = static_cast<float>(static_cast<double>(ordinate[k]) * per_unit);
        pixel[k] = {static_cast<float>(k), static_cast<float>(row), seen ? f : 0.0f,
                    seen ? static_cast<float>(s * s) : 0.0f};
        state[k] = seen ? open_pixel : none;
    }
    if (map.x)
        for (int k = 0; k < n; ++k) pixel[k].x = map.x[first + k], pixel[k].y = map.y[first + k];
    if (!map.edges) return;
    const std::uint8_t* const edges = map.edges + first;
    RANGEEDGE_INDEPENDENT
    for (int k = 0; k < n; ++k)
        if (state[k] && edges[k]) state[k] = edge_pixel;
}

double SurfaceImage::residual(const SurfaceSums& sums, const Surface& s) const {
    const double x = sums.mean_x(), y = sums.mean_y(), rms = sums.rms(s);
    const double mean_variance = sums.count() / sums.weight();
    return rms * rms * mean_variance / variance(mean_variance, s.slope_x(x, y), s.slope_y(x, y));
}

SurfaceSums SurfaceImage::origin_of(const Pixels& pixels) const {
    double x = 0, y = 0, f = 0;
    Checkpoints checkpoints;
    for (const int p : pixels) {
        checkpoints.pass();
        const Sample s = sample(p);
        x += s.x, y += s.y, f += s.ordinate;
    }
    const double n = static_cast<double>(std::max<std::size_t>(pixels.size(), 1));
    return SurfaceSums(x / n, y / n, f / n);
}

SurfaceSums SurfaceImage::sums_of(const Pixels& pixels) const {
    SurfaceSums sums = origin_of(pixels);
    Checkpoints checkpoints;
    for (const int p : pixels) {
        checkpoints.pass();
        sums.add(sample(p));
    }
    return sums;
}

RANGEEDGE_WIDE void SurfaceImage::sum_columns(int first, int rows, int n, const double* base,
                                              const ColumnSums& sums) const {
    double *const w0 = sums.w[0], *const w1 = sums.w[1], *const w2 = sums.w[2], *const w3 = sums.w[3],
                  *const w4 = sums.w[4], *const f0 = sums.wf[0], *const f1 = sums.wf[1], *const f2 = sums.wf[2],
                  *const ff = sums.wff;
    for (double* const sum : {w0, w1, w2, w3, w4, f0, f1, f2, ff}) std::fill_n(sum, n, 0.0);
    std::fill_n(sums.closed, n, std::uint8_t{0});
    for (int row = 0; row < rows; ++row) {
        const Pixel* const pixel = &at(first + row * stride());
        const std::uint8_t* const state = &state_[first + row * stride()];
        const double v = row - rows / 2, vv = v * v, vvv = v * vv, vvvv = vv * vv;
        RANGEEDGE_INDEPENDENT
        for (int k = 0; k < n; ++k) {
            const double w = 1 / static_cast<double>(pixel[k].variance);
            const double f = static_cast<double>(pixel[k].ordinate) - base[k], wf = w * f;
            w0[k] += w, w1[k] += w * v, w2[k] += w * vv, w3[k] += w * vvv, w4[k] += w * vvvv;
            f0[k] += wf, f1[k] += wf * v, f2[k] += wf * vv, ff[k] += wf * f;
        }
        RANGEEDGE_INDEPENDENT
        for (int k = 0; k < n; ++k)
            sums.closed[k] = static_cast<std::uint8_t>(sums.closed[k] | (state[k] != open_pixel));
    }
}

bool SurfaceImage::is_flat(const Surface& surface) const { return surface.rms <= flat * correlation_; }

Surface SurfaceImage::surface_of(const SurfaceSums& sums) const {
    const Surface plane = sums.plane();
    if (is_flat(plane) || sums.count() < least_curved) return plane;
    const Surface curved = sums.quadratic();
    return curved.rms < curved_gain * plane.rms ? curved : plane;
}

// Of a projective image, the plane q = a x + b y + c holds the points with a X + b Y + c Z = 1.
std::array<double, 3> SurfaceImage::normal(const Surface& s, double x, double y) const {
    const auto& m = to_plane_;
    const double det = m[0] * m[4] - m[1] * m[3];
    const double fx = unit_ * s.slope_x(x, y), fy = unit_ * s.slope_y(x, y);
    const double a = (m[4] * fx - m[3] * fy) / det, b = (m[0] * fy - m[1] * fx) / det;
    double c = -1;
    if (projective_) {
        const double px = m[0] * x + m[1] * y + m[2], py = m[3] * x + m[4] * y + m[5];
        c = offset_ + unit_ * s.value(x, y) - px * a - py * b;
    }
    return {a, b, c};
}

SurfaceImage::Continuation SurfaceImage::continuation(int p, int q, const Surface& a, const Surface& b) const {
    const Sample u = sample(p), v = sample(q);
    const double x = (u.x + v.x) / 2, y = (u.y + v.y) / 2;
    const double between = a.value(x, y) - b.value(x, y);
    const double spread = std::max(variance(1 / u.weight, a.slope_x(x, y), a.slope_y(x, y)),
                                   variance(1 / v.weight, b.slope_x(x, y), b.slope_y(x, y)));
    const auto dot = [](const std::array<double, 3>& m, const std::array<double, 3>& n) {
        return m[0] * n[0] + m[1] * n[1] + m[2] * n[2];
    };
    const auto na = normal(a, x, y), nb = normal(b, x, y);
    return {between * between / spread, dot(na, nb) / std::sqrt(dot(na, na) * dot(nb, nb))};
}

}  // namespace rangeedge
