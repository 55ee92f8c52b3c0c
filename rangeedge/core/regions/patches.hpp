// Patches: sets of pixels with one surface each, of which regions are made.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

#include "base/array.hpp"
#include "base/disjoint_sets.hpp"
#include "base/parallel.hpp"
#include "regions/surface.hpp"
#include "regions/surface_image.hpp"
#include "regions/tiles.hpp"

namespace rangeedge {

struct Patch {
    SurfaceSums sums;
    Surface surface;
    int refit_at;           // pixels at which the surface is due to be fitted anew
    int whole = 0;          // pixels it had when it was found to be no roof
    bool absorbed = false;  // belongs to the region of a much larger one, and joins no other
    int count() const { return sums.count(); }
};

// Which patch every pixel of an image belongs to, and the patches themselves. Patch 0 is none.
class PatchMap {
public:
    // What a pixel without a patch is: `reach` of a search is the last of them that it takes.
    enum Free : std::uint8_t { taken, open_pixel, edge_pixel };

    PatchMap(const RangeMap& map, Team& team);

    SurfaceImage& image() { return image_; }
    const SurfaceImage& image() const { return image_; }
    const TilePyramid& tiles() const { return tiles_; }
    Team& team() { return team_; }

    int count() const { return patches_.count(); }
    Patch& patch(int i) { return patches_[i]; }
    const Patch& patch(int i) const { return patches_[i]; }
    int operator[](int p) const { return label_[p]; }
    bool is_free(int p, Free reach) const { return free_[p] != taken && free_[p] <= reach; }
    // Whether n pixels in a row, 4 or 8, are free and open.
    bool are_open(int p, int n) const {
        static constexpr std::uint8_t open[8]{open_pixel, open_pixel, open_pixel, open_pixel,
                                              open_pixel, open_pixel, open_pixel, open_pixel};
        return n == 8 ? !std::memcmp(&free_[p], open, 8) : !std::memcmp(&free_[p], open, 4);
    }

    void prefetch(int p) const {
        image_.prefetch(p);
        __builtin_prefetch(&label_[p - image_.stride()]);
        __builtin_prefetch(&label_[p + image_.stride()]);
    }

    void take(int p, int i) { label_[p] = i, free_[p] = taken; }
    void release(int p) {
        label_[p] = 0;
        free_[p] = image_.open(p) ? open_pixel : image_.valid(p) ? edge_pixel : taken;
    }

    // The patch whose surface is that of patch i, after patches were joined, and the one that names its region.
    int surface(int i) { return surfaces_.find(i); }
    int region(int i) { return regions_.find(surfaces_.find(i)); }
    // Patches b and its pixels become part of patch a, which they share a surface with.
    void join_surfaces(int a, int b);
    void join_regions(int a, int b) { regions_.link(region(b), region(a)); }
    // Labels of joined patches become those of the patch they joined.
    void flatten();

    // A patch for the open pixels of every marker > 0, or several where planes that meet in a crease describe them
    // better; likewise for every set of pixels, where the surface lies within `limit` standard deviations of them.
    // Returns whether there is any patch. Markers tell how much the noise over a region is.
    void add_markers(const std::int32_t* markers);
    bool add_patches(const std::vector<Pixels>& sets, double limit);
    // The pixels of patches, in raster order: sets 0 .. count - 1 of those whose patch has number 1 .. count.
    std::vector<Pixels> pixels_of(const Array<int>& number, int count) const;
    // Divides the patches that have grown around a crease; returns whether there were any.
    bool cut_roofs();
    void refit();

    // Pixels of rows [first, last) whose patch is not that of their right or lower neighbour, in raster order.
    template <class F>
    void for_borders(int first, int last, F&& visit) const {
        constexpr int block = 16;
        const int stride = image_.stride();
        Checkpoints checkpoints(64);
        for (int row = first; row < last; ++row)
            for (int p = image_.index(row, 0), end = p + image_.cols(); p < end; p += block) {
                checkpoints.pass();
                const int n = std::min(block, end - p);
                const int* const label = &label_[p];
                int differ = 0;
                if (n == block)
                    for (int k = 0; k < block; ++k)
                        differ |= (label[k] ^ label[k + 1]) | (label[k] ^ label[k + stride]);
                else
                    differ = 1;
                if (!differ) continue;
                for (int k = 0; k < n; ++k)
                    if (label[k] != label[k + 1] || label[k] != label[k + stride]) visit(p + k);
            }
    }
    // Free pixels of rows [first, last), in raster order; most images have few.
    template <class F>
    void for_free(int first, int last, Free reach, F&& visit) const {
        for (int p = image_.index(first, 0), end = image_.index(last, 0); p < end;) {
            std::uint64_t eight = 1;
            if (p + 8 <= end) std::memcpy(&eight, &free_[p], sizeof eight);
            const int stop = eight ? std::min(p + 8, end) : p;
            for (int q = p; q < stop; ++q)
                if (is_free(q, reach)) visit(q);
            p += 8;
        }
    }

    static int refit_after(int count) { return count + count / 3 + 16; }

private:
    struct Piece {
        Pixels pixels;
        SurfaceSums sums;
        Surface surface;
    };

    void estimate_correlation(const std::vector<SurfaceSums>& sums);
    bool add_patches(const std::vector<Pixels>& sets, const std::vector<SurfaceSums>& sums, double limit);
    std::vector<SurfaceSums> sums_of(const std::vector<Pixels>& sets) const;
    void divide(const Pixels& pixels, const SurfaceSums& sums, int cuts, std::vector<Piece>& pieces) const;
    void create(const Piece& piece);

    SurfaceImage image_;
    TilePyramid tiles_;
    Team& team_;
    Array<int> label_;
    Array<std::uint8_t> free_;
    Array<Patch> patches_;
    DisjointSets surfaces_, regions_;
};

}  // namespace rangeedge
