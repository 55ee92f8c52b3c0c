// SPDX-License-Identifier: Apache-2.0
#include "edges/detect.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "base/parallel.hpp"
#include "edges/neighbours.hpp"
#include "edges/position.hpp"
#include "edges/shadow.hpp"
#include "edges/smear.hpp"
#include "edges/strength.hpp"
#include "edges/trace.hpp"
#include "scanline/approximation.hpp"
#include "scanline/reader.hpp"

namespace rangeedge {
namespace {

constexpr double lone_jump = 8;        // standard deviations that a jump needs by itself
constexpr double jump_tolerances = 2;  // tolerances of splitting that a jump exceeds, the error of approximation
constexpr int least_outlined = 3;      // samples of a surface beside a wide gap

// Candidates of some lines, and the pixels over which steps are smeared there.
struct Found {
    CandidateList candidates;
    std::vector<std::int32_t> smeared;
};

template <class T>
class LineDetector {
public:
    // `trace`, unless null, receives the cuts with what their tests compare.
    LineDetector(const Frame<T>& frame, const ScanLineOptions& options, int direction,
                 std::vector<CutTrace>* trace = nullptr)
        : options_(options), reader_(frame, options), direction_(direction), trace_(trace) {}

    void read(int first, int count, Strip<T>& strip) const { reader_.read(direction_, first, count, strip); }

    void detect(const Strip<T>& strip, Approximator<T>& approximator, Found& found) const {
        approximator.approximate(strip);  // paper, 4.1
        for (std::size_t i = 0; i < strip.lines.size(); ++i)
            detect(strip.lines[i], approximator.line(static_cast<std::ptrdiff_t>(i)), found);
    }

private:
    void detect(const Line<T>& line, const Approximation& a, Found& found) const {
        for (std::ptrdiff_t i = 0; i + 1 < a.count;) {
            Candidate candidate{};
            std::ptrdiff_t next = measure_smeared(line, a, i, candidate, found.smeared);
            if (next == i) candidate = measure_cut(line, a, i), next = i + 1;
            if (candidate.jump > 0 || candidate.crease > 0) found.candidates.push_back(candidate);
            i = next;
        }
    }

    Candidate measure_cut(const Line<T>& line, const Approximation& a, std::ptrdiff_t i) const {
        const Segment &left = a.segments[i], &right = a.segments[i + 1];
        const int gap = right.first - left.last - 1, shorter = std::min(left.size(), right.size());
        if (gap > options_.max_gap) {
            if (shorter < least_outlined) return {};
            return measure_outline(line, a, i, i + 1, left.last, right.first);
        }
        if (gap > 0 && shorter < 2) return {};  // a single sample tells nothing of what is beyond a gap
        const Position edge = adapted_position(line, a, i, options_.max_shift);  // paper, 4.2, Fig. 5
        return measure(line, a, i, i + 1, edge, gap + 1);                        // paper, 4.2, Fig. 4
    }

    // The jump of a smeared step after segment i; `smeared` receives its pixels. Returns the segment on its other side,
    // or i where there is none.
    std::ptrdiff_t measure_smeared(const Line<T>& line, const Approximation& a, std::ptrdiff_t i, Candidate& candidate,
                                   std::vector<std::int32_t>& smeared) const {
        const SmearedStep step = smeared_step(line, a, i, options_);
        if (step.next == i) return i;
        const double x = (line.abscissa(step.before) + line.abscissa(step.after)) / 2;
        const Position edge{step.before, step.after, x, (step.before + step.after) / 2.0, 0, false};
        const int samples = a.segments[step.next].first - a.segments[i].last;
        const std::size_t traced = trace_ ? trace_->size() : 0;
        candidate = step.gap > options_.max_gap ? measure_outline(line, a, i, step.next, step.before, step.after)
                                                : measure(line, a, i, step.next, edge, samples);
        if (!(candidate.kind & jump_bit)) {
            if (trace_) trace_->resize(traced);
            return i;
        }
        // The middle of the ramp is where the rim of the nearer surface is.
        const double middle = (line.abscissa(step.low) + line.abscissa(step.high)) / 2;
        locate(candidate, line, {step.low, step.high, middle, (step.low + step.high) / 2.0, 0, false});
        candidate.smeared = true;
        if (trace_)
            trace_->back().smeared = 1, trace_->back().cut = trace_->back().sample = (step.low + step.high) / 2.0;
        for (int k = step.before + 1; k < step.after; ++k)
            if (line.ordinate(k) == line.ordinate(k) && line.has_data(k))
                smeared.push_back(static_cast<std::int32_t>(line.pixel(k)));
        return step.next;
    }

