// SPDX-License-Identifier: Apache-2.0
#include "chains/pieces.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/watch.hpp"
#include "edges/neighbourhood.hpp"

namespace rangeedge {
namespace {

constexpr double farthest = 1.7;        // pixels from a candidate to the path that it belongs to
constexpr double least_crossing = 0.3;  // sine of the angle between a scan line and a path of which it tells the sides
constexpr int vote_reach = 2;           // pixels on either side that vote for a pixel's class
constexpr int least_run = 4;            // pixels of one class

using Votes = std::array<float, 7>;

// The tangent of a path at one of its pixels.
Point tangent(const Tracing& tracing, const LinePath& path, std::ptrdiff_t i, int cols) {
    const std::ptrdiff_t a = std::max(i - vote_reach, path.first), b = std::min(i + vote_reach, path.end - 1);
    const std::int32_t p = tracing.pixels[a], q = tracing.pixels[b];
    const double dx = q % cols - p % cols, dy = q / cols - p / cols, length = std::hypot(dx, dy);
    return length > 0 ? Point{dx / length, dy / length} : Point{1, 0};
}

EdgeClass class_of(const Candidate& c, const Point& along) {
    const bool outlines = (c.kind & boundary_bit) != 0;
    if (!(c.kind & jump_bit) && !outlines) {
        if (!(c.crease > 0)) return EdgeClass::none;
        return c.kind & convex_bit ? EdgeClass::convex : EdgeClass::concave;
    }
    const Point step = scan_step(c);
    const double leftward = step.x * along.y - step.y * along.x;
    if (std::abs(leftward) < least_crossing) return EdgeClass::none;
    const bool left = (leftward < 0) == ((c.kind & occluding_bit) != 0);
    if (outlines) return left ? EdgeClass::outline : EdgeClass::outline_right;
    return left ? EdgeClass::jump : EdgeClass::jump_right;
}

class Divider {
public:
    Divider(const CandidateList& candidates, const Tracing& tracing, const Crossings& crossings,
            const std::uint8_t* kinds, int cols)
        : candidates_(candidates), tracing_(tracing), crossings_(crossings), kinds_(kinds), cols_(cols) {}

    std::vector<Piece> divide() {
        Checkpoints checkpoints(64);
        for (const LinePath& path : tracing_.paths) {
            checkpoints.pass();
            divide(path);
        }
        return std::move(pieces_);
    }

private:
    void divide(const LinePath& path) {
        classify(path);
        const std::ptrdiff_t n = path.end - path.first;
        for (std::ptrdiff_t i = 0, end; i < n; i = end) {
            end = i + 1;
            while (end < n && classes_[end] == classes_[i]) ++end;
            if (classes_[i] == EdgeClass::none || end - i < least_run) continue;
            Piece piece{{}, classes_[i], path.closed && end - i == n};
            for (std::ptrdiff_t k = i; k < end; ++k) piece.members.push_back(static_cast<std::int32_t>(path.first + k));
            if (piece.type == EdgeClass::jump_right || piece.type == EdgeClass::outline_right) {
                std::reverse(piece.members.begin(), piece.members.end());
                piece.type = piece.type == EdgeClass::jump_right ? EdgeClass::jump : EdgeClass::outline;
            }
            pieces_.push_back(std::move(piece));
        }
    }

    // The class of every pixel of a path, by the votes around it.
    void classify(const LinePath& path) {
        const std::ptrdiff_t n = path.end - path.first;
        votes_.assign(n, Votes{});
        classes_.assign(n, EdgeClass::none);
        for (std::ptrdiff_t i = 0; i < n; ++i) {
            const std::ptrdiff_t place = path.first + i;
            const Point along = tangent(tracing_, path, place, cols_);
            const int kind = kinds_[tracing_.pixels[place]];
            for (std::int32_t k = crossings_.first[place]; k < crossings_.first[place + 1]; ++k) {
                const Candidate& c = candidates_[static_cast<std::size_t>(crossings_.candidates[k])];
                if ((c.kind & jump_bit) == (kind & jump_bit))
                    votes_[i][static_cast<std::size_t>(class_of(c, along))] += 1;
            }
        }
        for (std::ptrdiff_t i = 0; i < n; ++i) {
            Votes sum{};
            for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(i - vote_reach, 0); k <= std::min(i + vote_reach, n - 1);
                 ++k)
                for (std::size_t c = 1; c < sum.size(); ++c) sum[c] += votes_[k][c];
            const auto most = std::max_element(sum.begin() + 1, sum.end());
            if (*most > 0) classes_[i] = static_cast<EdgeClass>(most - sum.begin());
        }
    }

