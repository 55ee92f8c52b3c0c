// SPDX-License-Identifier: Apache-2.0
#include "chains/smooth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "chains/channel.hpp"
#include "chains/line_sums.hpp"
#include "chains/samples.hpp"
#include "chains/separation.hpp"

namespace rangeedge {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double jump_aside = 0.5, crease_aside = 0.03;  // pixels that a part of a straight chain may lie aside
constexpr double ordinate_aside = 3e-5;                  // of ordinates, as a share
constexpr double least_squared_sine = 0.05;              // of a scan line with a jump, in its weight
constexpr int end_places = 4;
constexpr double largest_precision = 1e30;           // of a slope
constexpr int position_reach = 12, least_reach = 4;  // pixels on either side of a parabola
constexpr int normal_reach = 10;                     // pixels on either side that tell a normal
constexpr int gradient_rounds = 2;
constexpr double reach_per_radius = 0.5;
constexpr std::ptrdiff_t least_share_inside = 5;

// Sums over the slopes of a surface on scan lines, by their precision.
struct SlopeSums {
    double xx = 0, xy = 0, yy = 0, xm = 0, ym = 0;
    void add(const SlopeSums& o) { xx += o.xx, xy += o.xy, yy += o.yy, xm += o.xm, ym += o.ym; }
    // The slope along (nx, ny), where that along (tx, ty) is known.
    double across(double nx, double ny, double tx, double ty, double along) const {
        const double nn = xx * nx * nx + 2 * xy * nx * ny + yy * ny * ny;
        const double nt = xx * nx * tx + xy * (nx * ty + ny * tx) + yy * ny * ty;
        return nn > 0 ? (xm * nx + ym * ny - along * nt) / nn : nan;
    }
};

template <class T>
class Smoother {
public:
    Smoother(const Piece& chain, const Frame<T>& frame, const CandidateList& candidates, const Crossings& crossings)
        : frame_(frame), gathered_(gather_samples(chain, candidates, crossings)), means_(gathered_.means),
          samples_(gathered_.samples), closed_(chain.closed), jumps_(is_one_sided(chain.type)) {}

    SmoothChain smooth() {
        if (places() < 2) return {};
        result_.points.resize(static_cast<std::size_t>(places()));
        for (ChainPoint& p : result_.points) p.deviation = nan;
        find_positions();
        find_plane();
        for (const int side : {0, 1}) find_ordinates(side);
        // The ordinates are those half a pixel aside, until the gradient is known.
        for (int round = 0; jumps_ && result_.straight && round < gradient_rounds; ++round) {
            for (const int side : {0, 1}) find_gradients(side);
            gradients_known_ = true;
            for (const int side : {0, 1}) find_ordinates(side);
        }
        if (!jumps_)
            for (ChainPoint& p : result_.points)
                p.ordinate[0] = p.ordinate[1] = (p.ordinate[0] + p.ordinate[1]) / 2;  // the surfaces meet
        for (const int side : {0, 1}) find_gradients(side);
        find_measured();
        find_significance();
        if (result_.straight) sort_along();
        return std::move(result_);
    }

private:
    std::ptrdiff_t places() const { return gathered_.places(); }
    std::ptrdiff_t neighbour(std::ptrdiff_t k, std::ptrdiff_t step) const { return gathered_.neighbour(k, step); }
    ChainPoint& point(std::ptrdiff_t k) { return result_.points[static_cast<std::size_t>(k)]; }

    // ---- In the image ----

    void find_positions() {
        if (!closed_ && find_straight_line()) return;
        const int reach = parabola_reach();
        Array<double> values;
        for (const int axis : {0, 1}) {
            fill([&](const ChainSample& s) { return static_cast<double>(axis ? s.candidate->y : s.candidate->x); });
            smooth_parabolas(channel_, places(), closed_, reach, values);
            for (std::ptrdiff_t k = 0; k < places(); ++k) (axis ? point(k).y : point(k).x) = values[k];
        }
        positions_.resize(places());
        for (std::ptrdiff_t k = 0; k < places(); ++k) positions_[k] = static_cast<double>(k);
    }

