// Growing: patches take the free pixels around them that lie on their surfaces.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "regions/patches.hpp"

namespace rangeedge {

// Tiles and patches by the misfit of one to the other, the smallest first, first come first served among equals.
class TileQueue {
public:
    static constexpr int levels = 32;
    struct Entry {
        int tile, patch;
    };

    void push(int level, Entry entry) {
        bucket_[static_cast<std::size_t>(level)].push_back(entry);
        lowest_ = std::min(lowest_, static_cast<std::size_t>(level));
    }
    bool pop(Entry& entry) {
        for (; lowest_ < levels; ++lowest_) {
            auto& bucket = bucket_[lowest_];
            std::size_t& head = head_[lowest_];
            if (head < bucket.size()) {
                entry = bucket[head++];
                return true;
            }
            bucket.clear();
            head = 0;
        }
        return false;
    }

private:
    std::array<std::vector<Entry>, levels> bucket_;
    std::array<std::size_t, levels> head_{};
    std::size_t lowest_ = levels;
};

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

    void start(PatchMap::Free reach, double tolerance);
    void over_tiles(const Tiles& tiles);
    int over_pixels(int rounds, bool refit);
    bool is_free(const Tiles& tiles, int t) const;
    int level_of(const Tiles& tiles, int t, int i) const;
    void take_tile(const Tiles& tiles, int t, int i);
    void refit_when_due(Patch& patch);
    Choice choose(int p) const;
    void commit(bool refit);
    void wait(int p);
    template <class F>
    void for_front(F&& body);

    PatchMap& patches_;
    const SurfaceImage& image_;
    PatchMap::Free reach_ = PatchMap::open_pixel;
    double limit_ = 0;  // of squared residuals
    TileQueue queue_;
    Array<std::uint8_t> waiting_;  // whether a pixel is in front_
    std::vector<int> front_, next_, taken_;
    std::vector<Choice> choices_;
};

}  // namespace rangeedge
