// SPDX-License-Identifier: Apache-2.0
#include "surface_image.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace rangeedge {
namespace {

constexpr double flat = 1.25;            // rms in standard deviations up to which a plane is one
constexpr double curved_gain = 0.8;      // a quadratic must lower the rms to this share
constexpr double roof_gain = 0.97;          // two planes must lower the rms of the quadratic to this share
constexpr int roof_rounds = 8;
constexpr double rounding = 2.5;        // pixels on either side of a ridge
constexpr double correlation_max = 4.0;  // noise over a region, in units of that between pixels
constexpr double resolution = 1e-6;      // of ordinates in single precision
constexpr int sample_step = 7;           // one pixel in so many tells the typical noise
const double pi = std::acos(-1.0);

}  // namespace

SurfaceImage::SurfaceImage(const RangeMap& map, double lateral)
    : rows_(map.rows), cols_(map.cols), projective_(map.projective), lateral_(lateral), offset_(map.offset),
      to_plane_(map.to_plane), pixel_(static_cast<std::size_t>(size())),
      state_(static_cast<std::size_t>(size()), none) {
    float low = 0, high = 0;
    for (int k = 0; k < rows_ * cols_; ++k)
        if (std::isfinite(map.ordinate[k])) {
            low = std::min(low, map.ordinate[k]);
            high = std::max(high, map.ordinate[k]);
        }
    const double extent = static_cast<double>(high) - static_cast<double>(low) + std::abs(offset_);
    const double least = std::max(resolution * extent, std::numeric_limits<double>::min());
    const auto sigma = [&](int k) {
        const double ordinate = offset_ + static_cast<double>(map.ordinate[k]);
        const double z = projective_ ? 1 / ordinate : std::abs(ordinate);
        const double length = map.noise_map ? static_cast<double>(map.noise_map[k])
                                            : map.noise[0] + (map.noise[1] + map.noise[2] * z) * z;
        return std::max(projective_ ? length * ordinate * ordinate : length, least);
    };
    std::vector<double> sigmas;
    for (int k = 0; k < rows_ * cols_; k += sigmas.empty() ? 1 : sample_step - k % sample_step)
        if (std::isfinite(map.ordinate[k])) sigmas.push_back(sigma(k));
    if (sigmas.empty()) return;
    const auto middle = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 2);
    std::nth_element(sigmas.begin(), middle, sigmas.end());
    unit_ = *middle;
    for (int row = 0; row < rows_; ++row)
        for (int col = 0; col < cols_; ++col) {
            const int k = row * cols_ + col;
            if (!std::isfinite(map.ordinate[k])) continue;
            const auto p = static_cast<std::size_t>(index(row, col));
            const double s = sigma(k) / unit_;
            pixel_[p] = {map.x ? map.x[k] : static_cast<float>(col), map.y ? map.y[k] : static_cast<float>(row),
                         static_cast<float>(static_cast<double>(map.ordinate[k]) / unit_), static_cast<float>(s * s)};
            state_[p] = map.edges && map.edges[k] ? edge_pixel : plain;
        }
}

bool SurfaceImage::beside_edge(int p) const {
    const int s = stride();
    for (const int q : {p, p - s - 1, p - s, p - s + 1, p - 1, p + 1, p + s - 1, p + s, p + s + 1})
        if (edge(q)) return true;
    return false;
}

void SurfaceImage::estimate_correlation(const std::vector<Pixels>& sets) {
    std::vector<std::pair<double, double>> misfits;
    double total = 0, sum = 0;
    for (const Pixels& pixels : sets) {
        if (pixels.size() < least_curved) continue;
        misfits.emplace_back(sums_of(pixels).quadratic().rms, static_cast<double>(pixels.size()));
        total += misfits.back().second;
    }
    std::sort(misfits.begin(), misfits.end());
    for (const auto& [rms, weight] : misfits) {
        sum += weight;
        if (2 * sum < total) continue;
        correlation_ = std::clamp(rms, 1.0, correlation_max);
        return;
    }
}

SurfaceSums SurfaceImage::origin_of(const Pixels& pixels) const {
    double x = 0, y = 0, f = 0;
    for (const int p : pixels) {
        const Sample s = sample(p);
        x += s.x, y += s.y, f += s.ordinate;
    }
    const double n = static_cast<double>(std::max<std::size_t>(pixels.size(), 1));
    return SurfaceSums(x / n, y / n, f / n);
}

