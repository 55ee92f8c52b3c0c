// SPDX-License-Identifier: Apache-2.0
#include "cleaning/holes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/array.hpp"

namespace rangeedge {
namespace {

constexpr int directions = 8, lines = 4;
constexpr std::array<int, directions> step_row{0, -1, -1, -1, 0, 1, 1, 1}, step_col{-1, -1, 0, 1, 1, 1, 0, -1};
constexpr int surrounding = 3;  // lines of which a surface has both ends that surrounds a pixel
constexpr double longest = 2;   // shortest lines, up to which a line tells what is around
constexpr double touching = 3;  // root mean squares, up to which surfaces are as near as each other

// A labelled pixel that a pixel of a hole sees, and the number of lines of which its surface has both ends.
struct Sight {
    std::int32_t pixel = -1, steps = 0, lines = 0;
};
using Star = std::array<Sight, directions>;

class Holes {
public:
    Holes(const OrdinateMap& map, const std::vector<Surface>& surfaces, const std::uint8_t* holes, const float* mixed,
          const std::int32_t* labels)
        : map_(map), surfaces_(surfaces), mixed_(mixed), labels_(labels), number_(map.size(), -1) {
        for (int p = 0; p < map.size(); ++p)
            if (holes[p] && labels[p] <= 0) {
                number_[p] = pixels_.count();
                pixels_.push_back(p);
            }
        stars_.resize(pixels_.size());
        for (int i = 0; i < pixels_.count(); ++i) look(i, 0, lines);
        for (int i = pixels_.count() - 1; i >= 0; --i) look(i, lines, directions);
    }

    int count() const { return pixels_.count(); }
    int pixel(int i) const { return pixels_[i]; }
    std::int32_t label_of(int i, double zero) const;

private:
    void look(int i, int from, int to);
    double value(std::int32_t label, int p) const {
        return surfaces_[static_cast<std::size_t>(label)].value(map_.x_of(p), map_.y_of(p));
    }
    double rms(std::int32_t label) const { return surfaces_[static_cast<std::size_t>(label)].rms; }
    bool wins(int p, const Sight& a, const Sight& b) const;
    bool plausible(int p, std::int32_t label, const Star& star, double zero) const;

    const OrdinateMap& map_;
    const std::vector<Surface>& surfaces_;
    const float* mixed_;
    const std::int32_t* labels_;
    Array<int> number_, pixels_;
    Array<Star> stars_;
};

// What pixel i sees in some directions; the pixel before it in each of these has been looked at.
void Holes::look(int i, int from, int to) {
    const int p = pixels_[i], row = p / map_.cols, col = p % map_.cols;
    for (int d = from; d < to; ++d) {
        const auto k = static_cast<std::size_t>(d);
        const int r = row + step_row[k], c = col + step_col[k];
        if (r < 0 || c < 0 || r >= map_.rows || c >= map_.cols) continue;
        const int q = r * map_.cols + c;
        Sight& sight = stars_[i][k];
        if (labels_[q] > 0)
            sight = {q, 1};
        else if (number_[q] >= 0 && stars_[number_[q]][k].pixel >= 0)
            sight = {stars_[number_[q]][k].pixel, stars_[number_[q]][k].steps + 1};
    }
}

// Whether pixel p belongs to the surface of a rather than to that of b.
bool Holes::wins(int p, const Sight& a, const Sight& b) const {
    const std::int32_t first = labels_[a.pixel], second = labels_[b.pixel];
    const auto above = [&](int q) { return value(first, q) - value(second, q); };
    const double at_a = above(a.pixel), at_b = above(b.pixel);
    const double near = touching * std::hypot(rms(first), rms(second));
    // The end farther from the line in which they meet tells the sides: the other one may lie on the wrong one.
    if (at_a * at_b <= 0 || std::min(std::abs(at_a), std::abs(at_b)) <= near)
        return (above(p) > 0) == (std::abs(at_a) > std::abs(at_b) ? at_a > 0 : at_b < 0);
    const auto measured = static_cast<double>(mixed_[p]);
    if (std::isfinite(measured)) return std::abs(value(first, p) - measured) < std::abs(value(second, p) - measured);
    return a.lines != b.lines ? a.lines > b.lines : at_a < 0;  // the farther one
}

bool Holes::plausible(int p, std::int32_t label, const Star& star, double zero) const {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const Sight& s : star)
        if (s.pixel >= 0) {
            const double seen = static_cast<double>(map_.ordinate[s.pixel]);
            low = std::min(low, seen), high = std::max(high, seen);
        }
    const double here = value(label, p);
    if (zero > -HUGE_VAL) return here > zero && here - zero > (low - zero) / 2 && here - zero < 2 * (high - zero);
    return std::isfinite(here);
}

std::int32_t Holes::label_of(int i, double zero) const {
    const Star& star = stars_[i];
    const int p = pixels_[i];
    double shortest = HUGE_VAL;  // of the lines that end on both sides
    int nearest = map_.rows + map_.cols;
    for (std::size_t k = 0; k < directions; ++k) {
        if (star[k].pixel < 0) continue;
        nearest = std::min(nearest, star[k].steps);
        if (k < lines && star[k + lines].pixel >= 0)
            shortest = std::min(shortest, static_cast<double>(star[k].steps + star[k + lines].steps));
    }
    const double reach = std::max(shortest, 3.0 * nearest);
    std::array<Sight, directions> around{};  // the nearest pixel of every surface
    std::size_t count = 0;
    for (std::size_t k = 0; k < directions; ++k) {
        if (star[k].pixel < 0 || star[k].steps > reach) continue;
        const std::int32_t label = labels_[star[k].pixel];
        int both = 0;
        for (std::size_t line = 0; line < lines; ++line)
            both += star[line].pixel >= 0 && star[line + lines].pixel >= 0 && labels_[star[line].pixel] == label &&
                    labels_[star[line + lines].pixel] == label &&
                    star[line].steps + star[line + lines].steps <= longest * shortest;
        if (both >= surrounding) return plausible(p, label, star, zero) ? label : 0;
        std::size_t known = 0;
        while (known < count && labels_[around[known].pixel] != label) ++known;
        if (known == count) around[count++] = star[k];
        if (star[k].steps < around[known].steps) around[known] = star[k];
        around[known].lines = both;
    }
    const Sight* best = nullptr;
    int most = -1;
    for (std::size_t a = 0; a < count; ++a) {
        if (!plausible(p, labels_[around[a].pixel], star, zero)) continue;
        int won = 0;
        for (std::size_t b = 0; b < count; ++b) won += a != b && wins(p, around[a], around[b]);
        if (won > most || (won == most && around[a].steps < best->steps)) best = &around[a], most = won;
    }
    return best ? labels_[best->pixel] : 0;
}

}  // namespace

void fill_holes(const OrdinateMap& map, const std::vector<Surface>& surfaces, const std::uint8_t* holes,
                const float* mixed, double zero, std::int32_t* labels) {
    const Holes found(map, surfaces, holes, mixed, labels);
    Array<std::int32_t> filled(found.count());
    for (int i = 0; i < found.count(); ++i) filled[i] = found.label_of(i, zero);
    for (int i = 0; i < found.count(); ++i) labels[found.pixel(i)] = filled[i];
}

}  // namespace rangeedge
