// SPDX-License-Identifier: Apache-2.0
#include "edges.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "approximation.hpp"
#include "line.hpp"
#include "neighbours.hpp"
#include "parallel.hpp"
#include "shadow.hpp"
#include "smear.hpp"

namespace rangeedge {
namespace {

constexpr double lone_significance = 3;  // of a candidate by itself, before its neighbours are asked
constexpr double jump_alone = 12;        // significance of a jump
constexpr int least_outlined = 3;        // samples of a surface beside a wide gap
constexpr double jump_tolerances = 2;    // what tells a jump from the approximation's own error

// Where an edge is: between two samples, at an abscissa, also counted in samples.
struct Cut {
    int before, after;
    double abscissa, sample;
    double shift;  // samples that it was moved
    bool meeting;  // the two curves meet here: no jump
    int steps;     // from sample to sample, between the two curves
};

// Candidates of some lines, and the pixels over which steps are smeared there.
struct Found {
    std::vector<Candidate> candidates;
    std::vector<std::int32_t> smeared;

    void clear() { candidates.clear(), smeared.clear(); }
};

template <class T>
class LineDetector {
public:
    LineDetector(const RangeImage<T>& image, const Noise& noise, const Parameters& parameters, int direction)
        : cols_(image.cols), parameters_(parameters), reader_(image, noise, parameters), direction_(direction) {}

    void read(int first, int count, Strip<T>& strip) const { reader_.read(direction_, first, count, strip); }

    void detect(const Strip<T>& strip, Approximator<T>& approximator, Found& found) const {
        approximator.approximate(strip);  // P 4.1
        for (std::size_t i = 0; i < strip.lines.size(); ++i) detect(strip.lines[i], approximator.line(i), found);
    }

private:
    void detect(const Line<T>& line, const Approximation& a, Found& found) const {
        for (std::size_t i = 0; i + 1 < a.count;) {
            Candidate candidate{};
            std::size_t next = smeared_step(line, a, i, candidate, found.smeared);
            if (next == i) candidate = step_or_crease(line, a, i), next = i + 1;
            if (candidate.jump > 0 || candidate.crease > 0) found.candidates.push_back(candidate);
            i = next;
        }
    }

    Candidate step_or_crease(const Line<T>& line, const Approximation& a, std::size_t i) const {
        const Segment &left = a.segments[i], &right = a.segments[i + 1];
        const int gap = right.first - left.last - 1;
        if (gap > parameters_.max_gap)
            return std::min(left.size(), right.size()) < least_outlined
                       ? Candidate{}
                       : outline(line, a.curves[i], a.curves[i + 1], left.last, right.first);
        // A single sample tells nothing of what is beyond the gap beside it.
        if (gap > 0 && std::min(left.size(), right.size()) < 2) return {};
        const Cut cut = adapted_position(line, a, i);              // P 4.2, Fig. 5
        return measure(line, a.curves[i], a.curves[i + 1], cut);   // P 4.2, Fig. 4
    }

    // The one jump of a step that is smeared over a few samples after segment i, and the pixels of these. Returns the
    // segment on its other side, or i where there is none.
    std::size_t smeared_step(const Line<T>& line, const Approximation& a, std::size_t i, Candidate& candidate,
                             std::vector<std::int32_t>& smeared) const {
        const Smear smear = smear_after(line, a, i, parameters_);
        if (smear.next == i) return i;
        const double xa = line.abscissa(smear.before), xb = line.abscissa(smear.after);
        const Cut cut{smear.before, smear.after, (xa + xb) / 2, (smear.before + smear.after) / 2.0, 0, false,
                      a.segments[smear.next].first - a.segments[i].last};
        const Curve &f = a.curves[i], &g = a.curves[smear.next];
        candidate = smear.gap > parameters_.max_gap ? outline(line, f, g, smear.before, smear.after) : measure(line, f, g, cut);
        if (!(candidate.kind & jump_bit)) return i;
        for (int k = smear.before + 1; k < smear.after; ++k)
            if (line.ordinate(k) == line.ordinate(k)) smeared.push_back(static_cast<std::int32_t>(line.path.pixel(k, cols_)));
        return smear.next;
    }

