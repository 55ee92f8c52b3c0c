// Thinning in four steps, none of which changes the number of 8-connected components or of holes.
//
// 1. Peeling. Round by round the border pixels go that are simple: to remove one of them neither splits nor deletes
//    anything, nor does it open or join holes. All go at once, so that no side is first. Where pixels are simple one by
//    one but not together, all of them stay: these are the crucial cliques of Bertrand and Couprie's critical kernels,
//    in the plane a pair of 4-neighbours or what is set of a square of four. What a round leaves of the border is a
//    line by now and stays for good, as do pixels with a single neighbour, the ends of lines. So every pixel is looked
//    at in one round alone, and the time is proportional to their number.
// 2. Narrowing. The lines may still be two or three pixels wide, since the cliques stayed whole. Pixels at the fringe
//    of the band go before inner ones; among equals a side has to be chosen: first south, then north, east, west.
// 3. Pruning. Branches with a free end that hardly stand out of the band go, the shortest first. What is left when the
//    last junction has gone is a line with two ends and no branch.
// 4. Drawing ends. Peeling takes as much off the end of a band as off its sides, or runs into one of its corners. Lines
//    are cut back to where their band is whole, and drawn straight on from there to the end of the band.
//
// G. Bertrand and M. Couprie, "Two-dimensional parallel thinning algorithms based on critical kernels", Journal of
// Mathematical Imaging and Vision 31, 2008.
// SPDX-License-Identifier: Apache-2.0
#include "edges/thin.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <queue>
#include <tuple>
#include <vector>

#include "base/watch.hpp"
#include "edges/ring.hpp"

namespace rangeedge {
namespace {

class Thinner {
public:
    Thinner(const std::uint8_t* edges, const std::uint8_t* preferred, int rows, int cols)
        : rows_(rows), cols_(cols), stride_(cols + 2),
          offsets_{1, 1 - stride_, -stride_, -1 - stride_, -1, stride_ - 1, stride_, stride_ + 1},
          state_(at(stride_) * at(rows + 2)), layer_(state_.size()) {
        for (int y = 0; y < rows; ++y) {
            std::uint8_t* to = &state_[at(pixel(y, 0))];
            for (int x = 0; x < cols; ++x) to[x] = edges[x] ? on : 0;
            edges += cols;
            if (!preferred) continue;
            for (int x = 0; x < cols; ++x) to[x] |= preferred[x] ? stays : 0;
            preferred += cols;
        }
    }

    void peel() {
        std::vector<int> border, next;
        std::size_t enclosed = 0;  // pixels that have not been border yet
        for_each_set([&](int p) {
            if (is_border(p))
                border.push_back(p);
            else
                ++enclosed;
        });
        while (!border.empty()) {
            Watch::checkpoint();
            layers_ = std::min(layers_ + 1, 255);
            for (const int p : border) {
                layer_[at(p)] = static_cast<std::uint8_t>(layers_);
                const bool goes = kinds[ring<on>(p)].may_go() && !(state_[at(p)] & stays);
                state_[at(p)] |= goes ? candidate : line;
            }
            next.clear();
            for (const int p : border)
                if (state_[at(p)] & candidate && is_crucial(ring<on>(p), ring<candidate>(p))) next.push_back(p);
            for (const int p : next) state_[at(p)] = on | line;
            next.clear();
            for (const int p : border) {
                if (state_[at(p)] & line)
                    lines_.push_back(p);
                else
                    state_[at(p)] = 0;
            }
            for (const int p : border) {
                if (is_set(p)) continue;
                for (const int from : {east, north, west, south}) {
                    const int q = p + offsets_[at(from)];
                    if ((state_[at(q)] & (on | line | queued)) != on) continue;
                    state_[at(q)] |= queued;
                    next.push_back(q);
                }
            }
            enclosed -= next.size();
            border.swap(next);
        }
        by_depth_.resize(9u * at(layers_ + 1));
        if (enclosed == 0) return;
        for_each_set([&](int p) {  // the pixels that lines enclose
            if (state_[at(p)] & line) return;
            layer_[at(p)] = static_cast<std::uint8_t>(layers_);
            lines_.push_back(p);
        });
    }

    void narrow() { narrow(lines_); }

    void prune(int spur_length) {
        while (prune_once(spur_length)) {
        }
    }

    void draw_ends(int spur_length) {
        for (const int end : ends()) {
            checkpoints_.pass();
            draw_end(end, spur_length);
        }
    }

    void write(std::uint8_t* thin) const {
        for (int y = 0; y < rows_; ++y) {
            const std::uint8_t* from = &state_[at(pixel(y, 0))];
            for (int x = 0; x < cols_; ++x) thin[x] = from[x] & on ? 255 : 0;
            thin += cols_;
        }
    }

private:
    // States of a pixel.
    static constexpr std::uint8_t on = 1, line = 2, candidate = 4, queued = 8, stays = 16;

