// SPDX-License-Identifier: Apache-2.0
#include "chains/cut.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "chains/corners.hpp"
#include "chains/samples.hpp"

namespace rangeedge {
namespace {

constexpr int least_points = 4;         // positions of a chain
constexpr int least_part = 8;           // pixels between two corners
constexpr int line_reach = 6;           // positions on either side that tell where a jump runs
constexpr int median_reach = 3;         // positions on either side whose depths have a common median
constexpr double least_crossing = 0.3;  // sine of the angle between a scan line and the edge that it meets there

template <class T>
class Cutter {
public:
    Cutter(Piece& chain, const Frame<T>& frame, const CandidateList& candidates, const Crossings& crossings,
           double least_angle)
        : chain_(chain), frame_(frame), candidates_(candidates), crossings_(crossings), least_angle_(least_angle) {
        for (std::ptrdiff_t i = 0; i < chain.members.size(); ++i) {
            Point mean;
            if (!mean_position(candidates, crossings, chain.members[i], chain.type, mean)) continue;
            points_.push_back(mean), members_.push_back(i);
        }
    }

    void cut(std::vector<Piece>& parts) {
        if (points_.size() < least_points) return;
        // Ends of parts, as numbers of points; around a closed chain they go on from the last point to the first.
        Array<std::ptrdiff_t> corners = find_corners(points_, chain_.closed, least_angle_, View::image);
        // A closed chain without any is opened at either of two places, to find a first one.
        for (std::ptrdiff_t start = 0; chain_.closed && corners.empty() && start < size(); start += size() / 2 + 1) {
            const Array<std::ptrdiff_t> in_space = corners_in_space(start, start + size());
            if (!in_space.empty()) corners.push_back(in_space[0] % size());
        }
        Array<std::ptrdiff_t> ends;
        if (!chain_.closed) ends.push_back(0);
        for (const std::ptrdiff_t corner : corners) ends.push_back(corner);
        if (!chain_.closed || !corners.empty()) ends.push_back(size() + (chain_.closed ? corners[0] : 0));
        Array<std::ptrdiff_t> all;
        for (std::ptrdiff_t i = 0; i + 1 < ends.size(); ++i) {
            all.push_back(ends[i]);
            for (const std::ptrdiff_t corner : corners_in_space(ends[i], ends[i + 1])) all.push_back(corner);
        }
        if (all.empty() || (!chain_.closed && all.size() == 1)) {
            parts.push_back(std::move(chain_));
            return;
        }
        all.push_back(ends.back());
        for (std::ptrdiff_t i = 0; i + 1 < all.size(); ++i) add_part(member(all[i]), member(all[i + 1]), parts);
    }

private:
    std::ptrdiff_t size() const { return points_.size(); }
    const Point& at(std::ptrdiff_t i) const { return points_[i < size() ? i : i % size()]; }

    std::ptrdiff_t member(std::ptrdiff_t i) const {
        const std::ptrdiff_t n = chain_.members.size();
        if (!chain_.closed && (i == 0 || i == size())) return i ? n : 0;
        return members_[i % size()] + (i >= size() ? n : 0);
    }

    // Numbers of points from one to before another.
    Array<std::ptrdiff_t> corners_in_space(std::ptrdiff_t first, std::ptrdiff_t end) {
        side_view(first, end);
        Array<std::ptrdiff_t> found = find_corners(medians(), false, least_angle_, View::side);
        for (std::ptrdiff_t& corner : found) corner += first + median_reach;
        return found;
    }

    // The positions along the chain from one point to before another, and the depths there, both in pixels.
    void side_view(std::ptrdiff_t first, std::ptrdiff_t end) {
        profile_.clear();
        if (end - first < least_points) return;
        set_unit(first, end);
        const double whole = mean_ordinate((first + end) / 2, {}, {});
        double along = 0;
        for (std::ptrdiff_t i = first; i < end; ++i) {
            const Point &p = at(std::max(i - tangent_reach, first)), &q = at(std::min(i + tangent_reach, end - 1));
            const double length = std::hypot(q.x - p.x, q.y - p.y);
            const Point tangent = length > 0 ? Point{(q.x - p.x) / length, (q.y - p.y) / length} : Point{0, 0};
            if (i > first) along += (at(i).x - at(i - 1).x) * tangent.x + (at(i).y - at(i - 1).y) * tangent.y;
            const double ordinate = mean_ordinate(i, mean_around(i, first, end), tangent);
            profile_.push_back({along, (whole - ordinate) / (plane_per_pixel_ * (frame_.projective ? whole : 1))});
        }
    }

    // The mean of as many positions before one as after it.
    Point mean_around(std::ptrdiff_t i, std::ptrdiff_t first, std::ptrdiff_t end) const {
        Point sum{0, 0};
        if (!is_one_sided(chain_.type)) return sum;
        const std::ptrdiff_t reach = std::min<std::ptrdiff_t>({line_reach, i - first, end - 1 - i});
        for (std::ptrdiff_t k = i - reach; k <= i + reach; ++k) sum.x += at(k).x, sum.y += at(k).y;
        const auto count = static_cast<double>(2 * reach + 1);
        return {sum.x / count, sum.y / count};
    }