    // The intersection of the two curves nearest the cut becomes the edge position if it is within reach and the
    // samples it passes over fit the curve to which they then belong.
    Cut adapted_position(const Line<T>& line, const Approximation& a, std::size_t i) const {
        const Segment &left = a.segments[i], &right = a.segments[i + 1];
        const double xa = line.abscissa(left.last), xb = line.abscissa(right.first);
        const Cut cut{left.last, right.first, (xa + xb) / 2, (left.last + right.first) / 2.0, 0, false, right.first - left.last};
        const auto meeting = [&](int before, int after, double x, double sample) {
            const double shift = sample - cut.sample;
            return std::abs(shift) > parameters_.max_shift ? cut : Cut{before, after, x, sample, shift, true, 1};
        };
        const double reach = line.x ? HUGE_VAL : parameters_.max_shift + 1;
        double x = 0;
        if (!(parameters_.max_shift > 0)) return cut;
        if (!intersection(a.curves[i], a.curves[i + 1], cut.abscissa, reach, x)) return cut;
        if (x >= xa && x <= xb)
            return meeting(left.last, right.first, x, left.last + (right.first - left.last) * (x - xa) / (xb - xa));
        const bool leftward = x < xa;
        const int step = leftward ? -1 : 1, begin = leftward ? left.last : right.first;
        const int end = leftward ? left.first : right.last;
        const Curve& other = a.curves[leftward ? i + 1 : i];
        for (int k = begin; k != end; k += step) {
            const double at = line.abscissa(k), next = line.abscissa(k + step);
            if (std::abs(line.ordinate(k) - other.value(at)) > line.tolerance_at(k)) return cut;
            if (leftward ? x < next : x > next) continue;
            const int before = leftward ? k - 1 : k;
            return meeting(before, before + 1, x, k + step * (x - at) / (next - at));
        }
        return cut;
    }

    Candidate measure(const Line<T>& line, const Curve& f, const Curve& g, const Cut& cut) const {
        // Both curves at the edge position, or the alternatives: extrapolated from either end point by its own slope.
        const bool endpoint = parameters_.endpoint;
        const double xf = endpoint ? line.abscissa(cut.before) : cut.abscissa;
        const double xg = endpoint ? line.abscissa(cut.after) : cut.abscissa;
        const double mf = f.slope(xf), mg = g.slope(xg);
        const double zf = endpoint ? line.ordinate(cut.before) : f.value(xf);
        const double zg = endpoint ? line.ordinate(cut.after) : g.value(xg);
        const double yf = zf + (endpoint ? mf * (cut.abscissa - xf) : 0);
        const double yg = zg + (endpoint ? mg * (cut.abscissa - xg) : 0);
        const auto tf = line.tangent(xf, zf, mf), tg = line.tangent(xg, zg, mg);
        const double cross = tf.s * tg.r - tf.r * tg.s, dot = tf.s * tg.s + tf.r * tg.r;

        double jump = cut.meeting ? 0 : std::min(std::abs(line.depth(yf) - line.depth(yg)), largest_jump(line, f, g, cut));
        double crease = degrees_of(cross, dot);
        const double sigma = (line.sigma_at(cut.before) + line.sigma_at(cut.after)) / 2;
        const double turn_f = line.turn(tf, zf), turn_g = line.turn(tg, zg);
        const double vf = f.slope_variance(xf), vg = g.slope_variance(xg);
        double jump_significance = std::abs(yf - yg) / (sigma * std::sqrt(f.value_variance(xf) + g.value_variance(xg)));
        double crease_significance =
            crease / (degrees * sigma * std::sqrt(turn_f * turn_f * vf + turn_g * turn_g * vg));
        const double least = std::min(lone_significance, parameters_.min_significance);
        if (!std::isfinite(jump) || !(jump_significance >= least)) jump = jump_significance = 0;
        if (!std::isfinite(crease) || !(crease_significance >= least)) crease = crease_significance = 0;

        // A jump exceeds the error of the approximation, and is significant without its neighbours. The surfaces beside
        // it do not meet: they form no crease.
        const double error = jump_tolerances * std::max(line.tolerance_at(cut.before), line.tolerance_at(cut.after));
        const bool jumps = jump > 0 && std::abs(yf - yg) > error && jump_significance > jump_alone;
        if (jumps && smooth_across(line, cut, std::abs(yf - yg)))
            jump = jump_significance = 0;
        else if (jumps)
            crease = crease_significance = 0;

        Candidate c = placed(line, cut);
        c.jump = static_cast<float>(std::min(jump, static_cast<double>(std::numeric_limits<float>::max())));
        c.crease = static_cast<float>(crease);
        const double significance = jump > 0 ? std::max(jump_significance, crease_significance) : crease_significance;
        c.significance = std::min(static_cast<float>(significance), endless);
        if (jumps && jump > 0)
            c.kind = static_cast<std::uint8_t>(jump_bit | (yf > yg ? occluding_bit : occluded_bit));
        else if (crease > 0)
            c.kind = cross > 0 ? convex_bit : concave_bit;  // the tangent turns away from the viewer
        c.sides[0] = side(line, yf, mf, vf);
        c.sides[1] = side(line, yg, mg, vg);
        return c;
    }