    // By squared distances first, for the direction; then by the offsets across it, which are left out where large.
    bool find_straight_line() {
        const Point &a = means_[0], &b = means_[places() - 1];
        PointSums sums;
        for (const Point& p : means_) sums.add(p.x - a.x, p.y - a.y);
        StraightLine line = sums.line(b.x - a.x, b.y - a.y);
        line.x += a.x, line.y += a.y;
        AffineFit fit{};
        for (const bool last : {false, true}) {
            channel_.clear();
            for (const ChainSample& s : samples_) {
                if (beside_corner(s)) continue;
                const double x = static_cast<double>(s.candidate->x), y = static_cast<double>(s.candidate->y);
                channel_.push_back({s.place, line.along(x, y), line.off(x, y), weight(s, line)});
            }
            fit = fit_affine(channel_, jumps_ ? jump_aside : crease_aside);
            if (last) break;
            const double x = line.x - line.dy * fit.value + line.dx * fit.centre;
            const double y = line.y + line.dx * fit.value + line.dy * fit.centre;
            const double dx = line.dx - fit.slope * line.dy, dy = line.dy + fit.slope * line.dx;
            const double length = std::hypot(dx, dy);
            line = {x, y, dx / length, dy / length, 0};
        }
        if (!fit.fits) return false;
        result_.straight = true;
        LineSpread spread;
        const bool bounded = jumps_ && separate(pixel_pairs(line), fit, spread);
        positions_.resize(places());
        for (std::ptrdiff_t k = 0; k < places(); ++k) {
            const double t = line.along(means_[k].x, means_[k].y), off = fit.at(t);
            positions_[k] = t;
            if (bounded) point(k).deviation = spread.deviation_at(t);
            point(k).x = line.x + t * line.dx - off * line.dy;
            point(k).y = line.y + t * line.dy + off * line.dx;
        }
        return true;
    }

    // The pixels beside each candidate of a jump, on the two sides of a line.
    Array<PixelPair> pixel_pairs(const StraightLine& line) const {
        Array<PixelPair> pairs;
        for (const ChainSample& s : samples_) {
            const auto place = [&](std::int32_t pixel) {
                const double x = pixel % frame_.cols, y = pixel / frame_.cols;
                return Point{line.along(x, y), line.off(x, y)};
            };
            const Point p = place(s.candidate->before), q = place(s.candidate->after);
            const bool before_nearer = (s.candidate->kind & occluding_bit) != 0;
            const Point &near = before_nearer ? p : q, &far = before_nearer ? q : p;
            // The nearer surface is on the left, where offsets are negative.
            if (far.y > near.y) pairs.push_back({far.x, far.y, near.x, near.y});
        }
        return pairs;
    }

    // There scan lines are short, and bend creases.
    bool beside_corner(const ChainSample& s) const {
        const std::ptrdiff_t reach = std::min(most_frayed, places() / least_share_inside);
        return !jumps_ && (s.place < reach || s.place >= places() - reach);
    }

    double weight(const ChainSample& s, const StraightLine& line) const {
        if (!jumps_) return 1;
        const Point step = scan_step(*s.candidate);
        const double across = step.y * line.dx - step.x * line.dy;
        return 1 / (across * across + least_squared_sine);
    }

    // Parabolas must be short where the chain turns fast.
    int parabola_reach() const {
        double turn = 0;
        for (std::ptrdiff_t k = 0; k < places(); ++k) {
            const Point &a = means_[neighbour(k, -position_reach)], &b = means_[k],
                        &c = means_[neighbour(k, position_reach)];
            const double cross = (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x);
            const double product = std::sqrt(((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y)) *
                                             ((c.x - b.x) * (c.x - b.x) + (c.y - b.y) * (c.y - b.y)));
            if (product > 0) turn = std::max(turn, std::abs(cross) / product);
        }
        const double radius = position_reach / std::max(turn, 1e-3);
        const auto reach = static_cast<int>(std::min<double>(position_reach, reach_per_radius * radius));
        return std::min<int>(std::max(reach, least_reach), static_cast<int>((places() - 1) / 2));
    }

    // One value of each sample; NaN is none.
    template <class Value>
    void fill(Value&& value) {
        channel_.clear();
        for (const ChainSample& s : samples_) {
            const double v = value(s);
            if (std::isfinite(v)) channel_.push_back({s.place, positions_.empty() ? 0 : positions_[s.place], v, 1});
        }
    }

    // An affine function of the position where that fits and the chain is straight, else parabolas.
    template <class Set>
    bool smooth_channel(double allowed, Set&& set) {
        if (channel_.empty()) {
            for (std::ptrdiff_t k = 0; k < places(); ++k) set(point(k), nan);
            return false;
        }
        if (result_.straight) {
            const AffineFit fit = fit_affine(channel_, allowed);
            if (fit.fits) {
                for (std::ptrdiff_t k = 0; k < places(); ++k) set(point(k), fit.at(positions_[k]));
                return true;
            }
        }
        const int reach = std::min<int>(position_reach, static_cast<int>((places() - 1) / 2));
        smooth_parabolas(channel_, places(), closed_, reach, values_);
        for (std::ptrdiff_t k = 0; k < places(); ++k) set(point(k), values_[k]);
        return false;
    }