    static std::size_t at(int index) { return static_cast<std::size_t>(index); }
    int pixel(int y, int x) const { return (y + 1) * stride_ + x + 1; }
    int row(int p) const { return p / stride_; }
    int column(int p) const { return p % stride_; }
    bool is_set(int p) const { return state_[at(p)] & on; }
    bool is_border(int p) const {
        return !(state_[at(p + 1)] & state_[at(p - 1)] & state_[at(p + stride_)] & state_[at(p - stride_)] & on);
    }
    // The neighbours of p that have the flag.
    template <std::uint8_t flag>
    Ring ring(int p) const {
        Ring result = 0;
        for (int k = 0; k < 8; ++k) result |= static_cast<Ring>((state_[at(p + offsets_[at(k)])] & flag) / flag) << k;
        return result;
    }
    int count_neighbours(int p) const { return kinds[ring<on>(p)].neighbours; }

    template <class F>
    void for_each_set(F&& f) const {
        const int end = static_cast<int>(state_.size());
        std::uint64_t word;
        constexpr int step = sizeof word;
        for (int p = 0; p < end; ++p) {
            while (p + step <= end && (std::memcpy(&word, &state_[at(p)], sizeof word), !word)) p += step;
            if (p < end && is_set(p)) f(p);
        }
    }
    template <class F>
    void for_each_neighbour(int p, F&& f) const {
        for (const int offset : offsets_)
            if (is_set(p + offset)) f(p + offset);
    }

    // How deep in its band a pixel lies: by layer, then by how many of its neighbours belong to a band.
    std::size_t depth(int p) const {
        std::size_t inside = 0;
        for (const int offset : offsets_) inside += layer_[at(p + offset)] > 0;
        return 9u * layer_[at(p)] + inside;
    }

    // Narrows the lines at the given pixels: first across, so that they keep their length, then all else that may go.
    void narrow(const std::vector<int>& pixels) {
        narrow(pixels, lies_beside_line);
        narrow(pixels, [](Ring, int) { return true; });
    }
    template <class F>
    void narrow(const std::vector<int>& pixels, F&& from_here) {
        std::size_t least = by_depth_.size(), waiting = 0;
        const auto offer = [&](int p) {
            if (!is_set(p) || !kinds[ring<on>(p)].may_go()) return;
            const std::size_t d = depth(p);
            by_depth_[d].push_back(p);
            least = std::min(least, d);
            ++waiting;
        };
        for (const int p : pixels) offer(p);
        std::vector<int> group, side;
        for (; waiting > 0; waiting -= group.size()) {
            checkpoints_.pass();
            while (by_depth_[least].empty()) ++least;
            group.clear();
            group.swap(by_depth_[least]);
            for (const int from : {south, north, east, west}) {
                side.clear();
                for (const int p : group)
                    if (!is_set(p + offsets_[at(from)]) && from_here(ring<on>(p), from)) side.push_back(p);
                for (const int p : side) {
                    checkpoints_.pass();
                    if (!is_set(p) || !kinds[ring<on>(p)].may_go()) continue;
                    state_[at(p)] = 0;
                    for_each_neighbour(p, offer);
                }
            }
        }
    }

    std::vector<int> ends() const {
        std::vector<int> result;
        for (const int p : lines_)
            if (is_set(p) && count_neighbours(p) == 1) result.push_back(p);
        return result;
    }

    // The pixels of a line from its end to the next junction, `limit` at most. `junction` is the first pixel with more
    // than two neighbours, -1 where there is none so near.
    struct Branch {
        std::vector<int> pixels;
        int junction;

        int length() const { return static_cast<int>(pixels.size()); }
    };
    Branch branch(int end, int limit) const {
        Branch result{{end}, -1};
        for (int before = -1, p = end; result.length() < limit;) {
            int next = -1;
            for_each_neighbour(p, [&](int q) { next = q == before ? next : q; });
            if (next < 0) break;  // the other end
            if (count_neighbours(next) > 2) {
                result.junction = next;
                break;
            }
            result.pixels.push_back(next);
            before = p;
            p = next;
        }
        return result;
    }

    // How far a branch stands out of the band that it hangs on.
    int protrusion(const Branch& spur) const {
        const int inside = layer_[at(spur.junction)] - layer_[at(spur.pixels.front())];
        return spur.length() - std::max(0, inside);
    }

    // Whether a spur was found and removed.
    bool prune_once(int spur_length) {
        using Spur = std::tuple<int, std::size_t, int>;  // protrusion, depth, end: of equally short ones the shallowest
        std::priority_queue<Spur, std::vector<Spur>, std::greater<Spur>> spurs;
        const int limit = spur_length + layers_;
        const auto offer = [&](int end, const Branch& spur) {
            if (spur.junction < 0 || protrusion(spur) >= spur_length) return;
            std::size_t sum = 0;
            for (const int p : spur.pixels) sum += depth(p);
            spurs.emplace(protrusion(spur), sum, end);
        };
        for (const int end : ends()) {
            checkpoints_.pass();
            offer(end, branch(end, limit));
        }
        bool removed = false;
        while (!spurs.empty()) {
            checkpoints_.pass();
            const auto [length, sum, end] = spurs.top();
            spurs.pop();
            if (!is_set(end) || count_neighbours(end) != 1) continue;
            const Branch spur = branch(end, limit);  // anew: its junction may have gone
            if (spur.junction < 0) continue;
            if (protrusion(spur) != length) {
                offer(end, spur);
                continue;
            }
            for (const int p : spur.pixels) state_[at(p)] = 0;
            removed = true;
            std::vector<int> near;
            for_each_neighbour(spur.pixels.back(), [&](int q) { near.push_back(q); });
            narrow(near);
            for (const int p : near) straighten(p);
        }
        return removed;
    }

