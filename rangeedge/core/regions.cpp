// SPDX-License-Identifier: Apache-2.0
#include "regions.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>
#include <utility>

namespace rangeedge {
namespace {

using Pixels = std::vector<int>;

constexpr int least_pixels = 12;         // of a surface
constexpr int least_curved = 40;         // of a quadratic
constexpr double flat = 1.25;            // rms in standard deviations up to which a plane is one
constexpr double curved_gain = 0.8;      // a quadratic must lower the rms to this share
constexpr double misfit = 1.6;           // rms from which a surface does not describe its pixels
constexpr double roof_gain = 0.85;       // two planes must lower the rms of the quadratic to this share
constexpr double correlation_max = 4.0;  // noise over a region, in units of that between pixels
constexpr double loose = 2.0;            // pixels at borders may lie farther off, by this factor
constexpr int levels = 32;               // of residuals in the queue, per tolerance

struct Patch {
    SurfaceSums sums;
    Surface surface;
    int refit_at = 0;
};

// Pixels by residual, the smallest first, first come first served among equals.
class ResidualQueue {
public:
    struct Entry {
        int pixel, patch;
    };

    explicit ResidualQueue(int size) : bucket_(static_cast<std::size_t>(size)), head_(static_cast<std::size_t>(size), 0) {}

