// SPDX-License-Identifier: Apache-2.0
#include "closure.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace rangeedge {
namespace {

bool lie_on(const SurfaceImage& image, const Pixels& pixels, const Surface& surface, double tolerance, double share) {
    const auto near = std::count_if(pixels.begin(), pixels.end(), [&](int p) {
        return image.residual(p, surface) <= tolerance * tolerance;
    });
    return static_cast<double>(near) >= share * static_cast<double>(pixels.size());
}

bool is_surface(const SurfaceImage& image, const Pixels& pixels, double tolerance, double share) {
    if (pixels.size() < least_pixels) return false;
    const SurfaceSums sums = image.sums_of(pixels);
    if (lie_on(image, pixels, sums.plane(), tolerance, share)) return true;
    const Surface curved = sums.quadratic();
    if (pixels.size() < least_curved || !lie_on(image, pixels, curved, tolerance, share)) return false;
    Pixels first, second;
    return !image.split_roof(pixels, curved, first, second);
}

}  // namespace

void verify_surfaces(const RangeMap& map, const std::int32_t* labels, int count, double correlation, double tolerance,
                     double share, std::uint8_t* accepted) {
    SurfaceImage image(map, lateral_deviation);
    image.set_correlation(correlation);
    std::vector<Pixels> pixels(static_cast<std::size_t>(count) + 1);
    for (int row = 0; row < map.rows; ++row)
        for (int col = 0; col < map.cols; ++col) {
            const std::int32_t label = labels[row * map.cols + col];
            const int p = image.index(row, col);
            if (label > 0 && image.valid(p)) pixels[static_cast<std::size_t>(label)].push_back(p);
        }
    accepted[0] = 0;
    for (std::size_t i = 1; i < pixels.size(); ++i) accepted[i] = is_surface(image, pixels[i], tolerance, share);
}

}  // namespace rangeedge
