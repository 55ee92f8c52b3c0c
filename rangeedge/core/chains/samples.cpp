// SPDX-License-Identifier: Apache-2.0
#include "chains/samples.hpp"

#include <algorithm>
#include <cmath>

#include "chains/line_sums.hpp"

namespace rangeedge {
namespace {

constexpr std::ptrdiff_t fray_reach = 16;                // places inside of a frayed end
constexpr double least_fray = 0.8, fray_deviations = 3;  // pixels; standard deviations

// How many positions at an end lead off the line through those further inside, as they do beside a corner.
std::ptrdiff_t frayed(const Array<Point>& means, bool at_end) {
    const std::ptrdiff_t places = means.size();
    if (places < fray_reach + most_frayed) return 0;
    const auto inward = [&](std::ptrdiff_t i) -> const Point& { return means[at_end ? places - 1 - i : i]; };
    const Point& origin = inward(most_frayed);
    PointSums sums;
    for (std::ptrdiff_t i = most_frayed; i < most_frayed + fray_reach; ++i)
        sums.add(inward(i).x - origin.x, inward(i).y - origin.y);
    const StraightLine line = sums.line(1, 0);
    const double most = std::max(least_fray, fray_deviations * std::sqrt(line.rss / fray_reach));
    for (std::ptrdiff_t i = most_frayed; i > 0; --i)
        if (std::abs(line.off(inward(i - 1).x - origin.x, inward(i - 1).y - origin.y)) > most) return i;
    return 0;
}

}  // namespace

ChainSamples gather_samples(const Piece& chain, const CandidateList& candidates, const Crossings& crossings) {
    ChainSamples result;
    result.closed = chain.closed;
    Array<Point>& means = result.means;
    Array<std::int32_t> members;
    for (const std::int32_t member : chain.members) {
        Point mean;
        if (!mean_position(candidates, crossings, member, chain.type, mean)) continue;
        means.push_back(mean), members.push_back(member);
    }
    const std::ptrdiff_t first = chain.closed ? 0 : frayed(means, false);
    const std::ptrdiff_t end = members.size() - (chain.closed ? 0 : frayed(means, true));
    std::copy(means.begin() + first, means.begin() + end, means.begin());
    means.resize(end - first);
    for (std::ptrdiff_t i = first; i < end; ++i)
        for (std::int32_t k = crossings.first[members[i]]; k < crossings.first[members[i] + 1]; ++k) {
            const Candidate& c = candidates[static_cast<std::size_t>(crossings.candidates[k])];
            if (belongs(c, chain.type)) result.samples.push_back({&c, i - first, false});
        }
    for (ChainSample& s : result.samples) {
        const Point& a = means[result.neighbour(s.place, -tangent_reach)];
        const Point& b = means[result.neighbour(s.place, tangent_reach)];
        const Point step = scan_step(*s.candidate);
        s.before_left = step.x * (b.y - a.y) - step.y * (b.x - a.x) < 0;
    }
    return result;
}

}  // namespace rangeedge
