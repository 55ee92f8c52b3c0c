// SPDX-License-Identifier: Apache-2.0
#include "regions/closure.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "regions/open_parts.hpp"

namespace rangeedge {
namespace {

constexpr int reach = 8;             // pixels from a border that tell how two surfaces meet there, and that it may move
constexpr double least_sided = 0.7;  // share of them that lie on their side of where the surfaces meet
constexpr double surely_beside = 2;  // pixels from a border

class Closer {
public:
    Closer(const RangeMap& map, const std::int32_t* regions, const ClosureParameters& parameters, Team& team)
        : image_(map, lateral_deviation, team), parameters_(parameters), parts_(image_, regions) {
        image_.set_correlation(parameters.correlation, 1);
    }

    void close() {
        tidy();
        align();
        tidy();
    }

    void draw(std::uint8_t* lines);

private:
    struct Part {
        Surface surface;
        bool verified = false;
    };

    bool lies_on(const Pixels& pixels, const Surface& surface) const;
    bool are_one(const OpenBorder& border) const;
    void tidy();
    void verify();
    void align();
    void align(const OpenBorder& border);
    const Part& part(int number) const { return of_part_[static_cast<std::size_t>(number)]; }

    SurfaceImage image_;
    ClosureParameters parameters_;
    OpenParts parts_;
    std::vector<Part> of_part_;
};

bool Closer::lies_on(const Pixels& pixels, const Surface& surface) const {
    const double limit = parameters_.tolerance * parameters_.tolerance;
    Checkpoints checkpoints;
    const auto near = std::count_if(pixels.begin(), pixels.end(), [&](int p) {
        checkpoints.pass();
        return image_.residual(p, surface) <= limit;
    });
    return static_cast<double>(near) >= parameters_.share * static_cast<double>(pixels.size());
}

void Closer::tidy() {
    parts_.absorb_slivers(parameters_.min_area);
    parts_.trim_spurs();
    parts_.absorb_slivers(parameters_.min_area);
    verify();
}

// What a pixel may lie off its surface follows from what most do.
void Closer::verify() {
    of_part_.assign(static_cast<std::size_t>(parts_.count()) + 1, {});
    std::vector<std::pair<double, std::size_t>> misfits;
    std::size_t total = 0;
    for (int i = 1; i <= parts_.count(); ++i) {
        const SurfaceSums sums = image_.sums_of(parts_.pixels(i));
        Surface& surface = of_part_[static_cast<std::size_t>(i)].surface;
        surface = image_.surface_of(sums);
        if (sums.count() < least_curved) continue;
        misfits.emplace_back(surface.rms, parts_.pixels(i).size());
        total += misfits.back().second;
    }
    std::sort(misfits.begin(), misfits.end());
    std::size_t sum = 0;
    for (const auto& [rms, count] : misfits)
        if (sum += count; 2 * sum >= total) {
            image_.set_correlation(std::clamp(rms, parameters_.correlation, correlation_max), 1);
            break;
        }
    for (int i = 1; i <= parts_.count(); ++i) {
        const Pixels& pixels = parts_.pixels(i);
        Part& p = of_part_[static_cast<std::size_t>(i)];
        p.verified = static_cast<int>(pixels.size()) >= parameters_.min_area && lies_on(pixels, p.surface);
    }
}

void Closer::align() {
    for (const OpenBorder& border : parts_.borders())
        if (part(border.first).verified && part(border.second).verified) align(border);
}

// Where one surface passes through the other, it is above on one side of the border and below on the other.
void Closer::align(const OpenBorder& border) {
    const Surface &a = part(border.first).surface, &b = part(border.second).surface;
    const auto above = [&](int p) {
        const Sample s = image_.sample(p);
        return a.value(s.x, s.y) > b.value(s.x, s.y);
    };
    const std::vector<std::pair<int, int>> near = parts_.near(border, reach);  // pixels and distances
    int sure[2] = {0, 0}, over[2] = {0, 0};
    for (const auto& [p, distance] : near) {
        if (distance <= surely_beside) continue;
        const int side = parts_.at(p) == border.second;
        ++sure[side], over[side] += above(p);
    }
    const auto share = [&](int side) { return sure[side] ? static_cast<double>(over[side]) / sure[side] : 0.5; };
    const bool first_above = share(0) > share(1);
    const double own[2] = {first_above ? share(0) : 1 - share(0), first_above ? 1 - share(1) : share(1)};
    if (!(std::min(own[0], own[1]) >= least_sided)) return;
    for (const auto& [p, distance] : near) parts_.set(p, above(p) == first_above ? border.first : border.second);
}

// Whether the smaller part lies on the surface of the larger one.
bool Closer::are_one(const OpenBorder& border) const {
    const bool first_larger = parts_.pixels(border.first).size() >= parts_.pixels(border.second).size();
    const int larger = first_larger ? border.first : border.second,
              smaller = first_larger ? border.second : border.first;
    return lies_on(parts_.pixels(smaller), part(larger).surface);
}

void Closer::draw(std::uint8_t* lines) {
    const auto put = [&](int p) {
        const int row = p / image_.stride() - 1, col = p % image_.stride() - 1;
        lines[std::ptrdiff_t{row} * image_.cols() + col] = 255;
    };
    for (const OpenBorder& border : parts_.borders()) {
        if (!part(border.first).verified || !part(border.second).verified || are_one(border)) continue;
        for (const Pixels& line : parts_.lines(border)) {
            int top = image_.rows(), bottom = 0, left = image_.cols(), right = 0;
            for (const int p : line) {
                const int row = p / image_.stride(), col = p % image_.stride();
                top = std::min(top, row), bottom = std::max(bottom, row);
                left = std::min(left, col), right = std::max(right, col);
            }
            if (std::max(bottom - top, right - left) >= parameters_.max_gap) continue;
            for (const int p : line) put(p);
        }
    }
}

}  // namespace

void close_contours(const RangeMap& map, const std::int32_t* regions, const ClosureParameters& parameters, int threads,
                    std::uint8_t* lines) {
    Team team(threads);
    Closer closer(map, regions, parameters, team);
    closer.close();
    std::fill_n(lines, std::ptrdiff_t{map.rows} * map.cols, std::uint8_t{0});
    closer.draw(lines);
}

}  // namespace rangeedge