SurfaceSums SurfaceImage::sums_of(const Pixels& pixels) const {
    SurfaceSums sums = origin_of(pixels);
    for (const int p : pixels) sums.add(sample(p));
    return sums;
}

Surface SurfaceImage::plane_of(const Pixels& pixels) const {
    SurfaceSums sums = origin_of(pixels);
    for (const int p : pixels) sums.add_to_plane(sample(p));
    return sums.plane();
}

bool SurfaceImage::is_flat(const Surface& surface) const { return surface.rms <= flat * correlation_; }

Surface SurfaceImage::surface_of(const SurfaceSums& sums) const {
    const Surface plane = sums.plane();
    if (is_flat(plane) || sums.count() < static_cast<int>(least_curved)) return plane;
    const Surface curved = sums.quadratic();
    return curved.rms < curved_gain * plane.rms ? curved : plane;
}

bool SurfaceImage::split_roof(const Pixels& pixels, const Surface& curved, Pixels& first, Pixels& second) const {
    // The ridge runs along the direction of least curvature.
    const double xx = curved.c[3], xy = curved.c[4] / 2, yy = curved.c[5];
    const double mean = (xx + yy) / 2, root = std::hypot((xx - yy) / 2, xy);
    const bool convex = std::abs(mean - root) > std::abs(mean + root);
    const double across = 0.5 * std::atan2(2 * xy, xx - yy) + (convex ? pi / 2 : 0);
    const double cx = std::cos(across), cy = std::sin(across);
    first.clear(), second.clear();
    for (const int p : pixels) {
        const Sample s = sample(p);
        ((s.x - curved.x0) * cx + (s.y - curved.y0) * cy < 0 ? first : second).push_back(p);
    }
    // The ridge itself may be rounded: neither fits nor the comparison count the pixels along it.
    Pixels core_first = first, core_second = second, before_first, before_second;
    double roof = 0, smooth = 0;
    for (int round = 0; round < roof_rounds; ++round) {
        if (core_first.size() < least_pixels || core_second.size() < least_pixels) return false;
        const Surface a = plane_of(core_first), b = plane_of(core_second);
        const double bend = std::hypot(a.c[1] - b.c[1], a.c[2] - b.c[2]);
        core_first.swap(before_first), core_second.swap(before_second);
        first.clear(), second.clear(), core_first.clear(), core_second.clear();
        roof = smooth = 0;
        for (const int p : pixels) {
            const Sample s = sample(p);
            const double fa = a.value(s.x, s.y), fb = b.value(s.x, s.y);
            const bool in_first = convex ? fa <= fb : fa >= fb;
            (in_first ? first : second).push_back(p);
            if (std::abs(fa - fb) < rounding * bend) continue;
            (in_first ? core_first : core_second).push_back(p);
            const double r = s.ordinate - (in_first ? fa : fb), q = s.ordinate - curved.value(s.x, s.y);
            roof += s.weight * r * r;
            smooth += s.weight * q * q;
        }
        if (core_first == before_first && core_second == before_second) break;
    }
    return core_first.size() >= least_pixels && core_second.size() >= least_pixels &&
           roof < roof_gain * roof_gain * smooth;
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
    const double length = std::sqrt(a * a + b * b + c * c);
    return {a / length, b / length, c / length};
}

bool SurfaceImage::agree(int p, int q, const Surface& a, const Surface& b, double tolerance, double cosine) const {
    const Sample u = sample(p), v = sample(q);
    const double x = (u.x + v.x) / 2, y = (u.y + v.y) / 2;
    const double between = a.value(x, y) - b.value(x, y);
    const double spread = std::max(variance(at(p), a.slope_x(x, y), a.slope_y(x, y)),
                                   variance(at(p), b.slope_x(x, y), b.slope_y(x, y)));
    if (between * between > tolerance * tolerance * spread) return false;
    const auto na = normal(a, x, y), nb = normal(b, x, y);
    return na[0] * nb[0] + na[1] * nb[1] + na[2] * nb[2] >= cosine;
}

}  // namespace rangeedge
