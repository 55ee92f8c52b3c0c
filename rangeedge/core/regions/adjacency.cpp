// SPDX-License-Identifier: Apache-2.0
#include "regions/adjacency.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace rangeedge {
namespace {

const double degree = std::acos(-1.0) / 180;
constexpr double smooth_deviations = 1.5, similar_deviations = 3;  // in tolerances of a pixel
constexpr double similar_angle = 3;                                // in smooth angles

// Numbers 0, 1, ... of pairs of patches, in the order in which they are asked for.
class PairNumbers {
public:
    int operator()(int a, int b) {
        if (2 * pairs_.size() >= slots_.size()) grow();
        std::size_t k = slot(a, b);
        if (slots_[k] < 0) {
            slots_[k] = static_cast<int>(pairs_.size());
            pairs_.emplace_back(a, b);
        }
        return slots_[k];
    }
    const std::vector<std::pair<int, int>>& pairs() const { return pairs_; }

private:
    std::size_t slot(int a, int b) const {
        const std::uint64_t key =
            static_cast<std::uint64_t>(static_cast<std::uint32_t>(a)) << 32 | static_cast<std::uint32_t>(b);
        std::size_t k = static_cast<std::size_t>((key * 0x9e3779b97f4a7c15u) >> 32) & (slots_.size() - 1);
        while (slots_[k] >= 0 && pairs_[static_cast<std::size_t>(slots_[k])] != std::make_pair(a, b))
            k = (k + 1) & (slots_.size() - 1);
        return k;
    }
    void grow() {
        slots_.assign(std::max<std::size_t>(64, 2 * slots_.size()), -1);
        for (std::size_t i = 0; i < pairs_.size(); ++i)
            slots_[slot(pairs_[i].first, pairs_[i].second)] = static_cast<int>(i);
    }

    std::vector<int> slots_;  // a power of two of them, at most half of them used
    std::vector<std::pair<int, int>> pairs_;
};

}  // namespace

Adjacency::Adjacency(PatchMap& patches, const Tolerance& tolerance)
    : patches_(patches), tolerance_(tolerance), changed_(patches.count(), 0), perimeter_(patches.count(), 0) {
    collect();
    sort_by_section();
}

// Rows in parallel, each thread for its own; together they are in raster order.
void Adjacency::collect() {
    const SurfaceImage& image = patches_.image();
    Array<int> region(changed_.size());
    for (int i = 0; i < patches_.count(); ++i) region[i] = patches_.region(i);
    Team& team = patches_.team();
    std::vector<std::vector<Contact>> found(static_cast<std::size_t>(team.size()));
    std::vector<Array<int>> sides(found.size(), perimeter_);
    parallel_for(image.rows(), team, [&](int first, int last, int thread) {
        auto& contacts = found[static_cast<std::size_t>(thread)];
        auto& perimeter = sides[static_cast<std::size_t>(thread)];
        patches_.for_borders(first, last, [&](int p) {
            const int i = patches_[p];
            for (const int q : {p + 1, p + image.stride()}) {
                const int j = patches_[q];
                if (i == j) continue;
                ++perimeter[i], ++perimeter[j];
                if (i && j && region[i] != region[j]) contacts.push_back({p, q, 0});
            }
        });
    });
    for (const auto& contacts : found) contacts_.insert(contacts_.end(), contacts.begin(), contacts.end());
    for (const Array<int>& counts : sides)
        for (int i = 0; i < counts.count(); ++i) perimeter_[i] += counts[i];
}

void Adjacency::sort_by_section() {
    PairNumbers numbers;
    std::vector<int> start(1, 0);
    Checkpoints checkpoints;
    for (Contact& c : contacts_) {
        checkpoints.pass();
        const int a = patches_.surface(patches_[c.p]), b = patches_.surface(patches_[c.q]);
        c.section = numbers(std::min(a, b), std::max(a, b));
        start.resize(numbers.pairs().size() + 1, 0);
        ++start[static_cast<std::size_t>(c.section) + 1];
    }
    for (std::size_t k = 1; k < start.size(); ++k) start[k] += start[k - 1];
    for (std::size_t k = 0; k < numbers.pairs().size(); ++k) {
        const auto [a, b] = numbers.pairs()[k];
        sections_.push_back({a, b, start[k], start[k + 1], false, {}});
    }
    std::vector<Contact> sorted(contacts_.size());
    for (const Contact& c : contacts_)
        sorted[static_cast<std::size_t>(start[static_cast<std::size_t>(c.section)]++)] = c;
    contacts_.swap(sorted);
}

Border Adjacency::measure(const Section& section, const Patch& a, const Patch& b) const {
    const SurfaceImage& image = patches_.image();
    const double fine = std::cos(tolerance_.smooth_angle * degree);
    const double rough = std::cos(similar_angle * tolerance_.smooth_angle * degree);
    const double least_cosine = a.surface.curved || b.surface.curved ? rough : fine;
    const auto squared = [](double x) { return x * x; };
    const double smooth_gap = squared(smooth_deviations * tolerance_.deviations);
    const double similar_gap = squared(similar_deviations * tolerance_.deviations);
    Border border;
    for (int k = section.first; k < section.last; ++k) {
        const Contact& c = contacts_[static_cast<std::size_t>(k)];
        ++border.pixels;
        const bool open = !image.edge_between(c.p, c.q);
        border.open += open;
        const auto [gap, cosine] = image.continuation(c.p, c.q, a.surface, b.surface);
        border.smooth += gap <= smooth_gap && cosine >= least_cosine;
        border.similar += gap <= similar_gap && cosine >= rough;
        border.joined += open && gap <= similar_gap;
    }
    return border;
}

const std::vector<Adjacency::Neighbours>& Adjacency::update() {
    std::vector<int> unknown;
    PairNumbers numbers;
    std::vector<std::pair<int, int>> of_pair;  // sections by pair of patches
    Checkpoints checkpoints;
    for (int k = 0; k < sections_.count(); ++k) {
        checkpoints.pass();
        Section& s = sections_[k];
        s.known = s.known && !changed_[s.a] && !changed_[s.b];
        s.a = patches_.surface(s.a), s.b = patches_.surface(s.b);
        if (patches_.region(s.a) == patches_.region(s.b)) continue;
        if (s.a > s.b) std::swap(s.a, s.b);
        s.known = s.known && !changed_[s.a] && !changed_[s.b];
        if (!s.known) unknown.push_back(k);
        of_pair.emplace_back(numbers(s.a, s.b), k);
    }
    std::fill(changed_.begin(), changed_.end(), char{0});
    parallel_each(static_cast<int>(unknown.size()), patches_.team(), [&](int i, int) {
        Section& s = sections_[unknown[static_cast<std::size_t>(i)]];
        s.border = measure(s, patches_.patch(s.a), patches_.patch(s.b));
        s.known = true;
    });
    neighbours_.clear();
    for (const auto& [a, b] : numbers.pairs()) neighbours_.push_back({a, b, {}});
    for (const auto& [pair, k] : of_pair) {
        Border& sum = neighbours_[static_cast<std::size_t>(pair)].border;
        const Border& part = sections_[k].border;
        sum.pixels += part.pixels, sum.open += part.open;
        sum.smooth += part.smooth, sum.similar += part.similar, sum.joined += part.joined;
    }
    std::sort(neighbours_.begin(), neighbours_.end(), [](const Neighbours& m, const Neighbours& n) {
        return std::make_pair(-m.border.pixels, std::make_pair(m.a, m.b)) <
               std::make_pair(-n.border.pixels, std::make_pair(n.a, n.b));
    });
    return neighbours_;
}

}  // namespace rangeedge
