// SPDX-License-Identifier: Apache-2.0
#include "smear.hpp"

#include <algorithm>
#include <cmath>

namespace rangeedge {
namespace {

constexpr int ends = 4;             // samples, so many more may belong to short segments than are smeared
constexpr int always_smeared = 2;   // samples, too few to show a surface
constexpr double overshoot = 0.2;   // how far beyond a side a smeared depth may lie, as a share of the step
constexpr double own_share = 0.15;  // of the step, up to which a sample belongs to a side
constexpr double least_ramp = 0.5;  // share of an even ramp that the samples must climb

}  // namespace

template <class T>
Smear smear_after(const Line<T>& line, const Approximation& a, std::size_t i, const Parameters& parameters) {
    const Smear none{0, 0, i, 0};
    if (a.segments[i].size() <= parameters.max_smear) return none;
    std::size_t next = i + 1;
    int count = 0;
    for (; next < a.count && a.segments[next].size() <= parameters.max_smear; ++next) {
        count += a.segments[next].size();
        if (count > parameters.max_smear + ends) return none;
    }
    if (next == i + 1 || next == a.count) return none;

    const Curve &f = a.curves[i], &g = a.curves[next];
    Smear smear{a.segments[i].last, a.segments[next].first, next, 0};
    for (std::size_t j = i; j < next; ++j)
        smear.gap = std::max(smear.gap, a.segments[j + 1].first - a.segments[j].last - 1);
    double side = 0, first = 0, last = 0;
    bool left = true;  // of the ramp
    for (std::size_t j = i + 1; j < next; ++j)
        for (int k = a.segments[j].first; k <= a.segments[j].last; ++k) {
            const double x = line.abscissa(k), yf = f.value(x), yg = g.value(x);
            if (line.projective && !(std::min(yf, yg) > 0)) return none;
            const double zf = line.depth(yf), zg = line.depth(yg), share = (line.depth(line.ordinate(k)) - zf) / (zg - zf);
            const double slack = std::max(overshoot, line.tolerance_at(k) / std::abs(yg - yf));
            if (!(share >= -slack && share <= 1 + slack) || side * (yg - yf) < 0) return none;
            side = yg - yf;
            if (k == a.segments[i + 1].first) first = share;
            last = share;
            left = left && share <= own_share;
            if (left) smear.before = k;
            if (share < 1 - own_share) smear.after = a.segments[next].first;
            else smear.after = std::min(smear.after, k);
        }
    if (last - first < least_ramp * (count - 1) / (count + 1)) return none;
    int smeared = 0;
    for (int k = smear.before + 1; k < smear.after; ++k) smeared += line.ordinate(k) == line.ordinate(k);
    if (smeared > parameters.max_smear) return none;
    if (parameters.spaced && smeared > always_smeared && grazing_angle(line, smear.before, smear.after) > veil) return none;
    return smear;
}

SmearMask::SmearMask(int rows, int cols, const std::vector<const std::vector<std::int32_t>*>& found, int least) {
    const bool none = std::all_of(found.begin(), found.end(), [](const auto* pixels) { return pixels->empty(); });
    if (none) return;
    std::vector<std::uint8_t> times(static_cast<std::size_t>(rows) * static_cast<std::size_t>(cols));
    mask_.resize(times.size());
    for (const auto* pixels : found)
        for (const std::int32_t p : *pixels) ++times[static_cast<std::size_t>(p)];
    const auto for_each_around = [&](std::int32_t p, auto&& visit) {
        const int row = p / cols, col = p % cols;
        for (int v = std::max(0, row - 1); v <= std::min(rows - 1, row + 1); ++v)
            for (int u = std::max(0, col - 1); u <= std::min(cols - 1, col + 1); ++u)
                visit(static_cast<std::size_t>(v) * static_cast<std::size_t>(cols) + static_cast<std::size_t>(u));
    };
    for (const auto* pixels : found)
        for (const std::int32_t p : *pixels) {
            int count = 0;
            for_each_around(p, [&](std::size_t q) { count += times[q]; });
            if (count < least) continue;
            for_each_around(p, [&](std::size_t q) { mask_[q] = std::max<std::uint8_t>(mask_[q], beside); });
            mask_[static_cast<std::size_t>(p)] = within;
        }
}

void SmearMask::clear_of_candidates(std::vector<Candidate>& candidates) const {
    if (mask_.empty()) return;
    const auto smeared = [&](const Candidate& c) {
        const int before = mask_[static_cast<std::size_t>(c.before)], after = mask_[static_cast<std::size_t>(c.after)];
        if (c.kind & jump_bit) return (c.kind & occluding_bit ? before : after) == within;
        return std::max(before, after) >= beside;
    };
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(), smeared), candidates.end());
}

void SmearMask::write(std::uint8_t* smeared) const {
    for (std::size_t i = 0; i < mask_.size(); ++i) smeared[i] = mask_[i] == within ? 255 : 0;
}

template Smear smear_after(const Line<float>&, const Approximation&, std::size_t, const Parameters&);
template Smear smear_after(const Line<double>&, const Approximation&, std::size_t, const Parameters&);

}  // namespace rangeedge