    // ---- In space ----

    void find_plane() {
        for (std::ptrdiff_t k = 0; !frame_.points && k < places(); ++k) {
            ChainPoint& p = point(k);
            to_plane(p.x, p.y, p.plane);
        }
        for (int axis = 0; frame_.points && axis < 2; ++axis) {
            fill([&](const ChainSample& s) { return static_cast<double>(s.candidate->plane_position[axis]); });
            smooth_channel(0, [axis](ChainPoint& p, double v) { p.plane[axis] = v; });
        }
    }

    void to_plane(double x, double y, double plane[2]) const {
        for (const int axis : {0, 1}) {
            const double* m = frame_.to_plane + 3 * axis;
            plane[axis] = m[0] * x + m[1] * y + m[2];
        }
    }

    // Not at an end of a straight chain, where scan lines cross other edges nearby.
    bool inside(const ChainSample& s) const {
        if (!result_.straight || places() < 4 * end_places) return true;
        return s.place >= end_places && s.place < places() - end_places;
    }

    static bool has_sides(const Candidate& c) { return c.sides[0].slope_variance > 0 || c.sides[1].slope_variance > 0; }

    const Side& side_of(const ChainSample& s, int side) const {
        return s.candidate->sides[(side == 0) != s.before_left];
    }

    // The share of a length on the line of sight that lies along the axis, where jumps are measured on that.
    double along_axis(std::int32_t pixel) const {
        if (!frame_.ranges) return 1;
        return 1 / (std::abs(ordinate_at(frame_, pixel)) * length(frame_.point(pixel)));
    }

    // Of a surface beside an edge, moved along the scan line to where the candidate was moved.
    double ordinate(const ChainSample& s, int side) const {
        const Candidate& c = *s.candidate;
        if (!has_sides(c)) {
            const double near = ordinate_at(frame_, c.kind & occluding_bit ? c.before : c.after),
                         jump = static_cast<double>(c.jump) * along_axis(c.before);
            if (side == 0) return near;
            return frame_.projective ? 1 / (1 / near + jump) : near - jump;
        }
        const Side& own = side_of(s, side);
        double plane[2] = {static_cast<double>(c.plane_position[0]), static_cast<double>(c.plane_position[1])},
               moved = 0;
        if (!frame_.points) {
            to_plane(static_cast<double>(c.x), static_cast<double>(c.y), plane);
            for (const int axis : {0, 1})
                moved += (plane[axis] - static_cast<double>(c.plane_position[axis])) *
                         static_cast<double>(c.plane_direction[axis]);
        }
        const ChainPoint& p = result_.points[static_cast<std::size_t>(s.place)];
        const double* gradient = p.gradient[side];
        double aside = 0;
        if (gradients_known_ && std::isfinite(gradient[0]))
            for (const int axis : {0, 1}) aside += (p.plane[axis] - plane[axis]) * gradient[axis];
        return static_cast<double>(own.value) + moved * static_cast<double>(own.slope) + aside;
    }

    void find_ordinates(int side) {
        fill([&](const ChainSample& s) { return inside(s) ? ordinate(s, side) : nan; });
        double sum = 0;
        for (const ChannelSample& s : channel_) sum += std::abs(s.value);
        const double allowed = ordinate_aside * sum / static_cast<double>(std::max<std::ptrdiff_t>(channel_.size(), 1));
        affine_[side] = smooth_channel(allowed, [side](ChainPoint& p, double v) { p.ordinate[side] = v; });
    }

