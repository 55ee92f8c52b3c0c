// SPDX-License-Identifier: Apache-2.0
#include "chains/join.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>

#include "base/angle.hpp"
#include "base/watch.hpp"
#include "chains/line_sums.hpp"

namespace rangeedge {
namespace {

constexpr int end_reach = 12;           // positions that tell the direction of an end
constexpr int least_positions = 3;      // without which an end has no direction
constexpr double widest_overlap = 2;    // pixels that an end may lie behind the other
constexpr double farthest_aside = 1.5;  // pixels from the straight continuation of either end, beside what a turn takes
constexpr double pixels_per_degree = 0.1;  // what a change of direction weighs

struct End {
    int piece, side;    // side 0: before the first member
    StraightLine line;  // through the outermost position, outward
    bool found;
};

struct Pair {
    double cost;
    int a, b;  // numbers of ends
};

class Joiner {
public:
    Joiner(std::vector<Piece>&& pieces, const CandidateList& candidates, const Crossings& crossings,
           const JoinOptions& options)
        : pieces_(std::move(pieces)), candidates_(candidates), crossings_(crossings), options_(options) {}

    std::vector<Piece> join() {
        find_ends();
        find_pairs();
        partner_.assign(2 * static_cast<std::ptrdiff_t>(pieces_.size()), -1);
        for (const Pair& pair : pairs_)
            if (partner_[pair.a] < 0 && partner_[pair.b] < 0) partner_[pair.a] = pair.b, partner_[pair.b] = pair.a;
        return assembled();
    }

private:
    void find_ends() {
        Checkpoints checkpoints(256);
        for (int i = 0; i < static_cast<int>(pieces_.size()); ++i, checkpoints.pass())
            for (const int side : {0, 1}) ends_.push_back(end(i, side));
    }

    End end(int number, int side) const {
        const Piece& piece = pieces_[static_cast<std::size_t>(number)];
        End result{number, side, {}, false};
        if (piece.closed) return result;
        PointSums sums;
        Point outermost{}, inmost{};
        int count = 0;
        const std::ptrdiff_t n = piece.members.size();
        for (std::ptrdiff_t i = 0; i < n && count < end_reach; ++i) {
            Point mean;
            const std::int32_t place = piece.members[side ? n - 1 - i : i];
            if (!mean_position(candidates_, crossings_, place, piece.type, mean)) continue;
            if (!count++) outermost = mean;
            inmost = mean;
            sums.add(mean.x - outermost.x, mean.y - outermost.y);
        }
        if (count < least_positions) return result;
        result.line = sums.line(outermost.x - inmost.x, outermost.y - inmost.y);
        // From its middle to the foot of the outermost position.
        const double s = result.line.along(0, 0);
        result.line.x += s * result.line.dx + outermost.x, result.line.y += s * result.line.dy + outermost.y;
        result.found = true;
        return result;
    }

    // By cells of the largest gap, in which only neighbouring ones are compared.
    void find_pairs() {
        const double size = options_.max_gap + widest_overlap;
        if (!(options_.max_gap > 0)) return;
        std::vector<std::tuple<int, int, int>> cells;
        for (int i = 0; i < static_cast<int>(ends_.size()); ++i) {
            const StraightLine& line = ends_[static_cast<std::size_t>(i)].line;
            if (ends_[static_cast<std::size_t>(i)].found)
                cells.emplace_back(static_cast<int>(std::floor(line.y / size)),
                                   static_cast<int>(std::floor(line.x / size)), i);
        }
        std::sort(cells.begin(), cells.end());
        Checkpoints checkpoints(256);
        for (const auto& [row, col, i] : cells) {
            checkpoints.pass();
            for (int v = row - 1; v <= row + 1; ++v) {
                auto other = std::lower_bound(cells.begin(), cells.end(), std::make_tuple(v, col - 1, -1));
                for (; other != cells.end() && std::get<0>(*other) == v && std::get<1>(*other) <= col + 1; ++other)
                    if (std::get<2>(*other) > i) compare(i, std::get<2>(*other));
            }
        }
        std::sort(pairs_.begin(), pairs_.end(),
                  [](const Pair& p, const Pair& q) { return std::tie(p.cost, p.a, p.b) < std::tie(q.cost, q.a, q.b); });
    }

    void compare(int i, int k) {
        const End &a = ends_[static_cast<std::size_t>(i)], &b = ends_[static_cast<std::size_t>(k)];
        const Piece& p = pieces_[static_cast<std::size_t>(a.piece)];
        const Piece& q = pieces_[static_cast<std::size_t>(b.piece)];
        if (p.type != q.type) return;
        if (is_one_sided(p.type) && a.side == b.side) return;  // the nearer side would change
        const double gap = std::hypot(b.line.x - a.line.x, b.line.y - a.line.y);
        if (gap > options_.max_gap) return;
        const double turn = std::atan2(std::abs(a.line.dx * b.line.dy - a.line.dy * b.line.dx),
                                       -(a.line.dx * b.line.dx + a.line.dy * b.line.dy)) *
                            degrees_per_radian;
        if (turn > options_.turn_angle) return;
        const double ahead = std::min(a.line.along(b.line.x, b.line.y), b.line.along(a.line.x, a.line.y));
        if (ahead < -widest_overlap) return;
        const double aside =
            std::max(std::abs(a.line.off(b.line.x, b.line.y)), std::abs(b.line.off(a.line.x, a.line.y)));
        if (aside > farthest_aside + gap * std::sin(options_.turn_angle / degrees_per_radian)) return;
        pairs_.push_back({gap + aside + pixels_per_degree * turn, i, k});
    }

    std::vector<Piece> assembled() {
        Array<char> used(static_cast<std::ptrdiff_t>(pieces_.size()), 0);
        std::vector<Piece> chains;
        // First from free ends, then around loops.
        for (const bool loops : {false, true})
            for (int i = 0; i < static_cast<int>(pieces_.size()); ++i) {
                if (used[i]) continue;
                if (partner_[2 * i] < 0)
                    chains.push_back(followed(2 * i, used));
                else if (partner_[2 * i + 1] < 0)
                    chains.push_back(followed(2 * i + 1, used));
                else if (loops)
                    chains.push_back(followed(2 * i, used));
            }
        return chains;
    }

    // The chain that begins at an end.
    Piece followed(int start, Array<char>& used) {
        Piece chain{{}, pieces_[static_cast<std::size_t>(start / 2)].type, false};
        for (int end = start; end >= 0 && !used[end / 2];) {
            Piece& piece = pieces_[static_cast<std::size_t>(end / 2)];
            used[end / 2] = 1;
            if (end % 2) std::reverse(piece.members.begin(), piece.members.end());
            for (const std::int32_t member : piece.members) chain.members.push_back(member);
            const int far = end ^ 1;
            end = partner_[far];
            chain.closed = piece.closed || end == start;
        }
        // Jumps are followed with the nearer surface on the left.
        if (is_one_sided(chain.type) && start % 2) std::reverse(chain.members.begin(), chain.members.end());
        return chain;
    }

    std::vector<Piece> pieces_;
    const CandidateList& candidates_;
    const Crossings& crossings_;
    const JoinOptions& options_;
    std::vector<End> ends_;
    std::vector<Pair> pairs_;
    Array<int> partner_;
};

}  // namespace

std::vector<Piece> join_pieces(std::vector<Piece> pieces, const CandidateList& candidates, const Crossings& crossings,
                               const JoinOptions& options) {
    return Joiner(std::move(pieces), candidates, crossings, options).join();
}

}  // namespace rangeedge
