// Growing: patches take the free pixels around them that lie on their surfaces.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "regions/patches.hpp"

namespace rangeedge {

// Grows the patches of one image. What it allocates is as large as the image, so it is made once.
class Grower {
public:
    explicit Grower(PatchMap& patches);

    // Patches grow over open pixels within `tolerance` standard deviations of their surfaces, which follow them.
    void grow(double tolerance);
    // Free pixels, of edges too, go to the neighbouring patch they fit best, within `tolerance`; surfaces stay.
    void fill(double tolerance);
    // Pixels at borders move to the neighbouring patch if they fit that better.
    void adjust_borders();

private:
    // Which of the neighbouring patches a pixel fits best, and how well.
    struct Choice {
        int patch = 0;
        double residual = 0;
    };

    // A pixel that goes to a patch.
    struct Offer {
        int pixel, patch;
    };

    template <class F>
    void start(F&& for_rows);
    void start(PatchMap::Free reach, double tolerance);
    void gather(std::vector<int>& to);
    void over_tiles(const Tiles& tiles);
    void over_tiles(const Tiles& tiles, double limit);
    int over_pixels(int rounds, bool refit);
    bool is_free(const Tiles& tiles, int t) const;
    Choice choose(const Tiles& tiles, int t, const SurfaceSums& sums) const;
    void take_tile(const Tiles& tiles, int t, int i, const SurfaceSums& sums);
    void refit_when_due(Patch& patch);
    int owner_count(bool shared) const;
    template <class F>
    void for_owners(int owners, F&& body);
    int choose(int p) const;
    void commit(int owners, bool refit);
    template <class Choose, class Concerns>
    int over_front(Choose&& choose, Concerns&& concerns, bool refit);
    void wait(int p);
    template <class F>
    void for_front(F&& body);

    PatchMap& patches_;
    const SurfaceImage& image_;
    PatchMap::Free reach_ = PatchMap::open_pixel;
    double limit_ = 0;  // of squared residuals
    // Whether a pixel is in front_, or the tile that begins with it in tiles_.
    static constexpr std::uint8_t pixel_waits = 1, tile_waits = 2;
    Array<std::uint8_t> waiting_;
    std::uint8_t round_ = 0;
    Array<std::uint8_t> came_;  // round in which a pixel went to its patch
    std::vector<int> front_;
    std::vector<std::vector<int>> found_;     // of every thread: the next front
    std::vector<std::vector<Offer>> offers_;  // of every thread, to the patches of every owner
    std::vector<int> tiles_, rejected_, taken_;
    std::vector<SurfaceSums> sums_;  // of tiles_
    std::vector<Choice> choices_;    // of tiles_
};

}  // namespace rangeedge