    void find_gradients(int side) {
        Array<SlopeSums> sums(places() + 1);
        SlopeSums all;
        for (const ChainSample& s : samples_) {
            const Side& own = side_of(s, side);
            if (!inside(s) || !has_sides(*s.candidate) || !(own.slope_variance > 0) || !(own.slope_variance < endless))
                continue;
            const double precision = std::min(1 / static_cast<double>(own.slope_variance), largest_precision);
            const double x = static_cast<double>(s.candidate->plane_direction[0]), m = static_cast<double>(own.slope);
            const double y = static_cast<double>(s.candidate->plane_direction[1]), p = precision;
            const SlopeSums one{p * x * x, p * x * y, p * y * y, p * x * m, p * y * m};
            sums[s.place].add(one), all.add(one);
        }
        if (result_.straight && affine_[side]) {
            set_gradient(0, side, all, 0, places() - 1);
            for (std::ptrdiff_t k = 1; k < places(); ++k)
                std::copy_n(point(0).gradient[side], 2, point(k).gradient[side]);
            return;
        }
        const auto reach = static_cast<int>(std::min<std::ptrdiff_t>(normal_reach, (places() - 1) / 2));
        for (std::ptrdiff_t k = 0; k < places(); ++k) {
            SlopeSums near;
            for (int j = -reach; j <= reach; ++j)
                if (closed_ || (k + j >= 0 && k + j < places())) near.add(sums[neighbour(k, j)]);
            set_gradient(k, side, near, neighbour(k, -tangent_reach), neighbour(k, tangent_reach));
        }
    }

    // From what the slopes tell across the way from one place to another, and the ordinates along it.
    void set_gradient(std::ptrdiff_t k, int side, const SlopeSums& sums, std::ptrdiff_t first, std::ptrdiff_t last) {
        const ChainPoint &a = point(first), &b = point(last);
        double tx = b.plane[0] - a.plane[0], ty = b.plane[1] - a.plane[1];
        const double length = std::hypot(tx, ty), along = (b.ordinate[side] - a.ordinate[side]) / length;
        tx /= length, ty /= length;
        const double across = sums.across(-ty, tx, tx, ty, along);
        double* gradient = point(k).gradient[side];
        gradient[0] = along * tx - across * ty, gradient[1] = along * ty + across * tx;
    }

    // What the candidates of each place say by themselves.
    void find_measured() {
        Array<int> counts(places(), 0);
        for (ChainPoint& p : result_.points) std::fill_n(p.measured, 3, 0.0);
        for (const ChainSample& s : samples_) {
            const double value = jumps_ ? ordinate(s, 0) : (ordinate(s, 0) + ordinate(s, 1)) / 2;
            if (!std::isfinite(value)) continue;
            ChainPoint& p = point(s.place);
            for (const int axis : {0, 1}) p.measured[axis] += static_cast<double>(s.candidate->plane_position[axis]);
            p.measured[2] += value, ++counts[s.place];
        }
        for (std::ptrdiff_t k = 0; k < places(); ++k) {
            ChainPoint& p = point(k);
            for (double& v : p.measured) v = counts[k] ? v / counts[k] : nan;
            if (!frame_.points && counts[k]) to_plane(means_[k].x, means_[k].y, p.measured);
            const double* gradient = p.gradient[0];
            if (gradients_known_ && std::isfinite(gradient[0]))
                for (const int axis : {0, 1}) p.measured[2] += (p.measured[axis] - p.plane[axis]) * gradient[axis];
        }
    }

    void find_significance() {
        for (const ChainSample& s : samples_) {
            double& most = point(s.place).significance;
            most = std::max(most, static_cast<double>(s.candidate->significance));
        }
    }

    void sort_along() {
        Array<std::ptrdiff_t> order(places());
        for (std::ptrdiff_t k = 0; k < places(); ++k) order[k] = k;
        std::stable_sort(order.begin(), order.end(),
                         [&](std::ptrdiff_t i, std::ptrdiff_t k) { return positions_[i] < positions_[k]; });
        std::vector<ChainPoint> sorted;
        for (const std::ptrdiff_t k : order) sorted.push_back(point(k));
        result_.points = std::move(sorted);
    }

    const Frame<T>& frame_;
    const ChainSamples gathered_;
    const Array<Point>& means_;
    const Array<ChainSample>& samples_;
    bool closed_, jumps_, affine_[2] = {false, false}, gradients_known_ = false;
    Array<double> positions_;  // along the straight line, else the numbers of places
    Array<ChannelSample> channel_;
    Array<double> values_;
    SmoothChain result_;
};

}  // namespace

template <class T>
SmoothChain smooth_chain(const Piece& chain, const Frame<T>& frame, const CandidateList& candidates,
                         const Crossings& crossings) {
    return Smoother<T>(chain, frame, candidates, crossings).smooth();
}

template SmoothChain smooth_chain(const Piece&, const Frame<float>&, const CandidateList&, const Crossings&);
template SmoothChain smooth_chain(const Piece&, const Frame<double>&, const CandidateList&, const Crossings&);

}  // namespace rangeedge
