// SPDX-License-Identifier: Apache-2.0
#include "regions/merging.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "base/parallel.hpp"

namespace rangeedge {
namespace {

constexpr double kept_rms = 1.25;        // how much a common surface may raise the rms of either patch
constexpr double small_share = 0.2;      // a patch is small beside one so many times as large
constexpr double most_of_border = 0.6;   // share of its pixels
constexpr double least_border = 0.6;     // in widths of the smaller patch
constexpr double longest_bend = 1.3;     // border of a bend, in roots of its area
constexpr double least_strip = 16;       // widths around a strip, as around 6 squares in a row
constexpr double longest_end = 2.5;      // border of two strips end to end, in widths
constexpr int most_rounds = 12;          // of merging
constexpr double strip_openness = 0.2;   // share of the border of a strip that is no edge
constexpr double strip_explained = 0.7;  // share of its pixels that lie on neighbouring surfaces
constexpr double strip_tolerance = 2;    // of these, in tolerances of a pixel

bool is_small(const Patch& a, const Patch& beside) { return a.count() < small_share * beside.count(); }

// Whether a plane, or a quadratic where one of them is curved, describes both patches as well as their own surfaces do.
bool one_surface(const SurfaceImage& image, const Patch& a, const Patch& b) {
    const SurfaceSums joint = a.sums.joined(b.sums);
    const Surface s = a.surface.curved || b.surface.curved ? joint.quadratic() : joint.plane();
    const auto kept = [&](const Patch& p) {
        return p.sums.rms(s) <= kept_rms * std::max(p.surface.rms, image.correlation());
    };
    return kept(a) && kept(b);
}

// Whether a patch lies across the way to another like the bend of a strip, and not along a border like a rounded edge.
bool is_bend(const Patch& patch, const Border& border) {
    return border.similar > most_of_border * border.pixels &&
           border.pixels < longest_bend * std::sqrt(static_cast<double>(patch.count()));
}

double width_of(const Patch& patch, int perimeter) { return 2.0 * patch.count() / std::max(perimeter, 1); }

// Whether two strips meet end to end, with nothing between them: one that turns a corner, where it is too narrow for a
// surface of its own.
bool meet_end_to_end(const Patch& a, int around_a, const Patch& b, int around_b, const Border& border) {
    const auto ends_at = [&](const Patch& patch, int around) {
        const double width = width_of(patch, around);
        return width * width < least_curved && around > least_strip * width && border.pixels < longest_end * width &&
               border.pixels > least_border * width;
    };
    return border.joined > most_of_border * border.pixels && ends_at(a, around_a) && ends_at(b, around_b);
}

// Whether the smaller of two patches goes on into the larger: for most of a border that is not much shorter than the
// smaller one is wide.
bool continues(const Patch& small, const Patch& large, const Border& border, int perimeter) {
    if (border.pixels < least_border * width_of(small, perimeter)) return false;
    return (is_small(small, large) ? border.similar : border.smooth) > most_of_border * border.pixels;
}

}  // namespace

// The longest borders first. What is small beside its neighbour joins one region, and never links two.
void merge(PatchMap& patches, Adjacency& adjacency) {
    bool changed = true;
    for (int round = 0; changed && round < most_rounds; ++round) {
        changed = false;
        Array<char> refitted(patches.count(), 0);
        Checkpoints checkpoints(256);
        for (const auto& found : adjacency.update()) {
            checkpoints.pass();
            int a = patches.surface(found.a), b = patches.surface(found.b);
            if (patches.patch(a).count() < patches.patch(b).count()) std::swap(a, b);
            const Patch& large = patches.patch(a);
            Patch& small = patches.patch(b);
            if (large.absorbed || small.absorbed || patches.region(a) == patches.region(b)) continue;
            if (one_surface(patches.image(), large, small)) {
                patches.join_regions(a, b);
                patches.join_surfaces(a, b);
                refitted[a] = refitted[b] = 1;
                adjacency.has_changed(a), adjacency.has_changed(b);
            } else if (!refitted[a] && !refitted[b] &&
                       (continues(small, large, found.border, adjacency.perimeter(b)) ||
                        meet_end_to_end(large, adjacency.perimeter(a), small, adjacency.perimeter(b), found.border))) {
                small.absorbed = is_small(small, large) && !is_bend(small, found.border);
                patches.join_regions(a, b);
            } else {
                continue;
            }
            changed = true;
        }
    }
}

void absorb_strips(PatchMap& patches, Adjacency& adjacency) {
    const SurfaceImage& image = patches.image();
    const int count = patches.count();
    Array<std::vector<int>> around(count);
    Array<Border> total(count);
    for (const auto& [a, b, border] : adjacency.update())
        for (const auto& [i, j] : {std::make_pair(a, b), std::make_pair(b, a)}) {
            around[i].push_back(j);
            total[i].pixels += border.pixels;
            total[i].open += border.open;
        }
    Array<int> number(count, 0);  // of strips, from 1
    std::vector<int> strips;
    for (int i = 1; i < patches.count(); ++i) {
        const bool strip = total[i].open > strip_openness * total[i].pixels && patches.region(i) == i &&
                           std::any_of(around[i].begin(), around[i].end(),
                                       [&](int j) { return is_small(patches.patch(i), patches.patch(j)); });
        if (!strip) continue;
        strips.push_back(i);
        number[i] = static_cast<int>(strips.size());
    }
    if (strips.empty()) return;
    std::vector<Pixels> best(strips.size());
    Array<int> strip_of(count, 0);
    for (int i = 1; i < patches.count(); ++i) strip_of[i] = number[patches.surface(i)];
    const std::vector<Pixels> pixels = patches.pixels_of(strip_of, static_cast<int>(strips.size()));
    parallel_each(static_cast<int>(strips.size()), patches.team(), [&](int strip, int) {
        const auto k = static_cast<std::size_t>(strip);
        int fitting = 0;
        best[k].assign(pixels[k].size(), strips[k]);
        for (std::size_t n = 0; n < pixels[k].size(); ++n) {
            double least = HUGE_VAL;
            for (const int j : around[strips[k]]) {
                const double r = image.residual(pixels[k][n], patches.patch(j).surface);
                if (r < least) least = r, best[k][n] = j;
            }
            fitting += std::sqrt(least) < strip_tolerance * adjacency.tolerance().deviations;
        }
        if (fitting < strip_explained * static_cast<double>(pixels[k].size())) best[k].clear();
    });
    for (std::size_t k = 0; k < strips.size(); ++k)
        for (std::size_t n = 0; n < best[k].size(); ++n) patches.take(pixels[k][n], best[k][n]);
}

}  // namespace rangeedge
