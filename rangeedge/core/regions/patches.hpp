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
#include "regions/marks.hpp"
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
    // What a pixel without a patch is, as the image states it: `reach` of a search is the last state that it takes.
    using Free = SurfaceImage::State;
    static constexpr Free taken = SurfaceImage::none, open_pixel = SurfaceImage::open_pixel,
                          edge_pixel = SurfaceImage::edge_pixel;

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
    void release(int p) { label_[p] = 0, free_[p] = image_.state(p); }

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

    // Visits pixels of rows [first, last) in raster order: those whose patch is not that of their right or lower
    // neighbour,
    template <class F>
    void for_borders(int first, int last, F&& visit) const {
        for_rows(first, last, [&](int p, std::uint8_t* marks) { mark_borders(p, marks); }, visit);
    }
    // those beside a pixel of another patch,
    template <class F>
    void for_rims(int first, int last, F&& visit) const {
        for_rows(first, last, [&](int p, std::uint8_t* marks) { mark_rims(p, marks); }, visit);
    }
    // free ones,
    template <class F>
    void for_free(int first, int last, Free reach, F&& visit) const {
        for_rows(first, last, [&](int p, std::uint8_t* marks) { mark_free(p, reach, marks); }, visit);
    }
    // and free ones beside a pixel of a patch.
    template <class F>
    void for_touching(int first, int last, Free reach, F&& visit) const {
        for_rows(first, last, [&](int p, std::uint8_t* marks) { mark_touching(p, reach, marks); }, visit);
    }

    static int refit_after(int count) { return count + count / 3 + 16; }

private:
    struct Piece {
        Pixels pixels;
        SurfaceSums sums;
        Surface surface;
    };

    // Calls visit(p) for the pixels of rows that mark(first pixel of a row, marks) marks.
    template <class Mark, class F>
    void for_rows(int first, int last, Mark&& mark, F&& visit) const {
        const int cols = image_.cols();
        std::vector<std::uint8_t> marks(marks_size(cols));
        for (int row = first; row < last; ++row) {
            Watch::checkpoint();
            const int begin = image_.index(row, 0);
            mark(begin, marks.data());
            for_marked(marks.data(), cols, [&](int col) { visit(begin + col); });
        }
    }
    // Of the row that begins with pixel p.
    void mark_borders(int p, std::uint8_t* marks) const;
    void mark_rims(int p, std::uint8_t* marks) const;
    void mark_free(int p, Free reach, std::uint8_t* marks) const;
    void mark_touching(int p, Free reach, std::uint8_t* marks) const;

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
