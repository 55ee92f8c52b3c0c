// SPDX-License-Identifier: Apache-2.0
#include "edges/ring_rows.hpp"

#include <cstring>

#include "base/simd.hpp"
#include "edges/ring.hpp"

namespace rangeedge {
namespace {

template <int bytes>
struct Pixels {
    typedef std::uint8_t Vector __attribute__((vector_size(bytes)));
    static_assert(bytes <= StateMap::beyond);

    static RANGEEDGE_INLINE Vector load(const std::uint8_t* from) {
        Vector v;
        std::memcpy(&v, from, sizeof v);
        return v;
    }
    static RANGEEDGE_INLINE void store(const Vector& v, std::uint8_t* to) { std::memcpy(to, &v, sizeof v); }
    static RANGEEDGE_INLINE bool any(const Vector& v) {
        std::uint64_t words[bytes / 8], all = 0;
        std::memcpy(words, &v, sizeof v);
        for (const std::uint64_t word : words) all |= word;
        return all != 0;
    }
    static RANGEEDGE_INLINE std::size_t count(const Vector& flags) {
        std::uint64_t words[bytes / 8];
        std::memcpy(words, &flags, sizeof flags);
        std::size_t set = 0;
        for (const std::uint64_t word : words) set += static_cast<std::size_t>(__builtin_popcountll(word));
        return set;
    }
    // All bits set where there is one.
    static RANGEEDGE_INLINE Vector some(const Vector& v) { return reinterpret_cast<Vector>(v != 0); }
    static RANGEEDGE_INLINE Vector has(const Vector& states, std::uint8_t flag) { return some(states & flag); }
    static RANGEEDGE_INLINE Vector ring(const StateMap& map, std::ptrdiff_t p, std::uint8_t flag) {
        const std::ptrdiff_t s = map.stride, around[]{1, 1 - s, -s, -1 - s, -1, s - 1, s, s + 1};
        Vector ring{};
        for (int k = 0; k < 8; ++k) {
            const auto bit = static_cast<std::uint8_t>(1 << k);
            ring |= has(load(map.states + p + around[k]), flag) & bit;
        }
        return ring;
    }
};

template <int bytes>
RANGEEDGE_INLINE BorderCount border_marked_in(const StateMap& map, int round, std::uint8_t* layer) {
    using P = Pixels<bytes>;
    using V = typename P::Vector;
    BorderCount count{0, 0};
    for (std::ptrdiff_t p = map.first; p < map.last; p += bytes) {
        const V states = P::load(map.states + p), open = P::has(states, StateMap::on) & ~P::has(states, StateMap::line);
        if (!P::any(open)) continue;
        const V ring = P::ring(map, p, StateMap::on), border = open & P::some(~ring & four);
        const V around = parts(ring), simple = P::some(around) & ~P::some(around & (around - 1));
        const V goes = border & simple & P::some(ring & (ring - 1)) & ~P::has(states, StateMap::stays);
        P::store(states | (goes & StateMap::candidate) | (border & ~goes & StateMap::line), map.states + p);
        P::store((P::load(layer + p) & ~border) | (border & static_cast<std::uint8_t>(round)), layer + p);
        count.pixels += P::count(border & 1);
        count.enclosed += P::count(open & ~border & 1);
    }
    return count;
}

template <int bytes>
RANGEEDGE_INLINE void kept_marked_in(const StateMap& map) {
    using P = Pixels<bytes>;
    using V = typename P::Vector;
    for (std::ptrdiff_t p = map.first; p < map.last; p += bytes) {
        const V states = P::load(map.states + p), candidate = P::has(states, StateMap::candidate);
        if (!P::any(candidate)) continue;
        const V stays = crucial(P::ring(map, p, StateMap::on), P::ring(map, p, StateMap::candidate));
        P::store(states | (candidate & P::some(stays) & StateMap::kept), map.states + p);
    }
}

template <int bytes>
RANGEEDGE_INLINE void rings_listed_in(const StateMap& map, std::uint8_t* rings) {
    using P = Pixels<bytes>;
    for (std::ptrdiff_t p = map.first; p < map.last; p += bytes) {
        const typename P::Vector ring = P::ring(map, p, StateMap::on);
        if (P::any(ring)) P::store(ring, rings + p);
    }
}

RANGEEDGE_VERSIONS(BorderCount, border_marked, (const StateMap& map, int round, std::uint8_t* layer),
                   (map, round, layer))
RANGEEDGE_VERSIONS(void, kept_marked, (const StateMap& map), (map))
RANGEEDGE_VERSIONS(void, rings_listed, (const StateMap& map, std::uint8_t* rings), (map, rings))

}  // namespace

BorderCount mark_border(const StateMap& map, int round, std::uint8_t* layer) {
    return border_marked(map, round, layer);
}
void mark_kept(const StateMap& map) { kept_marked(map); }
void list_rings(const StateMap& map, std::uint8_t* rings) { rings_listed(map, rings); }

}  // namespace rangeedge
