// SPDX-License-Identifier: Apache-2.0
#include "regions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <map>
#include <utility>
#include <vector>

#include "../components.hpp"

namespace rangeedge {
namespace {

constexpr double loose = 2.0;         // pixels at borders may lie farther off, by this factor
constexpr int levels = 32;            // of squared residuals in the queue, per tolerance
constexpr int max_cuts = 4;           // of one marker into planes
constexpr double kept_rms = 1.25;     // how much a common surface may raise the rms of either patch
constexpr double small_share = 0.2;   // a patch is small beside one so many times as large
constexpr double most = 0.6;          // of a border
constexpr double explained = 0.7;     // of the pixels of a small patch
constexpr double least_open = 0.2;    // of the border of one that is no surface of its own
constexpr double least_border = 0.5;  // in square roots of the smaller area
constexpr int reassignments = 3;
const double degree = std::acos(-1.0) / 180;

// Pixels by residual, the smallest first, first come first served among equals.
class ResidualQueue {
public:
    struct Entry {
        int pixel, patch;
    };

    void push(std::size_t level, Entry entry) {
        bucket_[level].push_back(entry);
        lowest_ = std::min(lowest_, level);
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

// A patch is a set of pixels with one surface; a region is one patch or several.
class Grower {
public:
    Grower(const RangeMap& map, const RegionParameters& parameters)
        : image_(map, lateral_deviation), parameters_(parameters), patch_(static_cast<std::size_t>(image_.size()), 0),
          free_(patch_.size(), taken) {
        for_pixels([&](int p) { assign(p, 0); });
        create(SurfaceSums(), Surface());
    }

    void sow(const std::int32_t* markers);
    void sow_rest();
    void grow();
    void merge();
    void settle();
    void dissolve();
    int finish(std::int32_t* labels);

private:
    // What may take a pixel: `reach` of a flood is the last of them that it fills.
    enum Free : std::uint8_t { taken, open_pixel, edge_pixel };

    struct Patch {
        SurfaceSums sums;
        Surface surface;
        int refit_at;
        int uncut;      // pixels it had when it was found to be no roof
        int same;       // the patch that has taken this one in, or itself
        int region;     // a patch of the same region, or itself
        bool absorbed;  // joined a much larger one, and joins no other
        int count() const { return sums.count(); }
    };
    struct Border {
        int pixels = 0;
        int open = 0;     // without an edge
        int smooth = 0;   // of the open ones, where both surfaces agree
        int similar = 0;  // of the open ones, where they agree roughly
    };
    using Borders = std::map<std::pair<int, int>, Border>;

    int patch(int p) const { return patch_[static_cast<std::size_t>(p)]; }
    void assign(int p, int i) {
        patch_[static_cast<std::size_t>(p)] = i;
        free_[static_cast<std::size_t>(p)] =
            i || !image_.valid(p) ? taken : image_.open(p) ? open_pixel : edge_pixel;
    }
    bool is_free(int p, Free reach) const {
        const std::uint8_t state = free_[static_cast<std::size_t>(p)];
        return state != taken && state <= reach;
    }
    Patch& of(int i) { return patches_[static_cast<std::size_t>(i)]; }
    int owner(int p) {
        int i = patch(p);
        while (of(i).same != i) i = of(i).same;
        return i;
    }
    int region(int i) {
        while (of(i).region != i) i = of(i).region;
        return i;
    }
    bool is_small(int i, int beside) { return of(i).count() < small_share * of(beside).count(); }

    template <class F>
    void for_pixels(F&& visit) const {
        for (int row = 0; row < image_.rows(); ++row)
            for (int p = image_.index(row, 0), end = p + image_.cols(); p < end; ++p) visit(p);
    }

    // Free pixels, in raster order; most images have few.
    template <class F>
    void for_free(Free reach, F&& visit) const {
        for (std::size_t p = 0, end = free_.size(); p < end;) {
            std::uint64_t eight = 1;
            if (p + 8 <= end) std::memcpy(&eight, &free_[p], 8);
            const std::size_t stop = eight ? std::min(p + 8, end) : p;
            for (std::size_t q = p; q < stop; ++q)
                if (is_free(static_cast<int>(q), reach)) visit(static_cast<int>(q));
            p += 8;
        }
    }

    static int later(int count) { return count + count / 3 + 16; }
    int create(const SurfaceSums& sums, const Surface& surface);
    void add_patches(const Pixels& pixels, int cuts);
    void cut_roofs();
    void offer(int p, int i, double limit);
    void flood(double tolerance, Free reach);
    void refit();
    void reassign();
    std::vector<std::pair<int, int>> contacts();
    Borders borders(const std::vector<std::pair<int, int>>& contacts);
    bool one_surface(const Patch& a, const Patch& b) const;
    bool belongs(int small, int large, const Border& border);
    std::vector<int> regions();
    Components components();

    SurfaceImage image_;
    RegionParameters parameters_;
    std::vector<int> patch_;          // of every pixel, 0: none
    std::vector<std::uint8_t> free_;  // of every pixel
    ResidualQueue queue_;
    std::vector<Patch> patches_;
};

int Grower::create(const SurfaceSums& sums, const Surface& surface) {
    const int i = static_cast<int>(patches_.size());
    patches_.push_back({sums, surface, later(sums.count()), 0, i, i, false});
    return i;
}

void Grower::add_patches(const Pixels& pixels, int cuts) {
    if (pixels.size() < least_pixels) return;
    const SurfaceSums sums = image_.sums_of(pixels);
    const Surface surface = image_.surface_of(sums);
    Pixels first, second;
    if (cuts < max_cuts && !image_.is_flat(surface) && image_.split_roof(pixels, sums.quadratic(), first, second)) {
        add_patches(first, cuts + 1);
        add_patches(second, cuts + 1);
        return;
    }
    const int i = create(sums, surface);
    for (const int p : pixels) assign(p, i);
}

void Grower::sow(const std::int32_t* markers) {
    std::map<std::int32_t, Pixels> seeds;
    std::pair<std::int32_t, Pixels*> last{0, nullptr};
    for (int row = 0; row < image_.rows(); ++row)
        for (int col = 0; col < image_.cols(); ++col) {
            const std::int32_t marker = markers[row * image_.cols() + col];
            if (marker <= 0 || !image_.open(image_.index(row, col))) continue;
            if (marker != last.first) last = {marker, &seeds[marker]};
            last.second->push_back(image_.index(row, col));
        }
    std::vector<Pixels> sets;
    for (auto& seed : seeds) sets.push_back(std::move(seed.second));
    image_.estimate_correlation(sets);
    for (const Pixels& pixels : sets) add_patches(pixels, 0);
}

// Components of what is free and open with all its neighbours.
void Grower::sow_rest() {
    std::vector<std::uint8_t> inside(free_.size(), 0);
    const int stride = image_.stride();
    const auto in_row = [&](int p) {
        return is_free(p - 1, open_pixel) && is_free(p, open_pixel) && is_free(p + 1, open_pixel);
    };
    bool any = false;
    for_free(open_pixel, [&](int p) {
        const bool found = in_row(p) && in_row(p - stride) && in_row(p + stride);
        inside[static_cast<std::size_t>(p)] = found;
        any |= found;
    });
    if (!any) return;
    const Components parts(inside.data(), image_.rows(), image_.cols());
    Pixels pixels;
    for (int i = 0; i < parts.count(); ++i) {
        pixels.clear();
        for (const auto [begin, end] : parts.runs(i))
            for (int p = begin; p < end; ++p) pixels.push_back(p);
        add_patches(pixels, 0);
    }
}

void Grower::offer(int p, int i, double limit) {
    const double r = image_.residual(p, of(i).surface);
    if (r < limit) queue_.push(static_cast<std::size_t>(r / limit * levels), {p, i});
}

// All patches grow at once, the best fitting pixel first; surfaces follow their pixels, but not into edges.
void Grower::flood(double tolerance, Free reach) {
    const double limit = tolerance * tolerance;
    const auto neighbours = image_.neighbours();
    for_free(reach, [&](int p) {
        for (const int step : neighbours)
            if (patch(p + step)) offer(p, patch(p + step), limit);
    });
    ResidualQueue::Entry entry{};
    while (queue_.pop(entry)) {
        const auto [p, i] = entry;
        if (!is_free(p, reach)) continue;
        if (reach == open_pixel) {
            Patch& grown = of(i);
            if (image_.residual(p, grown.surface) >= limit) continue;
            grown.sums.add(image_.sample(p));
            if (grown.count() >= grown.refit_at) {
                grown.surface = image_.surface_of(grown.sums);
                grown.refit_at = later(grown.count());
            }
        }
        patch_[static_cast<std::size_t>(p)] = i;
        free_[static_cast<std::size_t>(p)] = taken;
        for (const int step : neighbours)
            if (is_free(p + step, reach)) offer(p + step, i, limit);
    }
}

void Grower::refit() {
    for (Patch& p : patches_)
        if (p.count()) p.surface = image_.surface_of(p.sums);
}

// Patches that have grown around a crease are two planes.
void Grower::cut_roofs() {
    const auto may_be = [&](const Patch& p) {
        return p.surface.curved && p.count() >= static_cast<int>(least_curved) && p.count() != p.uncut;
    };
    if (std::none_of(patches_.begin(), patches_.end(), may_be)) return;
    std::vector<Pixels> pixels(patches_.size());
    for_pixels([&](int p) {
        if (patch(p) && may_be(of(patch(p)))) pixels[static_cast<std::size_t>(patch(p))].push_back(p);
    });
    Pixels first, second;
    for (std::size_t i = 1; i < pixels.size(); ++i) {
        if (pixels[i].empty()) continue;
        patches_[i].uncut = patches_[i].count();
        if (!image_.split_roof(pixels[i], patches_[i].sums.quadratic(), first, second)) continue;
        for (const int p : pixels[i]) assign(p, 0);
        patches_[i].sums = SurfaceSums();
        add_patches(first, 1);
        add_patches(second, 1);
    }
}

void Grower::grow() {
    flood(parameters_.tolerance, open_pixel);
    refit();
    cut_roofs();
    flood(parameters_.tolerance, open_pixel);
    refit();
}

// Neighbouring pixels of different regions.
std::vector<std::pair<int, int>> Grower::contacts() {
    std::vector<std::pair<int, int>> found;
    for_pixels([&](int p) {
        if (!patch(p)) return;
        for (const int q : {p + 1, p + image_.stride()})
            if (patch(q) && patch(q) != patch(p) && region(owner(p)) != region(owner(q))) found.emplace_back(p, q);
    });
    return found;
}

Grower::Borders Grower::borders(const std::vector<std::pair<int, int>>& contacts) {
    Borders found;
    const double fine = std::cos(parameters_.smooth_angle * degree);
    const double rough = std::cos(3 * parameters_.smooth_angle * degree);
    for (const auto& [p, q] : contacts) {
        const int a = owner(p), b = owner(q);
        if (region(a) == region(b)) continue;
        Border& border = found[std::minmax(a, b)];
        ++border.pixels;
        if (image_.beside_edge(p) || image_.beside_edge(q)) continue;
        ++border.open;
        const Surface &sa = of(a).surface, &sb = of(b).surface;
        border.smooth += image_.agree(p, q, sa, sb, 1.5 * parameters_.tolerance, sa.curved || sb.curved ? rough : fine);
        border.similar += image_.agree(p, q, sa, sb, 3 * parameters_.tolerance, rough);
    }
    return found;
}

// Whether a plane, or a quadratic where one of them is curved, describes both patches as well as their own surfaces do.
bool Grower::one_surface(const Patch& a, const Patch& b) const {
    const SurfaceSums joint = a.sums.joined(b.sums);
    const Surface s = a.surface.curved || b.surface.curved ? joint.quadratic() : joint.plane();
    const auto kept = [&](const Patch& p) {
        return p.sums.rms(s) <= kept_rms * std::max(p.surface.rms, image_.correlation());
    };
    return kept(a) && kept(b);
}

// Whether a patch goes on into another without an edge.
bool Grower::belongs(int small, int large, const Border& border) {
    if (border.pixels < least_border * std::sqrt(of(small).count())) return false;
    return (is_small(small, large) ? border.similar : border.smooth) > most * border.pixels;
}

// The longest borders first. What is small beside its neighbour joins one region, and never links two.
void Grower::merge() {
    const auto touching = contacts();
    for (bool changed = true; changed;) {
        changed = false;
        const Borders found = borders(touching);
        std::vector<std::pair<int, std::pair<int, int>>> order;
        for (const auto& [pair, border] : found) order.push_back({-border.pixels, pair});
        std::sort(order.begin(), order.end());
        std::vector<char> touched(patches_.size(), 0);
        for (const auto& [negative, pair] : order) {
            const Border& border = found.at(pair);
            auto [a, b] = pair;
            if (of(a).count() < of(b).count()) std::swap(a, b);
            char &touched_a = touched[static_cast<std::size_t>(a)], &touched_b = touched[static_cast<std::size_t>(b)];
            if (touched_a || touched_b || of(a).absorbed || of(b).absorbed || region(a) == region(b)) continue;
            if (one_surface(of(a), of(b))) {
                of(a).sums = of(a).sums.joined(of(b).sums);
                of(a).surface = image_.surface_of(of(a).sums);
                of(b).same = a;
                touched_a = touched_b = 1;
            } else if (belongs(b, a, border)) {
                of(b).absorbed = is_small(b, a);
            } else {
                continue;
            }
            of(region(b)).region = region(a);
            changed = true;
        }
    }
}

// Border pixels go to the neighbouring surface they lie on, a few steps far.
void Grower::reassign() {
    const auto neighbours = image_.neighbours();
    Pixels pixels;  // that may move
    for_pixels([&](int p) {
        const int own = patch(p);
        if (!own) return;
        for (const int step : neighbours)
            if (patch(p + step) && patch(p + step) != own) return pixels.push_back(p);
    });
    std::vector<std::pair<int, int>> moves;
    for (int round = 0; round < reassignments; ++round) {
        moves.clear();
        for (const int p : pixels) {
            const int own = patch(p);
            if (!own) continue;
            int best = own;
            double least = -1;
            for (const int step : neighbours) {
                const int other = patch(p + step);
                if (!other || other == best || other == own) continue;
                if (least < 0) least = image_.residual(p, of(own).surface);
                const double r = image_.residual(p, of(other).surface);
                if (r < least) least = r, best = other;
            }
            if (best != own) moves.emplace_back(p, best);
        }
        pixels.clear();
        for (const auto& [p, i] : moves) {
            assign(p, i);
            pixels.push_back(p);
            for (const int step : neighbours) pixels.push_back(p + step);
        }
    }
}

// Edge pixels and what else was left go to the surface they fit best.
void Grower::settle() {
    for (int& i : patch_)
        while (of(i).same != i) i = of(i).same;
    flood(loose * parameters_.tolerance, edge_pixel);
    reassign();
}

// Strips along rounded edges are no surfaces: small patches, open to their neighbours, whose pixels those explain.
void Grower::dissolve() {
    std::vector<Pixels> around(patches_.size()), pixels(patches_.size());
    std::vector<Border> total(patches_.size());
    for (const auto& [pair, border] : borders(contacts()))
        for (const auto& [i, j] : {pair, std::make_pair(pair.second, pair.first)}) {
            around[static_cast<std::size_t>(i)].push_back(j);
            total[static_cast<std::size_t>(i)].pixels += border.pixels;
            total[static_cast<std::size_t>(i)].open += border.open;
        }
    const auto is_strip = [&](int i) {
        const Border& border = total[static_cast<std::size_t>(i)];
        const Pixels& others = around[static_cast<std::size_t>(i)];
        return border.open > least_open * border.pixels && region(i) == i &&
               std::any_of(others.begin(), others.end(), [&](int j) { return is_small(i, j); });
    };
    std::vector<char> strip(patches_.size(), 0);
    for (std::size_t i = 1; i < strip.size(); ++i) strip[i] = is_strip(static_cast<int>(i));
    for_pixels([&](int p) {
        if (!patch(p)) return;
        const auto own = static_cast<std::size_t>(owner(p));
        if (strip[own]) pixels[own].push_back(p);
    });
    Pixels best;
    for (std::size_t i = 1; i < pixels.size(); ++i) {
        const Pixels& own = pixels[i];
        best.assign(own.size(), static_cast<int>(i));
        int fitting = 0;
        for (std::size_t k = 0; k < own.size(); ++k) {
            double least = HUGE_VAL;
            for (const int j : around[i]) {
                const double r = image_.residual(own[k], of(j).surface);
                if (r < least) least = r, best[k] = j;
            }
            fitting += std::sqrt(least) < loose * parameters_.tolerance;
        }
        if (fitting < explained * static_cast<double>(own.size())) continue;
        for (std::size_t k = 0; k < own.size(); ++k) assign(own[k], best[k]);
    }
}

// Of every patch the one that stands for its region.
std::vector<int> Grower::regions() {
    std::vector<int> found(patches_.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        int k = static_cast<int>(i);
        while (of(k).same != k) k = of(k).same;
        found[i] = region(k);
    }
    return found;
}

// Connected parts of regions.
Components Grower::components() {
    const std::vector<int> region_of = regions();
    std::vector<int> image(patch_.size());
    std::transform(patch_.begin(), patch_.end(), image.begin(),
                   [&](int i) { return region_of[static_cast<std::size_t>(i)]; });
    return Components(image.data(), image_.rows(), image_.cols());
}

int Grower::finish(std::int32_t* labels) {
    const Components parts = components();
    for (int i = 0; i < parts.count(); ++i)
        if (parts.area(i) < parameters_.min_area)
            for (const auto [begin, end] : parts.runs(i))
                for (int p = begin; p < end; ++p) assign(p, 0);
    flood(2 * loose * parameters_.tolerance, edge_pixel);
    std::fill(labels, labels + image_.rows() * image_.cols(), 0);
    const Components whole = components();
    for (int i = 0; i < whole.count(); ++i)
        for (const auto [begin, end] : whole.runs(i)) {
            const int row = begin / image_.stride() - 1, col = begin % image_.stride() - 1;
            std::fill_n(labels + row * image_.cols() + col, end - begin, i + 1);
        }
    return whole.count();
}

}  // namespace

int grow_regions(const RangeMap& map, const std::int32_t* markers, const RegionParameters& parameters,
                 std::int32_t* labels) {
    Grower grower(map, parameters);
    grower.sow(markers);
    grower.grow();
    for (int round = 0; parameters.new_seeds && round < 2; ++round) {
        grower.sow_rest();
        grower.grow();
    }
    grower.merge();
    grower.settle();
    grower.merge();
    grower.dissolve();
    return grower.finish(labels);
}

}  // namespace rangeedge
