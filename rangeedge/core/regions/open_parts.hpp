// The parts into which edges and regions divide an image: connected open pixels of one region.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "base/array.hpp"
#include "regions/surface_image.hpp"

namespace rangeedge {

// Where two parts are open to each other: neighbours of either without an edge between them.
struct OpenBorder {
    int first, second;  // parts, first < second
    Pixels pixels;      // of both
};

class OpenParts {
public:
    // `regions` are labels of rows * cols pixels; open pixels without one fall to the nearest.
    OpenParts(const SurfaceImage& image, const std::int32_t* regions);

    int count() const { return count_; }
    int at(int p) const { return part_[p]; }
    const Pixels& pixels(int part) const { return pixels_[static_cast<std::size_t>(part)]; }

    // Gives parts that are small, or nowhere wider than a line, to the neighbour to which they are open most.
    void absorb_slivers(int min_area);
    // Gives what is narrower than a line between two others to what is beside it.
    void trim_spurs();
    void set(int p, int part) { part_[p] = part; }

    std::vector<OpenBorder> borders() const;
    // The pixels of both parts up to `reach` steps from their border, and how far they are.
    std::vector<std::pair<int, int>> near(const OpenBorder& border, int reach);
    // The connected lines of pixels that part the two: those of a border left of or above one of the other part.
    std::vector<Pixels> lines(const OpenBorder& border);

private:
    void number();
    void spread(Pixels front);
    bool thin(int p) const;

    const SurfaceImage& image_;
    Array<int> part_;  // of every pixel; 0: none
    int count_ = 0;
    std::vector<Pixels> pixels_;
    Array<char> marked_;  // 0 between calls
};

}  // namespace rangeedge