    // The jump at the end of the nearer of two surfaces beside a wide gap.
    Candidate outline(const Line<T>& line, const Curve& f, const Curve& g, int before, int after) const {
        if (!parameters_.shadows) return {};
        const ShadowStep step = step_across_shadow(line, f, g, before, after, parameters_.spaced);
        const double error = jump_tolerances * std::max(line.tolerance_at(before), line.tolerance_at(after));
        if (!(step.significance > jump_alone) || !(step.difference > error)) return {};
        // Half a sample beyond it.
        const double sample = step.before_nearer ? before + 0.5 : after - 0.5;
        Candidate c = placed(line, {before, after, 0, sample, 0, false, 0});
        c.jump = static_cast<float>(std::min(step.jump, static_cast<double>(std::numeric_limits<float>::max())));
        c.significance = std::min(static_cast<float>(step.significance), endless);
        c.kind = static_cast<std::uint8_t>(jump_bit | (step.before_nearer ? occluding_bit : occluded_bit));
        return c;
    }

    Candidate placed(const Line<T>& line, const Cut& cut) const {
        Candidate c{};
        c.x = static_cast<float>(line.path.col + cut.sample * line.path.dcol);
        c.y = static_cast<float>(line.path.row + cut.sample * line.path.drow);
        c.shift = static_cast<float>(cut.shift);
        c.direction = static_cast<std::uint8_t>(direction_);
        c.before = static_cast<std::int32_t>(line.path.pixel(cut.before, cols_));
        c.after = static_cast<std::int32_t>(line.path.pixel(cut.after, cols_));
        const double w = line.start + line.step * cut.abscissa;
        for (int i = 0; i < 2; ++i) c.along[i] = static_cast<float>(line.along[i]);
        c.place[0] = static_cast<float>(w * line.along[0] - line.across * line.along[1]);
        c.place[1] = static_cast<float>(w * line.along[1] + line.across * line.along[0]);
        return c;
    }

    // Whether the samples across the cut run on too smoothly for a step of that size, which curves that do not quite
    // follow them pretend. A sharp step has third differences of twice its size, an even ramp over n samples of step / 2n.
    static bool smooth_across(const Line<T>& line, const Cut& cut, double step) {
        const int first = std::max(cut.before - 2, 0), last = std::min(cut.after + 2, line.path.size - 1);
        double most = 0;
        for (int k = first; k + 3 <= last; ++k) {
            const double third = line.ordinate(k + 3) - 3 * (line.ordinate(k + 2) - line.ordinate(k + 1)) - line.ordinate(k);
            if (!(std::abs(third) <= HUGE_VAL)) return false;  // no data
            most = std::max(most, std::abs(third));
        }
        return last - first >= 3 && most < step / (2.5 * cut.steps - 1.5);
    }

    // Between the depths at the samples beside the cut, and what either curve adds to them on the way to it: no more
    // than it changes over the last sample before. Over a wide gap, or close to the horizon, a curve runs away.
    static double largest_jump(const Line<T>& line, const Curve& f, const Curve& g, const Cut& cut) {
        const double xf = line.abscissa(cut.before), xg = line.abscissa(cut.after);
        const double zf = line.depth(f.value(xf)), zg = line.depth(g.value(xg));
        const double spacing = (xg - xf) / (cut.after - cut.before), reach = std::min(spacing, (xg - xf) / 2);
        return std::abs(zf - zg) + std::abs(zf - line.depth(f.value(xf - reach))) +
               std::abs(zg - line.depth(g.value(xg + reach)));
    }

    static Side side(const Line<T>& line, double value, double slope, double variance) {
        return {static_cast<float>(value), static_cast<float>(slope * line.per_step),
                std::min(static_cast<float>(variance * line.per_step * line.per_step), endless)};
    }

