// SPDX-License-Identifier: Apache-2.0
#include "chains/trace.hpp"

#include <cstring>
#include <utility>

#include "base/watch.hpp"

namespace rangeedge {
namespace {

constexpr std::int32_t empty = -1, unvisited = -2, junction = -3;  // places of pixels that are not on a path yet
constexpr int least_loop = 8;                                      // pixels

struct Offset {
    int dcol, drow;
};
constexpr Offset around[8] = {{1, 0}, {1, -1}, {0, -1}, {-1, -1}, {-1, 0}, {-1, 1}, {0, 1}, {1, 1}};  // from the east

class Tracer {
public:
    Tracer(const std::uint8_t* thin, int rows, int cols) : thin_(thin), rows_(rows), cols_(cols) {}

    Tracing trace() {
        const std::ptrdiff_t size = std::ptrdiff_t{rows_} * cols_;
        result_.place.resize(size, empty);
        Array<std::int32_t> lines;
        Checkpoints checkpoints;
        for (std::ptrdiff_t p = 0; p < size; ++p) {
            checkpoints.pass();
            std::uint64_t eight;
            if (p + 8 <= size && (std::memcpy(&eight, thin_ + p, 8), eight == 0)) {
                p += 7;
                continue;
            }
            if (thin_[p]) lines.push_back(static_cast<std::int32_t>(p));
        }
        for (const std::int32_t p : lines) result_.place[p] = count(neighbours(p)) > 2 ? junction : unvisited;
        for (const std::int32_t p : lines) {
            checkpoints.pass();
            if (result_.place[p] == unvisited && open_ends(p) < 2) follow(p);
        }
        for (const std::int32_t p : lines) {
            checkpoints.pass();
            if (result_.place[p] == unvisited) follow(p);
        }
        return std::move(result_);
    }

private:
    static int count(unsigned ring) {
        int bits = 0;
        for (; ring; ring &= ring - 1) ++bits;
        return bits;
    }

    // Bits of the neighbours of a pixel, in the order of `around`.
    unsigned neighbours(std::int32_t p) const {
        const int col = p % cols_, row = p / cols_;
        unsigned ring = 0;
        for (unsigned k = 0; k < 8; ++k) {
            const int u = col + around[k].dcol, v = row + around[k].drow;
            if (u >= 0 && v >= 0 && u < cols_ && v < rows_ && thin_[p + shift(k)]) ring |= 1u << k;
        }
        const unsigned straight = ring & 0x55;
        const unsigned beside = (straight << 1 | straight >> 1 | (straight & 1) << 7) & 0xaa;
        return ring & ~beside;
    }

    std::ptrdiff_t shift(unsigned k) const { return std::ptrdiff_t{around[k].drow} * cols_ + around[k].dcol; }

    template <class Visit>
    void for_each_neighbour(std::int32_t p, Visit&& visit) const {
        const unsigned ring = neighbours(p);
        for (unsigned k = 0; k < 8; ++k)
            if (ring >> k & 1) visit(static_cast<std::int32_t>(p + shift(k)));
    }

    int open_ends(std::int32_t p) const {
        int found = 0;
        for_each_neighbour(p, [&](std::int32_t q) { found += result_.place[q] == unvisited; });
        return found;
    }

    void follow(std::int32_t start) {
        LinePath path{result_.pixels.size(), 0, false};
        for (std::int32_t p = start, next; p >= 0; p = next) {
            result_.place[p] = static_cast<std::int32_t>(result_.pixels.size());
            result_.pixels.push_back(p);
            next = -1;
            for_each_neighbour(p, [&](std::int32_t q) {
                if (next < 0 && result_.place[q] == unvisited) next = q;
            });
        }
        path.end = result_.pixels.size();
        if (path.end - path.first >= least_loop)
            for_each_neighbour(result_.pixels.back(), [&](std::int32_t q) { path.closed |= q == start; });
        result_.paths.push_back(path);
    }

    const std::uint8_t* thin_;
    int rows_, cols_;
    Tracing result_;
};

}  // namespace

Tracing trace_paths(const std::uint8_t* thin, int rows, int cols) { return Tracer(thin, rows, cols).trace(); }

}  // namespace rangeedge