    const CandidateList& candidates_;
    const Tracing& tracing_;
    const Crossings& crossings_;
    const std::uint8_t* kinds_;
    int cols_;
    Array<Votes> votes_;
    Array<EdgeClass> classes_;
    std::vector<Piece> pieces_;
};

}  // namespace

Point scan_step(const Candidate& c) {
    const Step step = step_of(c.direction);
    return {static_cast<double>(step.dcol), static_cast<double>(step.drow)};
}

Crossings assign_candidates(const CandidateList& candidates, const Tracing& tracing, int rows, int cols) {
    Array<std::int32_t> nearest(static_cast<std::ptrdiff_t>(candidates.size()), -1);
    Crossings result;
    result.first.resize(tracing.pixels.size() + 1, 0);
    Checkpoints checkpoints;
    for (std::ptrdiff_t i = 0; i < nearest.size(); ++i) {
        checkpoints.pass();
        const Candidate& c = candidates[static_cast<std::size_t>(i)];
        // The line along a jump lies on its nearer side, which a smeared step is far from, and an outline on that of
        // the data.
        const std::int32_t near = c.kind & occluding_bit ? c.before : c.after;
        const bool jumps = c.kind & (jump_bit | boundary_bit);
        const int col = jumps ? near % cols : static_cast<int>(std::lround(c.x));
        const int row = jumps ? near / cols : static_cast<int>(std::lround(c.y));
        const double x = jumps ? col : static_cast<double>(c.x), y = jumps ? row : static_cast<double>(c.y);
        double least = farthest * farthest;
        for (int v = std::max(row - 1, 0); v <= std::min(row + 1, rows - 1); ++v)
            for (int u = std::max(col - 1, 0); u <= std::min(col + 1, cols - 1); ++u) {
                const std::int32_t place = tracing.place[std::ptrdiff_t{v} * cols + u];
                const double distance = (u - x) * (u - x) + (v - y) * (v - y);
                if (place >= 0 && distance < least) least = distance, nearest[i] = place;
            }
        if (nearest[i] >= 0) ++result.first[nearest[i] + 1];
    }
    std::partial_sum(result.first.begin(), result.first.end(), result.first.begin());
    result.candidates.resize(result.first.back(), 0);
    Array<std::int32_t> next = result.first;
    for (std::ptrdiff_t i = 0; i < nearest.size(); ++i) {
        checkpoints.pass();
        if (nearest[i] >= 0) result.candidates[next[nearest[i]]++] = static_cast<std::int32_t>(i);
    }
    return result;
}

bool mean_position(const CandidateList& candidates, const Crossings& crossings, std::int32_t place, EdgeClass type,
                   Point& mean) {
    mean = {0, 0};
    int count = 0;
    for (std::int32_t k = crossings.first[place]; k < crossings.first[place + 1]; ++k) {
        const Candidate& c = candidates[static_cast<std::size_t>(crossings.candidates[k])];
        if (!belongs(c, type)) continue;
        mean.x += static_cast<double>(c.x), mean.y += static_cast<double>(c.y);
        ++count;
    }
    if (count) mean.x /= count, mean.y /= count;
    return count > 0;
}

std::vector<Piece> find_pieces(const CandidateList& candidates, const Tracing& tracing, const Crossings& crossings,
                               const std::uint8_t* kinds, int cols) {
    return Divider(candidates, tracing, crossings, kinds, cols).divide();
}

}  // namespace rangeedge
