// Pieces of paths along which an edge stays the same: one kind, the nearer surface on one side.
//
// Every candidate belongs to the pixel of a path that is nearest to it. The candidates near a pixel that are jumps
// where it is one, and creases elsewhere, vote for its class; where that changes, a piece ends.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/array.hpp"
#include "chains/trace.hpp"
#include "edges/candidate.hpp"

namespace rangeedge {

// Of jumps and of the outlines of data: whether the nearer side, or the data, is on the left or on the right.
enum class EdgeClass : std::int32_t { none, jump, jump_right, convex, concave, outline, outline_right };

// Whether an edge has a side before the other.
inline bool is_one_sided(EdgeClass type) { return type == EdgeClass::jump || type == EdgeClass::outline; }

struct Piece {
    Array<std::int32_t> members;  // places in Tracing::pixels, in order
    EdgeClass type;
    bool closed;
};

// The candidates of every pixel of the paths, and their mean position.
struct Crossings {
    Array<std::int32_t> first;  // of the candidates of a place in `candidates`; one more than there are places
    Array<std::int32_t> candidates;
};

struct Point {
    double x, y;
};

Crossings assign_candidates(const CandidateList& candidates, const Tracing& tracing, int rows, int cols);

// The step of a candidate's scan line.
Point scan_step(const Candidate& c);

// Whether a candidate is of a class.
inline bool belongs(const Candidate& c, EdgeClass type) {
    if (type == EdgeClass::convex || type == EdgeClass::concave)
        return !(c.kind & jump_bit) && c.crease > 0 && ((c.kind & convex_bit) != 0) == (type == EdgeClass::convex);
    return (c.kind & (type == EdgeClass::outline ? boundary_bit : jump_bit)) != 0;
}

// The mean position of the candidates of a class at a place; false if there are none.
bool mean_position(const CandidateList& candidates, const Crossings& crossings, std::int32_t place, EdgeClass type,
                   Point& mean);

// `kinds` are those of the pixels of the image.
std::vector<Piece> find_pieces(const CandidateList& candidates, const Tracing& tracing, const Crossings& crossings,
                               const std::uint8_t* kinds, int cols);

}  // namespace rangeedge