    // The jump at the end of the nearer of two surfaces, half a sample beyond it.
    Candidate measure_outline(const Line<T>& line, const Approximation& a, std::ptrdiff_t i, std::ptrdiff_t j,
                              int before, int after) const {
        if (!options_.shadows) return {};
        const ShadowStep step = step_across_shadow(line, a.fit(i), a.fit(j), before, after, options_.spaced);
        const bool jumps = is_jump(line, before, after, step.difference, step.difference / step.deviation);
        if (trace_) {
            CutTrace t{};
            t.cut = t.sample = step.before_nearer ? before + 0.5 : after - 0.5;
            t.before = before, t.after = after, t.jump = step.jump, t.difference = step.difference;
            t.tolerance = std::max(line.tolerance_at(before), line.tolerance_at(after));
            t.jump_single = step.difference / step.deviation, t.jump_shared = step.difference / step.shared_deviation;
            t.jumps = t.candidate = jumps, t.outline = 1;
            trace_->push_back(t);
        }
        if (!jumps) return {};
        Candidate c{};
        c.jump = within_range(std::min(step.jump, largest_jump(line, before, after)));
        c.significance = std::min(static_cast<float>(step.difference / step.shared_deviation), endless);
        c.kind = static_cast<std::uint8_t>(jump_bit | (step.before_nearer ? occluding_bit : occluded_bit));
        locate(c, line, {before, after, 0, step.before_nearer ? before + 0.5 : after - 0.5, 0, false});
        return c;
    }

    // A jump exceeds the error of the approximation, and is significant without its neighbours.
    static bool is_jump(const Line<T>& line, int before, int after, double difference, double significance) {
        const double tolerance = std::max(line.tolerance_at(before), line.tolerance_at(after));
        return difference > jump_tolerances * tolerance && significance > lone_jump;
    }

    static float within_range(double jump) {
        return static_cast<float>(std::min(jump, static_cast<double>(std::numeric_limits<float>::max())));
    }

    // From segment i to segment j, it is `steps` samples.
    Candidate measure(const Line<T>& line, const Approximation& a, std::ptrdiff_t i, std::ptrdiff_t j,
                      const Position& edge, int steps) const {
        const Curve &f = a.curves[i], &g = a.curves[j];
        const double x = edge.abscissa;
        const EdgeSide f1 = options_.endpoint ? from_endpoint(line, f, edge.before, x) : at_position(line, f, x);
        const EdgeSide f2 = options_.endpoint ? from_endpoint(line, g, edge.after, x) : at_position(line, g, x);
        double jump = edge.intersects ? 0 : jump_strength(line, x, f1, f2);
        if (jump > 0) jump = std::min(jump, largest_jump(line, edge.before, edge.after));

        const int n1 = a.segments[i].size(), n2 = a.segments[j].size();
        const FitNoise& noise = *line.noise;
        const double sigma1 = line.noise_at(edge.before).of_fit(n1), sigma2 = line.noise_at(edge.after).of_fit(n2);
        const FitDeviation slope1 = slope_deviation(noise, sigma1, n1, f1.slope_variance);
        const FitDeviation slope2 = slope_deviation(noise, sigma2, n2, f2.slope_variance);
        const FitDeviation of_jump = jump_deviation(value_deviation(noise, sigma1, n1, f1.value_variance),
                                                    value_deviation(noise, sigma2, n2, f2.value_variance));
        const FitDeviation of_crease = crease_deviation(f1, slope1, f2, slope2);
        const double difference = std::abs(f1.ordinate - f2.ordinate);
        double jump_significance = difference / of_jump.shared;
        const double seen_jump = jump;
        const double least = std::min(lone_significance, options_.min_significance);
        if (!std::isfinite(jump) || !(difference >= least * of_jump.single)) jump = jump_significance = 0;
        bool jumps = jump > 0 && is_jump(line, edge.before, edge.after, difference, difference / of_jump.single);
        const bool smooth = jumps && is_smooth(line, edge.before, edge.after, steps, difference);
        if (smooth) jump = jump_significance = 0, jumps = false;
        const double step = (line.abscissa(edge.after) - line.abscissa(edge.before)) / (edge.after - edge.before);
        const double bend = std::abs(f1.slope - f2.slope) * step;
        const bool bends = (!jumps || trace_) && bends_smoothly(line, edge.before, edge.after, bend);
        double crease = 0, crease_significance = 0;
        if (!jumps && !bends && may_exceed(f1, f2, least * of_crease.single)) {
            crease = crease_strength(f1, f2);
            if (!std::isfinite(crease) || !(crease >= least * of_crease.single)) crease = 0;
            crease_significance = crease / of_crease.shared;
        }
        if (trace_) {
            const double seen_crease = crease_strength(f1, f2);
            CutTrace t{};
            t.cut = edge.sample - edge.shift, t.sample = edge.sample;
            t.before = edge.before, t.after = edge.after, t.jump = seen_jump, t.crease = seen_crease;
            t.difference = difference;
            t.tolerance = std::max(line.tolerance_at(edge.before), line.tolerance_at(edge.after));
            t.jump_single = difference / of_jump.single, t.jump_shared = difference / of_jump.shared;
            t.crease_single = seen_crease / of_crease.single, t.crease_shared = seen_crease / of_crease.shared;
            t.jumps = jumps, t.smooth = smooth, t.bends = bends, t.convex = is_convex(f1, f2);
            t.candidate = jump > 0 || crease > 0;
            trace_->push_back(t);
        }

        Candidate c{};
        if (!(jump > 0 || crease > 0)) return c;
        c.jump = within_range(jump);
        c.crease = static_cast<float>(crease);
        // A jump that is none by itself says nothing of a crease.
        const double significance = crease > 0 ? crease_significance : jump_significance;
        c.significance = std::min(static_cast<float>(significance), endless);
        if (jumps)
            c.kind |= static_cast<std::uint8_t>(jump_bit | (f1.ordinate > f2.ordinate ? occluding_bit : occluded_bit));
        if (crease > 0) c.kind |= is_convex(f1, f2) ? convex_bit : concave_bit;
        locate(c, line, edge);
        c.spread = within_range(of_jump.single / bend);
        c.sides[0] = side(line, x, f1, slope1.single);
        c.sides[1] = side(line, x, f2, slope2.single);
        return c;
    }

