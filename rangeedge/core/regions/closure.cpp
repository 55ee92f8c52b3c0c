// SPDX-License-Identifier: Apache-2.0
#include "regions/closure.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "image/components.hpp"
#include "regions/roof.hpp"

namespace rangeedge {
namespace {

class Closer {
public:
    Closer(const RangeMap& map, const ClosureParameters& parameters, Team& team)
        : image_(map, lateral_deviation, team), parameters_(parameters), region_(size(), 0) {
        image_.set_correlation(parameters.correlation, 1);
    }

    void verify();
    void grow_back();
    void write(std::int32_t* regions) const;

private:
    std::size_t size() const { return static_cast<std::size_t>(image_.size()); }
    int& region(int p) { return region_[static_cast<std::size_t>(p)]; }
    template <class F>
    void for_pixels(F&& visit) const {
        for (int row = 0; row < image_.rows(); ++row) {
            Watch::checkpoint();
            for (int p = image_.index(row, 0), end = p + image_.cols(); p < end; ++p) visit(p);
        }
    }
    bool lies_on(const Pixels& pixels, const Surface& surface) const;
    bool is_surface(const Pixels& pixels) const;
    bool erode(std::vector<std::uint8_t>& mask, bool square) const;

    SurfaceImage image_;
    ClosureParameters parameters_;
    std::vector<int> region_;  // of every pixel, 0: none
};

bool Closer::lies_on(const Pixels& pixels, const Surface& surface) const {
    const double limit = parameters_.tolerance * parameters_.tolerance;
    const auto near =
        std::count_if(pixels.begin(), pixels.end(), [&](int p) { return image_.residual(p, surface) <= limit; });
    return static_cast<double>(near) >= parameters_.share * static_cast<double>(pixels.size());
}

// A plane, or a quadratic that two planes do not beat.
bool Closer::is_surface(const Pixels& pixels) const {
    const SurfaceSums sums = image_.sums_of(pixels);
    if (sums.count() < least_pixels) return false;
    if (lies_on(pixels, sums.plane())) return true;
    const Surface curved = sums.quadratic();
    if (sums.count() < least_curved || !lies_on(pixels, curved)) return false;
    Pixels first, second;
    return !split_roof(image_, pixels, curved, first, second);
}

// By a square or a cross; what lies outside the image takes nothing away. Returns whether anything was.
bool Closer::erode(std::vector<std::uint8_t>& mask, bool square) const {
    const int s = image_.stride();
    const auto set_margin = [&](std::uint8_t value) {
        std::fill(mask.begin(), mask.begin() + s, value);
        std::fill(mask.end() - s, mask.end(), value);
        for (std::size_t p = 0; p < mask.size(); p += static_cast<std::size_t>(s))
            mask[p] = mask[p + static_cast<std::size_t>(s) - 1] = value;
    };
    set_margin(1);
    const std::vector<std::uint8_t> before = mask;
    const std::uint8_t* const m = before.data();
    Checkpoints checkpoints;
    for (int row = 0; row < image_.rows(); ++row)
        for (int p = image_.index(row, 0), end = p + image_.cols(); p < end; ++p) {
            checkpoints.pass();
            int kept = m[p] & m[p - s] & m[p - 1] & m[p + 1] & m[p + s];
            if (square) kept &= m[p - s - 1] & m[p - s + 1] & m[p + s - 1] & m[p + s + 1];
            mask[static_cast<std::size_t>(p)] = static_cast<std::uint8_t>(kept);
        }
    const bool changed = mask != before;
    set_margin(0);
    return changed;
}

// Numbers the components that are surfaces, and erodes the others until their parts are.
void Closer::verify() {
    std::vector<std::uint8_t> pending(size(), 0);
    for_pixels([&](int p) { pending[static_cast<std::size_t>(p)] = image_.open(p); });
    Pixels pixels;
    int count = 0;
    for (int step = 0; step <= parameters_.dilations; ++step) {
        const Components parts(pending.data(), image_.rows(), image_.cols());
        std::fill(pending.begin(), pending.end(), std::uint8_t{0});
        bool failed = false;
        Checkpoints checkpoints(256);
        for (int i = 0; i < parts.count(); ++i) {
            checkpoints.pass();
            if (parts.area(i) < parameters_.min_area) continue;
            pixels.clear();
            for (const auto [begin, end] : parts.runs(i))
                for (int p = begin; p < end; ++p) pixels.push_back(p);
            if (is_surface(pixels)) {
                ++count;
                for (const int p : pixels) region(p) = count;
            } else {
                failed = true;
                for (const int p : pixels) pending[static_cast<std::size_t>(p)] = 1;
            }
        }
        if (!failed || !erode(pending, step % 2)) return;  // cross and square in turn: an octagon
    }
}

// A pixel at a time; where regions meet, the one of higher number comes first.
void Closer::grow_back() {
    Pixels front, next;
    Checkpoints checkpoints;
    const auto reach = [&](int from, int label) {
        for (const int step : image_.neighbours()) {
            int& other = region(from + step);
            if (other > 0 || !image_.open(from + step)) continue;
            if (!other) next.push_back(from + step);
            other = std::min(other, -label);  // negative: of this round
        }
    };
    for_pixels([&](int p) {
        if (region(p) > 0) reach(p, region(p));
    });
    while (!next.empty()) {
        front.swap(next);
        next.clear();
        for (const int p : front) region(p) = -region(p);
        for (const int p : front) {
            checkpoints.pass();
            reach(p, region(p));
        }
    }
}

void Closer::write(std::int32_t* regions) const {
    for_pixels([&](int p) { *regions++ = region_[static_cast<std::size_t>(p)]; });
}

}  // namespace

void verified_regions(const RangeMap& map, const ClosureParameters& parameters, int threads, std::int32_t* regions) {
    Team team(threads);
    Closer closer(map, parameters, team);
    closer.verify();
    closer.grow_back();
    closer.write(regions);
}

}  // namespace rangeedge
