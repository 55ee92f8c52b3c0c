// SPDX-License-Identifier: Apache-2.0
#include "edges/smear.hpp"

#include <algorithm>
#include <cmath>

namespace rangeedge {
namespace {

constexpr int ends = 4;             // samples, so many more may belong to short segments than are smeared
constexpr double veil_of_two = 45;  // degrees from the line of sight, where two samples or one hardly show a surface
constexpr double overshoot = 0.2;   // share of the step by which a smeared depth may lie beyond a side
constexpr double own_share = 0.15;  // share of the step up to which a sample belongs to a side
constexpr double most_even = 2.01;  // times the steps of an even ramp, that one from sample to sample may have
constexpr double least_ramp = 0.5;  // share of an even ramp that the samples must climb

// The tangent of a curve where its segment ends: farther on, the curve itself is too uncertain.
struct EndTangent {
    double x, y, slope;

    EndTangent(const Curve& curve, double at) : x(at), y(curve.value(at)), slope(curve.slope(at)) {}
    double value(double at) const { return y + slope * (at - x); }
};

// Where the depth of a sample lies, from 0 at that to which one side extends to 1 at that of the other; NaN where they
// cross on the way from the sample before, or where the sample is too far off.
template <class T>
double share_of_step(const Line<T>& line, const EndTangent& f, const EndTangent& g, int k, double& side) {
    const double x = line.abscissa(k), y1 = f.value(x), y2 = g.value(x);
    if (side * (y2 - y1) < 0 || (line.frame->projective && !(std::min(y1, y2) > 0))) return NAN;
    side = y2 - y1;
    const double from = line.depth(y1, x), to = line.depth(y2, x);
    const double share = (line.depth(line.ordinate(k), x) - from) / (to - from);
    const double slack = std::max(overshoot, line.tolerance_at(k) / std::abs(side));
    return share >= -slack && share <= 1 + slack ? share : NAN;
}

}  // namespace

template <class T>
SmearedStep smeared_step(const Line<T>& line, const Approximation& a, std::ptrdiff_t i,
                         const ScanLineOptions& options) {
    const SmearedStep none{0, 0, 0, 0, i, 0};
    if (a.segments[i].size() <= options.max_smear) return none;
    std::ptrdiff_t next = i + 1;
    int count = 0;
    for (; next < a.count && a.segments[next].size() <= options.max_smear; ++next) {
        count += a.segments[next].size();
        if (count > options.max_smear + ends) return none;
    }
    if (next == i + 1 || next == a.count) return none;

    SmearedStep step{a.segments[i].last, a.segments[next].first, 0, 0, next, 0};
    step.low = step.before, step.high = step.after;
    const int first = a.segments[i + 1].first;
    const EndTangent f(a.curves[i], line.abscissa(step.before)), g(a.curves[next], line.abscissa(step.after));
    double side = 0, at_first = 0, at_last = 0, steepest = 0;
    bool started = false;  // the ramp
    int smeared = 0;
    for (std::ptrdiff_t j = i; j < next; ++j)
        step.gap = std::max(step.gap, a.segments[j + 1].first - a.segments[j].last - 1);
    for (std::ptrdiff_t j = i + 1; j < next; ++j)
        for (int k = a.segments[j].first; k <= a.segments[j].last; ++k) {
            const double share = share_of_step(line, f, g, k, side);
            if (!(share == share)) return none;
            if (k == first) at_first = share;
            steepest = std::max(steepest, share - (k == first ? 0 : at_last));
            at_last = share;
            started = started || share > own_share;
            if (!started) step.before = k;
            if (share < 0.5)
                step.low = k, step.high = a.segments[next].first;
            else
                step.high = std::min(step.high, k);
            step.after = share < 1 - own_share ? a.segments[next].first : std::min(step.after, k);
        }
    for (int k = step.before + 1; k < step.after; ++k) smeared += line.ordinate(k) == line.ordinate(k);
    steepest = std::max(steepest, 1 - at_last);
    if (steepest > most_even / (smeared + 1)) return none;
    if (at_last - at_first < least_ramp * (count - 1) / (count + 1) || smeared > options.max_smear) return none;
    const double most = smeared > 2 ? veil : veil_of_two;
    return options.spaced && line.grazing_angle(step.before, step.after) > most ? none : step;
}

SmearMask::SmearMask(int rows, int cols, const std::vector<std::int32_t>& found, int least) {
    if (found.empty()) return;
    Array<std::uint8_t> times(static_cast<std::ptrdiff_t>(rows) * cols);
    mask_.resize(times.size());
    for (const std::int32_t p : found) ++times[p];
    const auto for_each_around = [&](std::int32_t p, auto&& visit) {
        const int row = p / cols, col = p % cols;
        for (int v = std::max(0, row - 1); v <= std::min(rows - 1, row + 1); ++v)
            for (int u = std::max(0, col - 1); u <= std::min(cols - 1, col + 1); ++u)
                visit(static_cast<std::ptrdiff_t>(v) * cols + u);
    };
    for (const std::int32_t p : found) {
        int count = 0;
        for_each_around(p, [&](std::ptrdiff_t q) { count += times[q]; });
        if (count < least) continue;
        for_each_around(p, [&](std::ptrdiff_t q) { mask_[q] = std::max<std::uint8_t>(mask_[q], beside); });
        mask_[p] = within;
    }
}

void SmearMask::clear_of_candidates(CandidateList& candidates) const {
    if (mask_.empty()) return;
    const auto smeared = [&](const Candidate& c) {
        if (c.kind & jump_bit) return !c.smeared && mask_[c.kind & occluding_bit ? c.before : c.after] == within;
        return std::max(mask_[c.before], mask_[c.after]) >= beside;
    };
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(), smeared), candidates.end());
}

void SmearMask::write(std::uint8_t* smeared) const {
    for (std::ptrdiff_t i = 0; i < mask_.size(); ++i) smeared[i] = mask_[i] == within ? 255 : 0;
}

#define RANGEEDGE_INSTANTIATE(T) \
    template SmearedStep smeared_step(const Line<T>&, const Approximation&, std::ptrdiff_t, const ScanLineOptions&);
RANGEEDGE_INSTANTIATE(float)
RANGEEDGE_INSTANTIATE(double)

}  // namespace rangeedge
