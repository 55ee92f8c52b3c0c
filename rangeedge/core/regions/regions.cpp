// From markers to regions:
//  1. Every marker becomes a patch with a plane or a quadratic, or two where these meet in a crease.
//  2. Patches grow over tiles of pixels, then over the pixels between them; edges stop them. Where none has come, new
//     patches start.
//  3. Patches that one surface describes merge, and so do those whose surfaces go on into each other.
//  4. The pixels of edges, and others that are left, go to the neighbouring patch they fit best; borders move to where
//     the surfaces meet; strips along rounded edges fall to their neighbours, and so do regions that are too small.
// SPDX-License-Identifier: Apache-2.0
#include "regions/regions.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "image/components.hpp"
#include "regions/growing.hpp"
#include "regions/merging.hpp"
#include "regions/patches.hpp"

namespace rangeedge {
namespace {

constexpr double sure = 2.5;  // rms of a surface among edges that are none, in standard deviations
constexpr double loose = 2;   // pixels of edges and borders may lie farther off their surface, by this factor

// Components of what is free up to `reach` with all its neighbours become patches, if their surfaces lie within `limit`
// standard deviations of their pixels. Returns whether there are any.
bool add_uncovered(PatchMap& patches, PatchMap::Free reach, double limit) {
    const SurfaceImage& image = patches.image();
    const auto is_free = [&](int p) { return patches.is_free(p, reach); };
    const auto in_row = [&](int p) { return is_free(p - 1) && is_free(p) && is_free(p + 1); };
    Array<std::uint8_t> inside(image.size(), 0);
    std::vector<char> any(static_cast<std::size_t>(patches.team().size()), 0);
    parallel_for(image.rows(), patches.team(), [&](int first, int last, int thread) {
        char& found = any[static_cast<std::size_t>(thread)];
        patches.for_free(first, last, reach, [&](int p) {
            inside[p] = in_row(p - image.stride()) && in_row(p) && in_row(p + image.stride());
            found = found || inside[p];
        });
    });
    if (std::none_of(any.begin(), any.end(), [](char found) { return found; })) return false;
    const Components parts(inside.data(), image.rows(), image.cols(), patches.team());
    std::vector<Pixels> sets(static_cast<std::size_t>(parts.count()));
    parallel_each(parts.count(), patches.team(), [&](int i, int) {
        Pixels& pixels = sets[static_cast<std::size_t>(i)];
        pixels.reserve(static_cast<std::size_t>(parts.area(i)));
        for (const auto [begin, end] : parts.runs(i))
            for (int p = begin; p < end; ++p) pixels.push_back(p);
    });
    return patches.add_patches(sets, limit);
}

void grow(PatchMap& patches, Grower& grower, double tolerance) {
    grower.grow(tolerance);
    if (patches.cut_roofs()) grower.grow(tolerance);
}

// Connected parts of regions.
Components components_of(PatchMap& patches) {
    Array<int> region(patches.count());
    for (int i = 0; i < patches.count(); ++i) region[i] = patches.region(i);
    Array<int> image(patches.image().size());
    parallel_for(image.count(), patches.team(), [&](int begin, int end, int) {
        for (int p = begin; p < end; ++p) image[p] = region[patches[p]];
    });
    return Components(image.data(), patches.image().rows(), patches.image().cols(), patches.team());
}

void remove_small(PatchMap& patches, int min_area) {
    const Components parts = components_of(patches);
    Checkpoints checkpoints;
    for (int i = 0; i < parts.count(); ++i, checkpoints.pass())
        if (parts.area(i) < min_area)
            for (const auto [begin, end] : parts.runs(i))
                for (int p = begin; p < end; ++p) patches.release(p);
}

int write_labels(PatchMap& patches, std::int32_t* labels) {
    const SurfaceImage& image = patches.image();
    const Components regions = components_of(patches);
    parallel_for(image.rows(), patches.team(), [&](int first, int last, int) {
        std::fill(labels + std::ptrdiff_t{first} * image.cols(), labels + std::ptrdiff_t{last} * image.cols(), 0);
    });
    parallel_each(regions.count(), patches.team(), [&](int i, int) {
        for (const auto [begin, end] : regions.runs(i))
            std::fill_n(labels + std::ptrdiff_t{regions.row_of(begin)} * image.cols() + regions.col_of(begin),
                        end - begin, i + 1);
    });
    return regions.count();
}

}  // namespace

int grow_regions(const RangeMap& map, const std::int32_t* markers, const RegionParameters& parameters, int threads,
                 std::int32_t* labels) {
    Team team(threads);
    PatchMap patches(map, team);
    const Tolerance tolerance{parameters.tolerance, parameters.smooth_angle};

    patches.add_markers(markers);
    Grower grower(patches);
    grow(patches, grower, parameters.tolerance);
    if (parameters.new_seeds && add_uncovered(patches, PatchMap::open_pixel, HUGE_VAL))
        grow(patches, grower, parameters.tolerance);
    Adjacency between_edges(patches, tolerance);
    merge(patches, between_edges);
    patches.flatten();
    grower.fill(loose * parameters.tolerance);
    if (parameters.new_seeds && add_uncovered(patches, PatchMap::edge_pixel, sure))
        grower.fill(loose * parameters.tolerance);
    grower.adjust_borders();
    Adjacency adjacency(patches, tolerance);
    merge(patches, adjacency);
    absorb_strips(patches, adjacency);
    remove_small(patches, parameters.min_area);
    grower.fill(2 * loose * parameters.tolerance);
    return write_labels(patches, labels);
}

}  // namespace rangeedge
