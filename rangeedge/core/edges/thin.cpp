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
#include "edges/line_map.hpp"

namespace rangeedge {
namespace {

class Thinner : LineMap {
public:
    Thinner(const std::uint8_t* edges, const std::uint8_t* preferred, int rows, int cols)
        : LineMap(edges, preferred, rows, cols) {}
    using LineMap::write;

    void peel() {
        layers_ = 1;
        const BorderCount first = mark_border(map(), layers_, layer_.data());
        mark_kept(map());
        std::vector<int> border = list_marked(first.pixels), next;
        std::size_t enclosed = first.enclosed;  // pixels that have not been border yet
        while (true) {
            settle(border, next);
            enclosed -= next.size();
            border.swap(next);
            if (border.empty()) break;
            Watch::checkpoint();
            layers_ = std::min(layers_ + 1, 255);
            if (border.size() > state_.size() / worth_all) {
                mark_border(map(), layers_, layer_.data());
                mark_kept(map());
            } else {
                mark(border);
            }
        }
        by_depth_.resize(9u * at(layers_ + 1));
        if (enclosed == 0) return;
        for_each([&](int p) {  // the pixels that lines enclose
            if ((state_[at(p)] & (on | line)) != on) return;
            layer_[at(p)] = static_cast<std::uint8_t>(layers_);
            lines_.push_back(p);
        });
    }

    void narrow() {
        ring_.resize(state_.size());
        list_rings(map(), ring_.data());
        narrow(lines_);
    }

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

private:
    static constexpr std::size_t worth_all = 64;  // one pixel in so many at the border: all are looked at together
    // The pixels that are candidates or lines, of which there are `count`.
    std::vector<int> list_marked(std::size_t count) const {
        std::vector<int> marked(count + 1);
        std::size_t size = 0;
        for_each([&](int p) {
            marked[size] = p;
            size += (state_[at(p)] & (candidate | line)) != 0;
        });
        marked.pop_back();
        return marked;
    }

    // What mark_border and mark_kept do, for these pixels.
    void mark(const std::vector<int>& border) {
        for (const int p : border) {
            layer_[at(p)] = static_cast<std::uint8_t>(layers_);
            const bool goes = kinds[ring<on>(p)].may_go() && !(state_[at(p)] & stays);
            state_[at(p)] |= goes ? candidate : line;
        }
        for (const int p : border)
            if (state_[at(p)] & candidate && crucial(ring<on>(p), ring<candidate>(p))) state_[at(p)] |= kept;
    }

    // Of a round's border, what was kept becomes lines and the rest goes. `next` becomes the border of the next round.
    void settle(const std::vector<int>& border, std::vector<int>& next) {
        std::size_t count = lines_.size(), going = 0;
        lines_.resize(count + border.size());
        gone_.resize(border.size());
        for (const int p : border) {
            const bool remains = state_[at(p)] & (line | kept);
            state_[at(p)] = remains ? on | line : 0;
            lines_[count] = gone_[going] = p;
            count += remains;
            going += !remains;
        }
        lines_.resize(count);
        next.resize(4 * going);
        count = 0;
        for (std::size_t k = 0; k < going; ++k)
            for (const int from : {east, north, west, south}) {
                const int q = next[count] = gone_[k] + offsets_[at(from)];
                const bool opens = (state_[at(q)] & (on | line | queued)) == on;
                state_[at(q)] |= opens ? queued : std::uint8_t{0};
                count += opens;
            }
        next.resize(count);
    }

    // Those pixels that are wanted; no branch says which, as none could be predicted.
    template <class F>
    static void list(const std::vector<int>& pixels, std::vector<int>& wanted_ones, F&& wanted) {
        wanted_ones.resize(pixels.size());
        std::size_t count = 0;
        for (const int p : pixels) {
            wanted_ones[count] = p;
            count += wanted(p) ? 1 : 0;
        }
        wanted_ones.resize(count);
    }

    // Narrows the lines at the given pixels: first across, so that they keep their length, then all else that may go.
    void narrow(const std::vector<int>& pixels) {
        narrow(pixels, [](Ring around, int from) { return ways[around] >> (from / 2) & 1; });
        narrow(pixels, [](Ring around, int from) { return ~around >> from & 1; });
    }
    template <class F>
    void narrow(const std::vector<int>& pixels, F&& from_here) {
        std::size_t least = by_depth_.size(), waiting = 0;
        const auto may_go = [&](int p) { return int{is_set(p)} & int{kind(p).may_go()}; };
        const auto offer = [&](int p) {
            if (!may_go(p)) return;
            const std::size_t d = depth(p);
            by_depth_[d].push_back(p);
            least = std::min(least, d);
            ++waiting;
        };
        std::vector<int>&group = group_, &side = side_;
        list(pixels, side, may_go);
        for (const int p : side) offer(p);
        for (; waiting > 0; waiting -= group.size()) {
            checkpoints_.pass();
            while (by_depth_[least].empty()) ++least;
            group.clear();
            group.swap(by_depth_[least]);
            for (const int from : {south, north, east, west}) {
                list(group, side, [&](int p) { return from_here(ring_[at(p)], from); });
                for (const int p : side) {
                    checkpoints_.pass();
                    if (!may_go(p)) continue;
                    clear(p);
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
    // It holds until the next one is asked for.
    const Branch& branch(int end, int limit) {
        Branch& result = branch_;
        result.pixels.assign(1, end);
        result.junction = -1;
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
            const Branch& spur = branch(end, limit);  // anew: its junction may have gone
            if (spur.junction < 0) continue;
            if (protrusion(spur) != length) {
                offer(end, spur);
                continue;
            }
            for (const int p : spur.pixels) clear(p);
            removed = true;
            std::vector<int>& near = near_;
            near.clear();
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
        clear(p);
        set(middle);
        lines_.push_back(middle);
    }

    void draw_end(int end, int spur_length) {
        const Branch& old = branch(end, spur_length + 4 * (layers_ + 2));
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
        for (int i = 0; i < count; ++i) clear(old.pixels[at(i)]);
        const std::vector<int>& drawn = draw(first, column(first) - column(back), row(first) - row(back));
        const int length = static_cast<int>(drawn.size());
        const bool is_spur = old.junction >= 0 && old.length() - count + length < spur_length;
        if (length < least || is_spur) {
            for (const int p : drawn) clear(p);
            for (int i = 0; i < count; ++i) set(old.pixels[at(i)]);
            return false;
        }
        lines_.insert(lines_.end(), drawn.begin(), drawn.end());
        return true;
    }

    // Draws a line from its end `first` in the direction (dx, dy), as far as the band reaches and without touching
    // another line.
    const std::vector<int>& draw(int first, int dx, int dy) {
        std::vector<int>& drawn = drawn_;
        drawn.clear();
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
                set(next);
                drawn.push_back(next);
            }
            p = next;
        }
        return drawn;
    }

    Checkpoints checkpoints_;
    int layers_ = 0;
    std::vector<int> gone_;                   // in a round
    std::vector<int> lines_;                  // every pixel of a line, and some that have gone
    std::vector<std::vector<int>> by_depth_;  // for `narrow`, empty between calls
    // What functions fill, kept for their next call.
    Branch branch_;
    std::vector<int> group_, side_, near_, drawn_;
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