    int cols_;
    Parameters parameters_;
    LineReader<T> reader_;
    int direction_;
};

}  // namespace

template <class T>
std::vector<Candidate> detect(const RangeImage<T>& image, const Noise& noise, const Parameters& parameters,
                              std::uint8_t* smeared) {
    // Neighbouring lines of one direction. Any thread may take any part: they are many, and what they cost differs.
    struct Part {
        int direction, first, count;
        Found found;
    };
    std::vector<Part> parts;
    for (const int direction : {rows_bit, cols_bit, diag45_bit, diag135_bit}) {
        const int lines = parameters.directions & direction ? line_count(direction, image.rows, image.cols) : 0;
        for (int first = 0; first < lines; first += strip_lines)
            parts.push_back({direction, first, std::min(strip_lines, lines - first), {}});
    }
    constexpr int parts_per_thread = 8;  // for fewer another thread is not worth starting
    Team team(std::min(parameters.threads, 1 + static_cast<int>(parts.size()) / parts_per_thread));
    std::atomic<std::size_t> taken{0};
    team.run([&](int) {
        Strip<T> strip;
        Approximator<T> approximator(parameters);
        Found found;
        for (std::size_t i; (i = taken++) < parts.size();) {
            Part& part = parts[i];
            const LineDetector<T> detector(image, noise, parameters, part.direction);
            detector.read(part.first, part.count, strip);
            found.clear();
            detector.detect(strip, approximator, found);
            part.found = found;
        }
    });
    std::vector<const std::vector<std::int32_t>*> smeared_pixels;
    for (const Part& part : parts) smeared_pixels.push_back(&part.found.smeared);
    int directions = 0;
    for (const int direction : {rows_bit, cols_bit, diag45_bit, diag135_bit}) directions += (parameters.directions & direction) != 0;
    const SmearMask mask(image.rows, image.cols, smeared_pixels, directions);
    if (smeared) mask.write(smeared);
    std::int32_t order = 0;
    for (Part& part : parts) {
        mask.clear_of_candidates(part.found.candidates);
        for (Candidate& c : part.found.candidates) c.order = order++;
    }
    std::vector<Candidate> candidates(static_cast<std::size_t>(order));
    Cells cells(image.rows, image.cols);
    for (const Part& part : parts) cells.count(part.found.candidates);
    for (const Part& part : parts)
        cells.place(part.found.candidates, [&](const Candidate& c, std::size_t k) { candidates[k] = c; });
    parts.clear();
    pool(candidates, image, parameters, team);
    return candidates;
}

void put_in_order(std::vector<Candidate>& candidates) {
    std::sort(candidates.begin(), candidates.end(),
              [](const Candidate& a, const Candidate& b) { return a.order < b.order; });
}

void combine(const std::vector<Candidate>& candidates, float* jump, float* crease, std::uint8_t* kind,
             float* significance) {
    constexpr int jump_bits = jump_bit | occluding_bit | occluded_bit, crease_bits = convex_bit | concave_bit;
    for (const Candidate& c : candidates)
        for (const std::int32_t p : {c.before, c.after}) {
            jump[p] = std::max(jump[p], c.jump);
            if (!(c.kind & jump_bit)) continue;
            const bool nearer = ((c.kind & occluding_bit) != 0) == (p == c.before);
            kind[p] = static_cast<std::uint8_t>(kind[p] | jump_bit | (nearer ? occluding_bit : occluded_bit));
            significance[p] = std::max(significance[p], c.significance);
        }
    // Surfaces either meet at a pixel or do not: of jumps and creases there, the most significant candidate decides.
    for (const Candidate& c : candidates)
        for (const std::int32_t p : {c.before, c.after})
            if (c.crease > 0 && c.significance > significance[p]) kind[p] = static_cast<std::uint8_t>(kind[p] & ~jump_bits);
    for (const Candidate& c : candidates)
        for (const std::int32_t p : {c.before, c.after}) {
            if (kind[p] & jump_bit) continue;
            significance[p] = std::max(significance[p], c.significance);
            if (c.crease > crease[p] || (c.crease > 0 && c.crease == crease[p] && (c.kind & convex_bit))) {
                crease[p] = c.crease;
                kind[p] = static_cast<std::uint8_t>((kind[p] & ~crease_bits) | (c.kind & crease_bits));
            }
        }
}

template std::vector<Candidate> detect(const RangeImage<float>&, const Noise&, const Parameters&, std::uint8_t*);
template std::vector<Candidate> detect(const RangeImage<double>&, const Noise&, const Parameters&, std::uint8_t*);

}  // namespace rangeedge