    void locate(Candidate& c, const Line<T>& line, const Position& edge) const {
        c.x = static_cast<float>(line.path.col + edge.sample * line.path.dcol);
        c.y = static_cast<float>(line.path.row + edge.sample * line.path.drow);
        c.shift = static_cast<float>(edge.shift);
        c.direction = static_cast<std::uint8_t>(direction_);
        c.before = static_cast<std::int32_t>(line.pixel_with_data(edge.before, -1));
        c.after = static_cast<std::int32_t>(line.pixel_with_data(edge.after, 1));
        const double w = line.start + line.step * edge.abscissa, *d = line.direction;
        if (line.curved) {
            const PlaneImage image(line.rays, w);
            for (int i = 0; i < 2; ++i) {
                c.plane_direction[i] = static_cast<float>(image.direction[i]);
                c.plane_position[i] = static_cast<float>(image.position[i]);
            }
            return;
        }
        for (int i = 0; i < 2; ++i) c.plane_direction[i] = static_cast<float>(d[i]);
        c.plane_position[0] = static_cast<float>(w * d[0] - line.offset * d[1]);
        c.plane_position[1] = static_cast<float>(w * d[1] + line.offset * d[0]);
    }

    static Side side(const Line<T>& line, double x, const EdgeSide& f, double slope_deviation) {
        const double deviation = slope_deviation * line.per_step;
        if (line.curved) {
            const PlaneImage image(line.rays, line.start + line.step * x);
            const double seen = deviation * image.by_slope;
            return {static_cast<float>(image.by_value * f.ordinate),
                    static_cast<float>(image.slope(f.ordinate, f.slope * line.per_step)),
                    std::min(static_cast<float>(seen * seen), endless)};
        }
        return {static_cast<float>(f.ordinate), static_cast<float>(f.slope * line.per_step),
                std::min(static_cast<float>(deviation * deviation), endless)};
    }

