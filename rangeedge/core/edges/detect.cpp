// SPDX-License-Identifier: Apache-2.0
#include "edges/detect.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "base/parallel.hpp"
#include "edges/cells.hpp"
#include "edges/neighbours.hpp"
#include "edges/position.hpp"
#include "edges/strength.hpp"
#include "scanline/approximation.hpp"
#include "scanline/reader.hpp"

namespace rangeedge {
namespace {

constexpr double lone_significance = 3;   // standard deviations that a candidate needs by itself, before its neighbours
constexpr double jump_significance = 8;   // standard deviations that a jump needs by itself
constexpr double jump_tolerances = 2;     // tolerances of splitting that a jump exceeds, the error of approximation

template <class T>
class LineDetector {
public:
    LineDetector(const Frame<T>& frame, const ScanLineOptions& options, int direction)
        : options_(options), reader_(frame, options), direction_(direction) {}

    void read(int first, int count, Strip<T>& strip) const { reader_.read(direction_, first, count, strip); }

    void detect(const Strip<T>& strip, Approximator<T>& approximator, std::vector<Candidate>& candidates) const {
        approximator.approximate(strip);  // paper, 4.1
        for (std::size_t i = 0; i < strip.lines.size(); ++i)
            detect(strip.lines[i], approximator.line(static_cast<std::ptrdiff_t>(i)), candidates);
    }

private:
    void detect(const Line<T>& line, const Approximation& a, std::vector<Candidate>& candidates) const {
        for (std::ptrdiff_t i = 0; i + 1 < a.count; ++i) {
            if (a.segments[i + 1].first - a.segments[i].last - 1 > options_.max_gap) continue;
            const Position edge = adapted_position(line, a, i, options_.max_shift);         // paper, 4.2, Fig. 5
            const Candidate candidate = measure(line, a, i, edge);  // paper, 4.2, Fig. 4
            if (candidate.jump > 0 || candidate.crease > 0) candidates.push_back(candidate);
        }
    }

    Candidate measure(const Line<T>& line, const Approximation& a, std::ptrdiff_t i, const Position& edge) const {
        const Curve &f = a.curves[i], &g = a.curves[i + 1];
        const double x = edge.abscissa;
        const EdgeSide f1 = options_.endpoint ? from_endpoint(line, f, edge.before, x) : at_midpoint(line, f, x);
        const EdgeSide f2 = options_.endpoint ? from_endpoint(line, g, edge.after, x) : at_midpoint(line, g, x);
        double jump = edge.intersects ? 0 : jump_strength(line, f1, f2);
        double crease = crease_strength(f1, f2);

        const SideDeviation d1 = deviation_of(line, f1, edge.before, a.segments[i].size());
        const SideDeviation d2 = deviation_of(line, f2, edge.after, a.segments[i + 1].size());
        const double difference = std::abs(f1.ordinate - f2.ordinate);
        const double of_jump = difference / jump_deviation(d1.value, d2.value);
        const double of_crease = crease / crease_deviation(f1, d1.slope, f2, d2.slope);
        double shared_jump = difference / jump_deviation(d1.shared_value, d2.shared_value);
        double shared_crease = crease / crease_deviation(f1, d1.shared_slope, f2, d2.shared_slope);
        const double least = std::min(lone_significance, options_.min_significance);
        if (!std::isfinite(jump) || !(of_jump >= least)) jump = shared_jump = 0;
        if (!std::isfinite(crease) || !(of_crease >= least)) crease = shared_crease = 0;

        Candidate c{};
        c.jump = static_cast<float>(std::min(jump, static_cast<double>(std::numeric_limits<float>::max())));
        c.crease = static_cast<float>(crease);
        const double significance = jump > 0 ? std::max(shared_jump, shared_crease) : shared_crease;
        c.significance = std::min(static_cast<float>(significance), endless);
        const double tolerance = std::max(line.tolerance_at(edge.before), line.tolerance_at(edge.after));
        if (jump > 0 && difference > jump_tolerances * tolerance && of_jump > jump_significance)
            c.kind |= static_cast<std::uint8_t>(jump_bit | (f1.ordinate > f2.ordinate ? occluding_bit : occluded_bit));
        if (crease > 0) c.kind |= is_convex(f1, f2) ? convex_bit : concave_bit;
        locate(c, line, edge);
        c.sides[0] = side(line, f1, d1);
        c.sides[1] = side(line, f2, d2);
        return c;
    }