    void push(std::size_t level, Entry entry) {
        bucket_[level].push_back(entry);
        lowest_ = std::min(lowest_, level);
    }
    bool pop(Entry& entry) {
        for (; lowest_ < bucket_.size(); ++lowest_) {
            auto& bucket = bucket_[lowest_];
            auto& head = head_[lowest_];
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
    std::vector<std::vector<Entry>> bucket_;
    std::vector<std::size_t> head_;
    std::size_t lowest_ = 0;
};

class Grower {
public:
    Grower(const RegionImage& image, const RegionParameters& parameters)
        : image_(image), parameters_(parameters), size_(image.rows * image.cols),
          patch_(static_cast<std::size_t>(size_), 0), patches_(1), region_(1, 0) {}

    void sow(const std::int32_t* markers);
    void grow();
    void sow_rest();
    void merge();
    void settle();
    void dissolve();
    int finish(std::int32_t* labels);

private:
    struct Border {
        int pixels = 0;
        int open = 0;    // without an edge
        int smooth = 0;  // of these, where both surfaces agree
        int similar = 0; // of the open ones, where they agree roughly
    };

    int& patch(int p) { return patch_[static_cast<std::size_t>(p)]; }
    Patch& of(int i) { return patches_[static_cast<std::size_t>(i)]; }
    bool valid(int p) const { return std::isfinite(image_.ordinate[p]); }
    bool open(int p) const { return valid(p) && !(image_.edges && image_.edges[p]); }

    Sample sample(int p) const {
        const double s = static_cast<double>(image_.sigma[p]);
        return {static_cast<double>(image_.x[p]), static_cast<double>(image_.y[p]),
                static_cast<double>(image_.ordinate[p]), 1 / (s * s)};
    }

    // Distance of a pixel from a surface in standard deviations: of the noise over regions, and of its place.
    double residual(int p, const Surface& s) const {
        const double x = static_cast<double>(image_.x[p]), y = static_cast<double>(image_.y[p]);
        const double dx = s.slope_x(x, y), dy = s.slope_y(x, y), sigma = correlation_ * static_cast<double>(image_.sigma[p]);
        const double variance = sigma * sigma + parameters_.lateral * parameters_.lateral * (dx * dx + dy * dy);
        return std::abs(static_cast<double>(image_.ordinate[p]) - s.value(x, y)) / std::sqrt(variance);
    }

    // The four neighbours of a pixel that lie in the image.
    template <class F>
    void for_neighbours(int p, F&& visit) const {
        const int col = p % image_.cols;
        if (p >= image_.cols) visit(p - image_.cols);
        if (col > 0) visit(p - 1);
        if (col + 1 < image_.cols) visit(p + 1);
        if (p + image_.cols < size_) visit(p + image_.cols);
    }

    SurfaceSums sums_of(const Pixels& pixels) const;
    Surface surface_of(const SurfaceSums& sums) const;
    bool split_roof(const Pixels& pixels, const Surface& curved, Pixels& first, Pixels& second) const;
    void add_patch(const Pixels& pixels, int depth);
    void estimate_correlation(const std::vector<Pixels>& seeds);
    void push_neighbours(ResidualQueue& queue, int p, double tolerance, bool edges_too);
    void flood(double tolerance, bool edges_too);
    void refit();
    void reassign();
    std::map<std::pair<int, int>, Border> borders();
    std::array<double, 3> normal(const Surface& s, double x, double y) const;
    bool meets_smoothly(int p, int q, const Surface& a, const Surface& b, double tolerance, double angle) const;
    bool beside_edge(int p) const;
    void verify();
    void renumber(int from, int to);
    bool one_surface(int a, int b) const;
    int root(int i) {
        while (region_[static_cast<std::size_t>(i)] != i) i = region_[static_cast<std::size_t>(i)];
        return i;
    }

    RegionImage image_;
    RegionParameters parameters_;
    int size_;
    double correlation_ = 1;
    std::vector<int> patch_;       // of every pixel, 0: none
    std::vector<Patch> patches_;   // the first is none
    std::vector<int> region_;      // forest of patches
    std::vector<char> absorbed_;   // patches that have joined a much larger one
};

SurfaceSums Grower::sums_of(const Pixels& pixels) const {
    double x = 0, y = 0, f = 0;
    for (const int p : pixels) {
        const Sample s = sample(p);
        x += s.x, y += s.y, f += s.ordinate;
    }
    const double n = static_cast<double>(std::max<std::size_t>(pixels.size(), 1));
    SurfaceSums sums(x / n, y / n, f / n);
    for (const int p : pixels) sums.add(sample(p));
    return sums;
}

// A plane unless a quadratic is much better.
Surface Grower::surface_of(const SurfaceSums& sums) const {
    const Surface plane = sums.plane();
    if (plane.rms <= flat * correlation_ || sums.count() < least_curved) return plane;
    const Surface curved = sums.quadratic();
    return curved.rms < curved_gain * plane.rms ? curved : plane;
}

// Two planes that meet in a crease describe some sets of pixels better than a quadratic; such a set is cut in two.
bool Grower::split_roof(const Pixels& pixels, const Surface& curved, Pixels& first, Pixels& second) const {
    const double xx = curved.c[3], xy = curved.c[4] / 2, yy = curved.c[5];
    const double angle = 0.5 * std::atan2(2 * xy, xx - yy), root = std::hypot((xx - yy) / 2, xy);
    const bool convex = std::abs((xx + yy) / 2 - root) > std::abs((xx + yy) / 2 + root);
    const double across = convex ? angle + std::acos(-1.0) / 2 : angle;
    const double cx = std::cos(across), cy = std::sin(across);
    first.clear(), second.clear();
    for (const int p : pixels) {
        const Sample s = sample(p);
        ((s.x - curved.x0) * cx + (s.y - curved.y0) * cy < 0 ? first : second).push_back(p);
    }
    double rms = 0;
    for (int round = 0; round < 8; ++round) {
        if (first.size() < least_pixels || second.size() < least_pixels) return false;
        const Surface a = sums_of(first).plane(), b = sums_of(second).plane();
        first.clear(), second.clear();
        rms = 0;
        for (const int p : pixels) {
            const Sample s = sample(p);
            const double fa = a.value(s.x, s.y), fb = b.value(s.x, s.y);
            const bool in_first = convex ? fa <= fb : fa >= fb;
            const double r = s.ordinate - (in_first ? fa : fb);
            rms += s.weight * r * r;
            (in_first ? first : second).push_back(p);
        }
    }
    rms = std::sqrt(rms / static_cast<double>(pixels.size()));
    return first.size() >= least_pixels && second.size() >= least_pixels && rms < roof_gain * curved.rms;
}

void Grower::add_patch(const Pixels& pixels, int depth) {
    if (pixels.size() < least_pixels) return;
    const SurfaceSums sums = sums_of(pixels);
    const Surface surface = surface_of(sums);
    Pixels first, second;
    if (depth < 4 && surface.rms > flat * correlation_ && split_roof(pixels, sums.quadratic(), first, second)) {
        add_patch(first, depth + 1);
        add_patch(second, depth + 1);
        return;
    }
    const int i = static_cast<int>(patches_.size());
    patches_.push_back({sums, surface, sums.count() + sums.count() / 3 + 16});
    region_.push_back(i);
    for (const int p : pixels) patch(p) = i;
}

// Noise correlated over several pixels moves surfaces more than its deviation between neighbours tells: the typical
// misfit of a quadratic to a seed does.
void Grower::estimate_correlation(const std::vector<Pixels>& seeds) {
    std::vector<std::pair<double, double>> misfits;
    double total = 0;
    for (const Pixels& pixels : seeds) {
        if (pixels.size() < least_curved) continue;
        misfits.emplace_back(sums_of(pixels).quadratic().rms, static_cast<double>(pixels.size()));
        total += misfits.back().second;
    }
    std::sort(misfits.begin(), misfits.end());
    double sum = 0;
    for (const auto& [rms, weight] : misfits) {
        sum += weight;
        if (2 * sum < total) continue;
        correlation_ = std::clamp(rms, 1.0, correlation_max);
        return;
    }
}

void Grower::sow(const std::int32_t* markers) {
    std::map<std::int32_t, Pixels> seeds;
    std::int32_t last = 0;
    Pixels* current = nullptr;
    for (int p = 0; p < size_; ++p) {
        if (markers[p] <= 0 || !open(p)) continue;
        if (markers[p] != last || !current) current = &seeds[last = markers[p]];
        current->push_back(p);
    }
    std::vector<Pixels> pixels;
    for (auto& seed : seeds) pixels.push_back(std::move(seed.second));
    estimate_correlation(pixels);
    for (const Pixels& seed : pixels) add_patch(seed, 0);
}

void Grower::push_neighbours(ResidualQueue& queue, int p, double tolerance, bool edges_too) {
    const int i = patch(p);
    for_neighbours(p, [&](int q) {
        if (patch(q) || !(edges_too ? valid(q) : open(q))) return;
        const double r = residual(q, of(i).surface);
        if (r < tolerance) queue.push(static_cast<std::size_t>(r / tolerance * levels), {q, i});
    });
}

// All patches grow at once, the best fitting pixel first; surfaces follow their pixels.
void Grower::flood(double tolerance, bool edges_too) {
    ResidualQueue queue(levels);
    for (int p = 0; p < size_; ++p)
        if (patch(p)) push_neighbours(queue, p, tolerance, edges_too);
    ResidualQueue::Entry entry{};
    while (queue.pop(entry)) {
        const int p = entry.pixel;
        if (patch(p)) continue;
        Patch& grown = of(entry.patch);
        if (residual(p, grown.surface) >= tolerance) continue;
        patch(p) = entry.patch;
        if (!edges_too) {
            grown.sums.add(sample(p));
            if (grown.sums.count() >= grown.refit_at) {
                grown.surface = surface_of(grown.sums);
                grown.refit_at = grown.sums.count() + grown.sums.count() / 3 + 16;
            }
        }
        push_neighbours(queue, p, tolerance, edges_too);
    }
}

void Grower::refit() {
    for (Patch& p : patches_)
        if (p.sums.count()) p.surface = surface_of(p.sums);
}

void Grower::grow() {
    flood(parameters_.tolerance, false);
    refit();
    verify();
    flood(parameters_.tolerance, false);
    refit();
}

// Where all eight neighbours are open and free as well.
void Grower::sow_rest() {
    const int cols = image_.cols;
    std::vector<char> free(static_cast<std::size_t>(size_), 0);
    const auto is_free = [&](int p) { return open(p) && !patch(p); };
    for (int row = 1; row + 1 < image_.rows; ++row)
        for (int col = 1; col + 1 < cols; ++col) {
            const int p = row * cols + col;
            bool all = true;
            for (int dy = -1; dy <= 1 && all; ++dy)
                for (int dx = -1; dx <= 1 && all; ++dx) all = is_free(p + dy * cols + dx);
            free[static_cast<std::size_t>(p)] = all;
        }
    Pixels pixels;
    for (int start = 0; start < size_; ++start) {
        if (!free[static_cast<std::size_t>(start)]) continue;
        pixels.assign(1, start);
        free[static_cast<std::size_t>(start)] = 0;
        for (std::size_t k = 0; k < pixels.size(); ++k)
            for_neighbours(pixels[k], [&](int q) {
                if (!free[static_cast<std::size_t>(q)]) return;
                free[static_cast<std::size_t>(q)] = 0;
                pixels.push_back(q);
            });
        if (static_cast<int>(pixels.size()) >= least_pixels) add_patch(pixels, 0);
    }
}

std::array<double, 3> Grower::normal(const Surface& s, double x, double y) const {
    const auto& m = image_.to_plane;
    const double det = m[0] * m[4] - m[1] * m[3];
    const double fx = image_.unit * s.slope_x(x, y), fy = image_.unit * s.slope_y(x, y);
    const double a = (m[4] * fx - m[3] * fy) / det, b = (m[0] * fy - m[1] * fx) / det;
    double c = -1;
    if (image_.projective) {
        const double px = m[0] * x + m[1] * y + m[2], py = m[3] * x + m[4] * y + m[5];
        c = image_.offset + image_.unit * s.value(x, y) - px * a - py * b;
    }
    const double length = std::sqrt(a * a + b * b + c * c);
    return {a / length, b / length, c / length};
}

// Whether two surfaces agree between two pixels, in value and in direction.
bool Grower::meets_smoothly(int p, int q, const Surface& a, const Surface& b, double tolerance, double angle) const {
    const double x = (static_cast<double>(image_.x[p]) + static_cast<double>(image_.x[q])) / 2;
    const double y = (static_cast<double>(image_.y[p]) + static_cast<double>(image_.y[q])) / 2;
    const double sigma = correlation_ * static_cast<double>(image_.sigma[p]);
    const double slope = std::max(std::hypot(a.slope_x(x, y), a.slope_y(x, y)), std::hypot(b.slope_x(x, y), b.slope_y(x, y)));
    if (std::abs(a.value(x, y) - b.value(x, y)) > tolerance * std::hypot(sigma, parameters_.lateral * slope)) return false;
    const auto na = normal(a, x, y), nb = normal(b, x, y);
    const double cosine = na[0] * nb[0] + na[1] * nb[1] + na[2] * nb[2];
    return cosine >= std::cos(angle * std::acos(-1.0) / 180);
}

bool Grower::beside_edge(int p) const {
    if (!image_.edges) return false;
    const int row = p / image_.cols, col = p % image_.cols;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, image_.rows - 1); ++r)
        for (int c = std::max(col - 1, 0); c <= std::min(col + 1, image_.cols - 1); ++c)
            if (image_.edges[r * image_.cols + c]) return true;
    return false;
}

// How patches of different regions touch.
std::map<std::pair<int, int>, Grower::Border> Grower::borders() {
    std::map<std::pair<int, int>, Border> found;
    const auto touch = [&](int p, int q) {
        const int a = patch(p), b = patch(q);
        if (!a || !b || a == b || root(a) == root(b)) return;
        Border& border = found[std::minmax(a, b)];
        ++border.pixels;
        if (beside_edge(p) || beside_edge(q)) return;
        ++border.open;
        const Surface &sa = of(a).surface, &sb = of(b).surface;
        const double angle = (sa.curved || sb.curved ? 3 : 1) * parameters_.smooth_angle;
        border.smooth += meets_smoothly(p, q, sa, sb, 1.5 * parameters_.tolerance, angle);
        border.similar += meets_smoothly(p, q, sa, sb, 3 * parameters_.tolerance, 3 * parameters_.smooth_angle);
    };
    for (int p = 0; p < size_; ++p) {
        if (p % image_.cols + 1 < image_.cols) touch(p, p + 1);
        if (p + image_.cols < size_) touch(p, p + image_.cols);
    }
    return found;
}

// Whether a plane, or a quadratic where one of them is curved, describes both patches as well as their own surfaces do.
bool Grower::one_surface(int a, int b) const {
    const Patch &pa = patches_[static_cast<std::size_t>(a)], &pb = patches_[static_cast<std::size_t>(b)];
    const SurfaceSums joint = pa.sums.joined(pb.sums);
    const Surface s = pa.surface.curved || pb.surface.curved ? joint.quadratic() : joint.plane();
    const auto kept = [&](const Patch& p) { return p.sums.rms(s) <= flat * std::max(p.surface.rms, correlation_); };
    return kept(pa) && kept(pb);
}

// Merges regions across borders without an edge. What is small beside its neighbour joins one, never links two.
void Grower::merge() {
    absorbed_.resize(patches_.size(), 0);
    for (bool changed = true; changed;) {
        changed = false;
        std::vector<std::pair<int, std::pair<int, int>>> order;
        const auto found = borders();
        std::vector<Pixels> pixels(patches_.size());
        for (int p = 0; p < size_; ++p)
            if (patch(p) && of(patch(p)).sums.count() < 5000) pixels[static_cast<std::size_t>(patch(p))].push_back(p);
        for (const auto& [pair, border] : found) order.push_back({-border.pixels, pair});
        std::sort(order.begin(), order.end());
        std::vector<char> touched(patches_.size(), 0);
        for (const auto& [negative, pair] : order) {
            auto [a, b] = pair;
            if (of(a).sums.count() < of(b).sums.count()) std::swap(a, b);
            if (touched[static_cast<std::size_t>(a)] || touched[static_cast<std::size_t>(b)] || root(a) == root(b)) continue;
            if (absorbed_[static_cast<std::size_t>(a)] || absorbed_[static_cast<std::size_t>(b)]) continue;
            const Border& border = found.at(pair);
            const double needed = 0.5 * std::sqrt(of(b).sums.count());
            const bool small = of(b).sums.count() < 0.2 * of(a).sums.count();
            int fitting = 0;
            if (small && 2 * border.open > border.pixels)
                for (const int p : pixels[static_cast<std::size_t>(b)]) fitting += residual(p, of(a).surface) < loose * parameters_.tolerance;
            const bool explained = fitting > 0.8 * static_cast<double>(pixels[static_cast<std::size_t>(b)].size()) && fitting;
            if (one_surface(a, b)) {
                of(a).sums = of(a).sums.joined(of(b).sums);
                of(a).surface = surface_of(of(a).sums);
                of(b).sums = SurfaceSums();
                renumber(b, a);
                touched[static_cast<std::size_t>(a)] = touched[static_cast<std::size_t>(b)] = 1;
            } else if (!explained && (border.pixels < needed || (small ? border.similar : border.smooth) <= 0.6 * border.pixels)) {
                continue;
            } else if (small) {
                absorbed_[static_cast<std::size_t>(b)] = 1;
            }
            region_[static_cast<std::size_t>(root(b))] = root(a);
            changed = true;
        }
    }
}

// Strips along rounded edges are no surfaces: a small patch, open to its neighbours, whose pixels they explain.
void Grower::dissolve() {
    std::map<int, std::vector<int>> around;
    std::map<int, Border> total;
    for (const auto& [pair, border] : borders()) {
        for (const auto& [i, j] : {pair, std::make_pair(pair.second, pair.first)}) {
            around[i].push_back(j);
            total[i].pixels += border.pixels;
            total[i].open += border.open;
        }
    }
    std::map<int, Pixels> pixels;
    for (int p = 0; p < size_; ++p) {
        const auto found = total.find(patch(p));
        if (found != total.end() && found->second.open > 0.2 * found->second.pixels) pixels[patch(p)].push_back(p);
    }
    for (auto& [i, own] : pixels) {
        if (region_[static_cast<std::size_t>(i)] != i) continue;
        int largest = 0;
        for (const int j : around[i]) largest = std::max(largest, of(j).sums.count());
        if (of(i).sums.count() > 0.2 * largest) continue;
        std::vector<int> best(own.size());
        int fitting = 0;
        for (std::size_t k = 0; k < own.size(); ++k) {
            double least = HUGE_VAL;
            for (const int j : around[i]) {
                const double r = residual(own[k], of(j).surface);
                if (r < least) least = r, best[k] = j;
            }
            fitting += least < loose * parameters_.tolerance;
        }
        if (fitting < 0.7 * static_cast<double>(own.size())) continue;
        for (std::size_t k = 0; k < own.size(); ++k) patch(own[k]) = best[k];
        of(i).sums = SurfaceSums();
    }
}

void Grower::renumber(int from, int to) {
    for (int& i : patch_)
        if (i == from) i = to;
}

// Quadratics that two planes describe better are cut in two.
void Grower::verify() {
    std::vector<Pixels> pixels(patches_.size());
    for (int p = 0; p < size_; ++p)
        if (patch(p) && of(patch(p)).surface.curved) pixels[static_cast<std::size_t>(patch(p))].push_back(p);
    const std::size_t count = patches_.size();
    Pixels first, second;
    for (std::size_t i = 1; i < count; ++i) {
        if (pixels[i].size() < least_curved || !split_roof(pixels[i], patches_[i].sums.quadratic(), first, second)) continue;
        for (const int p : pixels[i]) patch(p) = 0;
        patches_[i].sums = SurfaceSums();
        add_patch(first, 1);
        add_patch(second, 1);
    }
}

// Border pixels go to the neighbouring surface they lie on.
void Grower::reassign() {
    std::vector<std::pair<int, int>> moves;
    for (int p = 0; p < size_; ++p) {
        const int own = patch(p);
        if (!own) continue;
        int best = own;
        double least = -1;
        for_neighbours(p, [&](int q) {
            const int other = patch(q);
            if (!other || other == best || other == own) return;
            if (least < 0) least = residual(p, of(own).surface) - 0.1;
            const double r = residual(p, of(other).surface);
            if (r < least) least = r, best = other;
        });
        if (best != own) moves.emplace_back(p, best);
    }
    for (const auto& [p, i] : moves) patch(p) = i;
}

// Edge pixels and what else was left go to the surface they fit best.
void Grower::settle() {
    flood(loose * parameters_.tolerance, true);
    for (int round = 0; round < 3; ++round) reassign();
}

int Grower::finish(std::int32_t* labels) {
    std::vector<char> seen(static_cast<std::size_t>(size_), 0);
    Pixels component;
    const auto components = [&](auto&& visit) {
        std::fill(seen.begin(), seen.end(), 0);
        for (int start = 0; start < size_; ++start) {
            if (seen[static_cast<std::size_t>(start)] || !patch(start)) continue;
            const int r = root(patch(start));
            component.assign(1, start);
            seen[static_cast<std::size_t>(start)] = 1;
            for (std::size_t k = 0; k < component.size(); ++k)
                for_neighbours(component[k], [&](int q) {
                    if (seen[static_cast<std::size_t>(q)] || !patch(q) || root(patch(q)) != r) return;
                    seen[static_cast<std::size_t>(q)] = 1;
                    component.push_back(q);
                });
            visit();
        }
    };
    // What is too small falls to the neighbours that it fits.
    components([&] {
        if (static_cast<int>(component.size()) < parameters_.min_area)
            for (const int p : component) patch(p) = 0;
    });
    flood(2 * loose * parameters_.tolerance, true);
    std::fill(labels, labels + size_, 0);
    int count = 0;
    components([&] {
        ++count;
        for (const int p : component) labels[p] = count;
    });
    return count;
}

}  // namespace

int grow_regions(const RegionImage& image, const std::int32_t* markers, const RegionParameters& parameters,
                 std::int32_t* labels) {
    Grower grower(image, parameters);
    grower.sow(markers);
    grower.grow();
    if (parameters.new_seeds)
        for (int round = 0; round < 2; ++round) {
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