    const ScanLineOptions& options_;
    LineReader<T> reader_;
    int direction_;
    std::vector<CutTrace>* trace_;
};

// Neighbouring lines of one direction, and the candidates on them.
struct Part {
    int direction, first, count;
    Found found;
};

std::vector<Part> parts_of(int directions, int rows, int cols) {
    std::vector<Part> parts;
    for (const int direction : all_directions) {
        const int lines = directions & direction ? line_count(direction, rows, cols) : 0;
        for (int first = 0; first < lines; first += strip_lines)
            parts.push_back({direction, first, std::min(strip_lines, lines - first), {}});
    }
    return parts;
}

// Leaves no candidates on smeared pixels. Every direction has a chance to find these.
void clear_smear(std::vector<Part>& parts, int rows, int cols, int directions, Team& team, std::uint8_t* smeared) {
    std::vector<std::int32_t> pixels;
    Checkpoints checkpoints(64);
    for (const Part& part : parts) {
        checkpoints.pass();
        pixels.insert(pixels.end(), part.found.smeared.begin(), part.found.smeared.end());
    }
    int count = 0;
    for (const int direction : all_directions) count += (directions & direction) != 0;
    const SmearMask mask(rows, cols, pixels, count);
    parallel_each(static_cast<int>(parts.size()), team,
                  [&](int i, int) { mask.clear_of_candidates(parts[static_cast<std::size_t>(i)].found.candidates); });
    if (smeared) mask.write(smeared);
}

}  // namespace

template <class T>
CandidateList find_candidates(const Frame<T>& frame, const ScanLineOptions& options, Team& team, std::uint8_t* smeared,
                              CandidateList* weak) {
    std::vector<Part> parts = parts_of(options.directions, frame.rows, frame.cols);
    // Any thread may take any part: they are many, and what they cost differs.
    std::atomic<std::size_t> taken{0};
    team.run([&](int) {
        Strip<T> strip;
        Approximator<T> approximator(options);
        Found found;
        for (std::size_t i; (i = taken++) < parts.size();) {
            Watch::checkpoint();
            Part& part = parts[i];
            const LineDetector<T> detector(frame, options, part.direction);
            detector.read(part.first, part.count, strip);
            found.candidates.clear(), found.smeared.clear();
            detector.detect(strip, approximator, found);
            part.found = found;
        }
    });
    clear_smear(parts, frame.rows, frame.cols, options.directions, team, smeared);
    std::vector<const Candidate*> found;
    for (const Part& part : parts)
        for (const Candidate& c : part.found.candidates) found.push_back(&c);
    NeighbourGrid grid(frame.rows, frame.cols, team);
    CandidateList candidates = in_place(found, grid);
    parts.clear();
    join_neighbours(candidates, grid, frame, options, weak);
    return candidates;
}

template <class T>
LineTrace trace_line(const Frame<T>& frame, const ScanLineOptions& options, int direction, int col, int row) {
    LineTrace trace;
    const LineDetector<T> detector(frame, options, direction, &trace.cuts);
    Strip<T> strip;
    Approximator<T> approximator(options);
    Found found;
    const auto passes = [&](int i) {
        const Path p = line_path(direction, i, frame.rows, frame.cols);
        const int k = p.dcol ? (col - p.col) * p.dcol : (row - p.row) * p.drow;
        return k >= 0 && k < p.size && p.col + k * p.dcol == col && p.row + k * p.drow == row;
    };
    int index = 0;
    while (!passes(index)) ++index;
    detector.read(index, 1, strip);
    detector.detect(strip, approximator, found);
    const Line<T>& line = strip.lines.front();
    for (int k = 0; k < line.path.size; ++k) {
        const double x = line.abscissa(k), tolerance = line.tolerance_at(k);
        const double y = line.has_data(k) ? line.ordinate(k) : NAN;
        const double z = line.depth(y, x), off = std::abs(line.depth(y + tolerance, x) - z);
        trace.samples.push_back({double(line.path.col + k * line.path.dcol), double(line.path.row + k * line.path.drow),
                                 x, y, z, NAN, NAN, tolerance, off});
    }
    const Approximation a = approximator.line(0);
    for (std::ptrdiff_t i = 0; i < a.count; ++i) {
        const Segment& s = a.segments[i];
        const Curve& f = a.curves[i];
        trace.segments.push_back(
            {double(s.first), double(s.last), f.mean, f.c2, f.c1 - f.alpha * f.c2, f.base + f.c0 - f.beta * f.c2});
        for (int k = s.first; k <= s.last; ++k) {
            SampleTrace& sample = trace.samples[static_cast<std::size_t>(k)];
            sample.fitted = f.value(sample.abscissa);
            sample.fitted_depth = line.depth(sample.fitted, sample.abscissa);
        }
    }
    return trace;
}

void put_in_order(CandidateList& candidates) {
    Checkpoints checkpoints;
    std::sort(candidates.begin(), candidates.end(), [&](const Candidate& a, const Candidate& b) {
        checkpoints.pass();
        return a.order < b.order;
    });
}

#define RANGEEDGE_INSTANTIATE(T)                                                                          \
    template CandidateList find_candidates(const Frame<T>&, const ScanLineOptions&, Team&, std::uint8_t*, \
                                           CandidateList*);                                               \
    template LineTrace trace_line(const Frame<T>&, const ScanLineOptions&, int, int, int);
RANGEEDGE_INSTANTIATE(float)
RANGEEDGE_INSTANTIATE(double)

}  // namespace rangeedge