    void set_unit(std::ptrdiff_t first, std::ptrdiff_t end) {
        double pixels = 0, plane = 0;
        const std::ptrdiff_t places[] = {first, (first + end) / 2, end - 1};
        for (const int k : {0, 1}) {
            const Point &a = at(places[k]), &b = at(places[k + 1]);
            const Candidate *c = first_at(places[k]), *d = first_at(places[k + 1]);
            pixels += std::hypot(b.x - a.x, b.y - a.y);
            plane += std::hypot(static_cast<double>(d->plane_position[0] - c->plane_position[0]),
                                static_cast<double>(d->plane_position[1] - c->plane_position[1]));
        }
        plane_per_pixel_ = plane / pixels;
    }

    template <class Visit>
    void for_candidates(std::ptrdiff_t i, Visit&& visit) const {
        const std::int32_t place = chain_.members[members_[i % size()]];
        for (std::int32_t k = crossings_.first[place]; k < crossings_.first[place + 1]; ++k) {
            const Candidate& c = candidates_[static_cast<std::size_t>(crossings_.candidates[k])];
            if (belongs(c, chain_.type)) visit(c);
        }
    }

    const Candidate* first_at(std::ptrdiff_t i) const {
        const Candidate* found = nullptr;
        for_candidates(i, [&](const Candidate& c) { found = found ? found : &c; });
        return found;
    }

    // Of the nearer surface, or of both that meet, at a point; of a jump, whose candidates lie half a pixel aside,
    // where their scan lines cross the line through `middle` along `tangent`.
    double mean_ordinate(std::ptrdiff_t i, const Point& middle, const Point& tangent) const {
        double sum = 0;
        int count = 0;
        for_candidates(i, [&](const Candidate& c) {
            ++count;
            const bool before = (c.kind & occluding_bit) != 0;
            const Side& near = c.sides[before ? 0 : 1];
            if (!is_one_sided(chain_.type)) {
                sum += (static_cast<double>(c.sides[0].value) + static_cast<double>(c.sides[1].value)) / 2;
                return;
            }
            if (!(near.slope_variance > 0)) {
                sum += ordinate_at(frame_, before ? c.before : c.after);
                return;
            }
            const Point step = scan_step(c);
            const double length = std::hypot(step.x, step.y);
            const double sine = (step.x * tangent.y - step.y * tangent.x) / length;
            const double off =
                (middle.x - static_cast<double>(c.x)) * tangent.y - (middle.y - static_cast<double>(c.y)) * tangent.x;
            const double pixels = std::abs(sine) < least_crossing ? 0 : off / sine;
            sum += static_cast<double>(near.value) + pixels * plane_per_pixel_ * static_cast<double>(near.slope);
        });
        return sum / count;
    }

    // Of the depths of several places each, since some of a jump are those of the surface behind; none of those at the
    // ends.
    Array<Point> medians() const {
        Array<Point> result;
        double near[2 * median_reach + 1];
        for (std::ptrdiff_t i = median_reach; i + median_reach < profile_.size(); ++i) {
            for (int k = -median_reach; k <= median_reach; ++k) near[k + median_reach] = profile_[i + k].y;
            std::nth_element(near, near + median_reach, near + 2 * median_reach + 1);
            result.push_back({profile_[i].x, near[median_reach]});
        }
        return result;
    }

    // The part of the chain from one member to before another.
    void add_part(std::ptrdiff_t begin, std::ptrdiff_t end, std::vector<Piece>& parts) const {
        if (end - begin < least_part) return;
        Piece part{{}, chain_.type, false};
        const std::ptrdiff_t n = chain_.members.size();
        for (std::ptrdiff_t i = begin; i < end; ++i) part.members.push_back(chain_.members[i % n]);
        parts.push_back(std::move(part));
    }

    Piece& chain_;
    const Frame<T>& frame_;
    const CandidateList& candidates_;
    const Crossings& crossings_;
    double least_angle_;
    Array<Point> points_;            // positions in the image
    Array<std::ptrdiff_t> members_;  // of the chain, that they belong to
    double plane_per_pixel_ = 1;
    Array<Point> profile_;
};

}  // namespace

template <class T>
std::vector<Piece> cut_at_corners(std::vector<Piece> chains, const Frame<T>& frame, const CandidateList& candidates,
                                  const Crossings& crossings, double least_angle, Team& team) {
    std::vector<std::vector<Piece>> parts(chains.size());
    parallel_each(static_cast<int>(chains.size()), team, [&](int i, int) {
        const auto k = static_cast<std::size_t>(i);
        Cutter<T>(chains[k], frame, candidates, crossings, least_angle).cut(parts[k]);
    });
    chains.clear();
    for (std::vector<Piece>& of_one : parts)
        for (Piece& part : of_one) chains.push_back(std::move(part));
    return chains;
}

template std::vector<Piece> cut_at_corners(std::vector<Piece>, const Frame<float>&, const CandidateList&,
                                           const Crossings&, double, Team&);
template std::vector<Piece> cut_at_corners(std::vector<Piece>, const Frame<double>&, const CandidateList&,
                                           const Crossings&, double, Team&);

}  // namespace rangeedge