    // Moves a pixel onto the straight line between its two neighbours.
    void straighten(int p) {
        if (!is_set(p) || count_neighbours(p) != 2) return;
        int sum = 0, first = 0;
        for_each_neighbour(p, [&](int q) { sum += first = q; });
        const int middle = sum / 2, half = std::abs(first - middle);
        if (sum % 2 || (half != 1 && half != stride_) || is_set(middle)) return;
        if (layer_[at(middle)] == 0 || count_neighbours(middle) != 3) return;  // no band there, or another line
        state_[at(p)] = 0;
        state_[at(middle)] = on | line;
        lines_.push_back(middle);
    }

    void draw_end(int end, int spur_length) {
        const Branch old = branch(end, spur_length + 4 * (layers_ + 2));
        // The band is whole where no higher layer is near.
        int whole = 0;
        const auto layer = [&](int i) -> int { return layer_[at(old.pixels[at(i)])]; };
        for (int i = 1; i < old.length() && i <= whole + layer(whole) + 2; ++i)
            if (layer(i) > layer(whole)) whole = i;
        const auto replace = [&](int count, int least) { return replace_end(old, count, least, spur_length); };
        // An end that comes out much shorter was no corner. The last pixel alone may stand aside and be in the way.
        (whole > 0 && replace(whole, (whole + 1) / 2)) || replace(0, 1) || replace(1, 2);
    }

    // Draws a line anew from where its first `count` pixels are cut off; or leaves it as it is, if fewer than `least`
    // came instead, or if it became a spur.
    bool replace_end(const Branch& old, int count, int least, int spur_length) {
        if (count + 1 >= old.length()) return false;
        const int first = old.pixels[at(count)];
        const int back = old.pixels[at(std::min(old.length() - 1, count + 2 * layer_[at(first)] + 3))];
        for (int i = 0; i < count; ++i) state_[at(old.pixels[at(i)])] = 0;
        const std::vector<int> drawn = draw(first, column(first) - column(back), row(first) - row(back));
        const int length = static_cast<int>(drawn.size());
        const bool is_spur = old.junction >= 0 && old.length() - count + length < spur_length;
        if (length < least || is_spur) {
            for (const int p : drawn) state_[at(p)] = 0;
            for (int i = 0; i < count; ++i) state_[at(old.pixels[at(i)])] = on | line;
            return false;
        }
        lines_.insert(lines_.end(), drawn.begin(), drawn.end());
        return true;
    }

    // Draws a line from its end `first` in the direction (dx, dy), as far as the band reaches and without touching
    // another line.
    std::vector<int> draw(int first, int dx, int dy) {
        std::vector<int> drawn;
        for (int p = first; p >= 0;) {
            int next = -1, least = 0;
            for (const int offset : offsets_) {
                const int q = p + offset;
                if (layer_[at(q)] == 0 || layer_[at(q)] > layer_[at(first)] || is_set(q)) continue;
                if (count_neighbours(q) != 1) continue;
                if (dx * (column(q) - column(p)) + dy * (row(q) - row(p)) <= 0) continue;
                const int off = std::abs(dx * (row(q) - row(first)) - dy * (column(q) - column(first)));
                if (off * off > 2 * (dx * dx + dy * dy)) continue;
                if (next >= 0 && off >= least) continue;
                next = q;
                least = off;
            }
            if (next >= 0) {
                state_[at(next)] = on | line;
                drawn.push_back(next);
            }
            p = next;
        }
        return drawn;
    }

    Checkpoints checkpoints_;
    int rows_, cols_, stride_;
    std::array<int, 8> offsets_;       // of the neighbours, as in a ring
    std::vector<std::uint8_t> state_;  // with a margin of one pixel, all 0
    std::vector<std::uint8_t> layer_;  // the round in which a pixel was border, 1 to 255; 0 outside the bands
    int layers_ = 0;
    std::vector<int> lines_;                  // every pixel of a line, and some that have gone
    std::vector<std::vector<int>> by_depth_;  // for `narrow`, empty between calls
};

}  // namespace

void thin_lines(const std::uint8_t* edges, const std::uint8_t* preferred, int rows, int cols, int spur_length,
                std::uint8_t* thin) {
    Thinner thinner(edges, preferred, rows, cols);
    thinner.peel();
    thinner.narrow();
    spur_length = std::min(spur_length, 1 << 30);  // sums stay in range
    thinner.prune(spur_length);
    thinner.draw_ends(spur_length);
    thinner.write(thin);
}

}  // namespace rangeedge
