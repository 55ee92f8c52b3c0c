// The ridge of a roof runs along the direction in which the quadratic bends least. It parts the pixels in two; a plane
// is fitted to either side, each pixel goes to the plane that lies on the outside of a valley or the inside of a ridge
// there, and so on until nothing changes. A few thousand pixels tell this as well as all of a large surface do.
// SPDX-License-Identifier: Apache-2.0
#include "regions/roof.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace rangeedge {
namespace {

constexpr double roof_gain = 0.97;                // two planes must lower the rms of the quadratic to this share
constexpr double chance_gain = 4;                 // by chance
constexpr int roof_rounds = 8, roof_promise = 3;  // after which two planes are to be better
constexpr double rounded = 2.5;                   // pixels on either side of a ridge that may be rounded
constexpr std::size_t most_samples = 1024;
const double pi = std::acos(-1.0);

struct Roof {
    Surface first, second;
    bool convex;

    bool in_first(double on_first, double on_second) const {
        return convex ? on_first <= on_second : on_first >= on_second;
    }
};

}  // namespace

bool split_roof(const SurfaceImage& image, const Pixels& pixels, const Surface& curved, Pixels& first, Pixels& second) {
    struct Point {
        Sample at;
        double misfit;  // squared, of the quadratic
    };
    std::vector<Point> points;
    const std::size_t step = pixels.size() / most_samples + 1;
    points.reserve(pixels.size() / step + 1);
    for (std::size_t k = 0; k < pixels.size(); k += step) {
        const Sample s = image.sample(pixels[k]);
        const double r = s.ordinate - curved.value(s.x, s.y);
        points.push_back({s, s.weight * r * r});
    }

    const double xx = curved.c[3], xy = curved.c[4] / 2, yy = curved.c[5];
    const double mean = (xx + yy) / 2, root = std::hypot((xx - yy) / 2, xy);
    Roof roof{{}, {}, std::abs(mean - root) > std::abs(mean + root)};
    const double across = 0.5 * std::atan2(2 * xy, xx - yy) + (roof.convex ? pi / 2 : 0);
    const double cx = std::cos(across), cy = std::sin(across);
    const SurfaceSums none(curved.x0, curved.y0, curved.c[0]);
    SurfaceSums side_a = none, side_b = none;
    for (const auto& [s, misfit] : points)
        ((s.x - curved.x0) * cx + (s.y - curved.y0) * cy < 0 ? side_a : side_b).add_to_plane(s);
    const int least = std::max(least_pixels / static_cast<int>(step), 4);
    double of_roof = 0, of_curved = 0;
    for (int round = 0; round < roof_rounds; ++round) {
        Watch::checkpoint();
        if (side_a.count() < least || side_b.count() < least) return false;
        roof.first = side_a.plane(), roof.second = side_b.plane();
        const double bend = std::hypot(roof.first.c[1] - roof.second.c[1], roof.first.c[2] - roof.second.c[2]);
        const int before = side_a.count();
        side_a = side_b = none;
        of_roof = of_curved = 0;
        for (const auto& [s, misfit] : points) {
            const double a = roof.first.value_on_plane(s.x, s.y), b = roof.second.value_on_plane(s.x, s.y);
            // The ridge itself may be rounded: neither fits nor the comparison count the pixels along it.
            if (std::abs(a - b) < rounded * bend) continue;
            const bool on_a = roof.in_first(a, b);
            (on_a ? side_a : side_b).add_to_plane(s);
            const double r = s.ordinate - (on_a ? a : b);
            of_roof += s.weight * r * r, of_curved += misfit;
        }
        if (round && side_a.count() == before) break;
        if (round == roof_promise && of_roof > of_curved) return false;
    }
    const double chance = chance_gain * image.correlation_area() / static_cast<double>(pixels.size());
    const double gain = std::max(1 - roof_gain * roof_gain, chance);
    if (side_a.count() < least || side_b.count() < least || of_roof >= (1 - gain) * of_curved) return false;
    first.clear(), second.clear();
    Checkpoints checkpoints;
    for (const int p : pixels) {
        checkpoints.pass();
        const Sample s = image.sample(p);
        const bool on_a = roof.in_first(roof.first.value_on_plane(s.x, s.y), roof.second.value_on_plane(s.x, s.y));
        (on_a ? first : second).push_back(p);
    }
    return true;
}

}  // namespace rangeedge
