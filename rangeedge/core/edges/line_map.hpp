// An edge map that becomes lines: what every pixel is, its ring of neighbours, and how deep in its band it lies.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "edges/ring.hpp"
#include "edges/ring_rows.hpp"

namespace rangeedge {

class LineMap {
protected:
    LineMap(const std::uint8_t* edges, const std::uint8_t* preferred, int rows, int cols)
        : rows_(rows), cols_(cols), stride_(cols + 2),
          offsets_{1, 1 - stride_, -stride_, -1 - stride_, -1, stride_ - 1, stride_, stride_ + 1},
          state_(at(stride_) * at(rows + 2) + at(StateMap::beyond)), layer_(state_.size()) {
        for (int y = 0; y < rows; ++y) {
            std::uint8_t* to = &state_[at(pixel(y, 0))];
            for (int x = 0; x < cols; ++x) to[x] = edges[x] ? on : 0;
            edges += cols;
            if (!preferred) continue;
            for (int x = 0; x < cols; ++x) to[x] |= preferred[x] ? stays : 0;
            preferred += cols;
        }
    }

    void write(std::uint8_t* thin) const {
        for (int y = 0; y < rows_; ++y) {
            const std::uint8_t* from = &state_[at(pixel(y, 0))];
            for (int x = 0; x < cols_; ++x) thin[x] = from[x] & on ? 255 : 0;
            thin += cols_;
        }
    }

    static constexpr std::uint8_t on = StateMap::on, line = StateMap::line, candidate = StateMap::candidate,
                                  queued = StateMap::queued, stays = StateMap::stays, kept = StateMap::kept;

    static std::size_t at(int index) { return static_cast<std::size_t>(index); }
    int pixel(int y, int x) const { return (y + 1) * stride_ + x + 1; }
    int row(int p) const { return p / stride_; }
    int column(int p) const { return p % stride_; }
    bool is_set(int p) const { return state_[at(p)] & on; }
    StateMap map() { return {state_.data(), pixel(0, 0), pixel(rows_, 0), stride_}; }
    // The neighbours of p that have the flag.
    template <std::uint8_t flag>
    Ring ring(int p) const {
        Ring result = 0;
        for (int k = 0; k < 8; ++k) result |= static_cast<Ring>((state_[at(p + offsets_[at(k)])] & flag) / flag) << k;
        return result;
    }
    // What follows holds once the rings are listed.
    Kind kind(int p) const { return kinds[ring_[at(p)]]; }
    int count_neighbours(int p) const { return kind(p).neighbours; }
    void set(int p) {
        state_[at(p)] = on | line;
        for (int k = 0; k < 8; ++k) ring_[at(p + offsets_[at(k)])] |= static_cast<std::uint8_t>(1 << (k ^ 4));
    }
    void clear(int p) {
        state_[at(p)] = 0;
        for (int k = 0; k < 8; ++k) ring_[at(p + offsets_[at(k)])] &= static_cast<std::uint8_t>(~(1 << (k ^ 4)));
    }

    // Visits all pixels that have a state, and some others.
    template <class F>
    void for_each(F&& f) const {
        const int end = pixel(rows_, 0);
        std::uint64_t word;
        constexpr int step = sizeof word;
        for (int p = 0; p < end; p += step) {
            std::memcpy(&word, &state_[at(p)], sizeof word);
            if (!word) continue;
            for (int k = p; k < p + step; ++k) f(k);
        }
    }
    template <class F>
    void for_each_neighbour(int p, F&& f) const {
        for (Ring ring = ring_[at(p)]; ring; ring &= ring - 1) f(p + offsets_[at(__builtin_ctz(ring))]);
    }

    // How deep in its band a pixel lies: by layer, then by how many of its neighbours belong to a band.
    std::size_t depth(int p) const {
        std::size_t inside = 0;
        for (const int offset : offsets_) inside += layer_[at(p + offset)] > 0;
        return 9u * layer_[at(p)] + inside;
    }

    int rows_, cols_, stride_;
    std::array<int, 8> offsets_;       // of the neighbours, as in a ring
    std::vector<std::uint8_t> state_;  // with a margin of one pixel, all 0
    std::vector<std::uint8_t> ring_;   // of every pixel, from narrowing on
    std::vector<std::uint8_t> layer_;  // the round in which a pixel was border, 1 to 255; 0 outside the bands
};

}  // namespace rangeedge