    void locate(Candidate& c, const Line<T>& line, const Position& edge) const {
        c.x = static_cast<float>(line.path.col + edge.sample * line.path.dcol);
        c.y = static_cast<float>(line.path.row + edge.sample * line.path.drow);
        c.shift = static_cast<float>(edge.shift);
        c.direction = static_cast<std::uint8_t>(direction_);
        c.before = static_cast<std::int32_t>(line.pixel(edge.before));
        c.after = static_cast<std::int32_t>(line.pixel(edge.after));
        const double w = line.start + line.step * edge.abscissa, *d = line.direction;
        for (int i = 0; i < 2; ++i) c.plane_direction[i] = static_cast<float>(d[i]);
        c.plane_position[0] = static_cast<float>(w * d[0] - line.offset * d[1]);
        c.plane_position[1] = static_cast<float>(w * d[1] + line.offset * d[0]);
    }

    static Side side(const Line<T>& line, const EdgeSide& f, const SideDeviation& d) {
        const double deviation = d.slope * line.per_step;
        return {static_cast<float>(f.ordinate), static_cast<float>(f.slope * line.per_step),
                std::min(static_cast<float>(deviation * deviation), endless)};
    }

    const ScanLineOptions& options_;
    LineReader<T> reader_;
    int direction_;
};

// Neighbouring lines of one direction, and the candidates on them.
struct Part {
    int direction, first, count;
    std::vector<Candidate> found;
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

}  // namespace

template <class T>
std::vector<Candidate> find_candidates(const Frame<T>& frame, const ScanLineOptions& options, int threads) {
    std::vector<Part> parts = parts_of(options.directions, frame.rows, frame.cols);
    constexpr int parts_per_thread = 8;  // for fewer another thread is not worth starting
    Team team(std::min(threads, 1 + static_cast<int>(parts.size()) / parts_per_thread));
    // Any thread may take any part: they are many, and what they cost differs.
    std::atomic<std::size_t> taken{0};
    team.run([&](int) {
        Strip<T> strip;
        Approximator<T> approximator(options);
        std::vector<Candidate> found;
        for (std::size_t i; (i = taken++) < parts.size();) {
            Part& part = parts[i];
            const LineDetector<T> detector(frame, options, part.direction);
            detector.read(part.first, part.count, strip);
            found.clear();
            detector.detect(strip, approximator, found);
            part.found.assign(found.begin(), found.end());
        }
    });
    std::int32_t order = 0;
    for (Part& part : parts)
        for (Candidate& c : part.found) c.order = order++;
    std::vector<Candidate> candidates(static_cast<std::size_t>(order));
    Cells cells(frame.rows, frame.cols);
    for (const Part& part : parts) cells.count(part.found);
    for (const Part& part : parts)
        cells.assign(part.found, [&](const Candidate& c, std::size_t k) { candidates[k] = c; });
    parts.clear();
    join_neighbours(candidates, frame, options, team);
    return candidates;
}

void put_in_order(std::vector<Candidate>& candidates) {
    std::sort(candidates.begin(), candidates.end(),
              [](const Candidate& a, const Candidate& b) { return a.order < b.order; });
}

template std::vector<Candidate> find_candidates(const Frame<float>&, const ScanLineOptions&, int);
template std::vector<Candidate> find_candidates(const Frame<double>&, const ScanLineOptions&, int);

}  // namespace rangeedge
