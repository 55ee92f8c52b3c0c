// SPDX-License-Identifier: Apache-2.0
#include "cleaning/surfaces.hpp"

#include <algorithm>

#include "base/watch.hpp"

namespace rangeedge {

std::vector<Surface> fit_surfaces(const OrdinateMap& map, const std::int32_t* labels, int count) {
    std::vector<SurfaceSums> sums(static_cast<std::size_t>(count));
    Checkpoints checkpoints;
    for (int p = 0; p < map.size(); ++p) {
        checkpoints.pass();
        if (labels[p] <= 0 || !map.valid(p)) continue;
        SurfaceSums& own = sums[static_cast<std::size_t>(labels[p])];
        const double x = map.x_of(p), y = map.y_of(p), ordinate = static_cast<double>(map.ordinate[p]);
        if (own.count() == 0) own = SurfaceSums(x, y, ordinate);
        own.add({x, y, ordinate, 1});
    }
    std::vector<Surface> surfaces(sums.size());
    for (std::size_t label = 1; label < sums.size(); ++label) {
        const SurfaceSums& own = sums[label];
        checkpoints.pass();
        if (own.count() == 0) continue;
        // Counted from the middle, where powers are smallest.
        SurfaceSums middle(own.mean_x(), own.mean_y(), own.mean_ordinate());
        middle.add(own);
        surfaces[label] = middle.plane();
        if (middle.count() < least_curved) continue;
        const Surface quadratic = middle.quadratic();
        if (quadratic.rms < curved_gain * surfaces[label].rms) surfaces[label] = quadratic;
    }
    return surfaces;
}

}  // namespace rangeedge
