// Loops over many lanes, written once for every width of vector that processors have.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <type_traits>

#define RANGEEDGE_ALWAYS __attribute__((always_inline))  // of lambdas: out of line they would be narrow
#define RANGEEDGE_INLINE inline RANGEEDGE_ALWAYS

// RANGEEDGE_WIDE marks a function that is compiled for wider vectors too; RANGEEDGE_VERSIONS defines name(parameters)
// from a template name_in<bytes>, once for every width. The widest that the processor has, and no wider than
// RANGEEDGE_WIDEST bytes, is chosen at load time. Without contraction all round alike. Sanitizers cannot run that
// early.
#ifndef RANGEEDGE_WIDEST
#define RANGEEDGE_WIDEST 64
#endif
#if !defined(__x86_64__) || !defined(__gnu_linux__) || defined(__clang__) || defined(__SANITIZE_ADDRESS__) || \
    defined(__SANITIZE_THREAD__) || RANGEEDGE_WIDEST == 16
#define RANGEEDGE_WIDE
#define RANGEEDGE_VERSIONS(result, name, parameters, arguments) \
    RANGEEDGE_VERSION(, 16, result, name, parameters, arguments)
#elif RANGEEDGE_WIDEST == 32
#define RANGEEDGE_WIDE __attribute__((target_clones("avx2", "default")))
#define RANGEEDGE_VERSIONS(result, name, parameters, arguments)                                 \
    RANGEEDGE_VERSION(__attribute__((target("avx2"))), 32, result, name, parameters, arguments) \
    RANGEEDGE_VERSION(__attribute__((target("default"))), 16, result, name, parameters, arguments)
#else
#define RANGEEDGE_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#define RANGEEDGE_VERSIONS(result, name, parameters, arguments)                                                    \
    RANGEEDGE_VERSION(__attribute__((target("avx512f,avx512bw,avx512dq,avx512vl"))), 64, result, name, parameters, \
                      arguments)                                                                                   \
    RANGEEDGE_VERSION(__attribute__((target("avx2"))), 32, result, name, parameters, arguments)                    \
    RANGEEDGE_VERSION(__attribute__((target("default"))), 16, result, name, parameters, arguments)
#endif
#define RANGEEDGE_VERSION(target, bytes, result, name, parameters, arguments) \
    target result name parameters { return name##_in<bytes> arguments; }

// Before a loop whose iterations do not depend on each other.
#if defined(__clang__)
#define RANGEEDGE_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#else
#define RANGEEDGE_INDEPENDENT _Pragma("GCC ivdep")
#endif

namespace rangeedge {

// How many samples beyond a line's end loops in lanes may read.
constexpr int padding = 16;

// 64 bytes of T (float, int or double), in vectors of `bytes` bytes. Neither what a lane holds nor the order in which
// lanes are joined depends on that width.
template <class T, int bytes>
struct Lanes {
    typedef T Vector __attribute__((vector_size(bytes)));
    static constexpr int count = 64 / sizeof(T), parts = 64 / bytes, width = bytes / static_cast<int>(sizeof(T));
    Vector part[parts];

    static RANGEEDGE_INLINE Lanes all(T value) {
        T values[count];
        for (T& v : values) v = value;
        return load(values);
    }
    // first, first + 1, ...
    static RANGEEDGE_INLINE Lanes from(T first) {
        static constexpr T steps[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
        return load(steps) + all(first);
    }
    static RANGEEDGE_INLINE Lanes load(const T* values) {
        Lanes r;
        for (int p = 0; p < parts; ++p) std::memcpy(&r.part[p], values + p * width, bytes);
        return r;
    }
    RANGEEDGE_INLINE void store(T* values) const {
        for (int p = 0; p < parts; ++p) std::memcpy(values + p * width, &part[p], bytes);
    }
#define RANGEEDGE_OPERATOR(op, assignment)                                      \
    friend RANGEEDGE_INLINE Lanes operator op(const Lanes& a, const Lanes& b) { \
        Lanes r;                                                                \
        for (int p = 0; p < parts; ++p) r.part[p] = a.part[p] op b.part[p];     \
        return r;                                                               \
    }                                                                           \
    RANGEEDGE_INLINE Lanes& operator assignment(const Lanes& b) { return *this = *this op b; }
    RANGEEDGE_OPERATOR(+, +=)
    RANGEEDGE_OPERATOR(-, -=)
    RANGEEDGE_OPERATOR(*, *=)
    RANGEEDGE_OPERATOR(&, &=)  // of ints
    RANGEEDGE_OPERATOR(|, |=)
    RANGEEDGE_OPERATOR(^, ^=)
#undef RANGEEDGE_OPERATOR

    // Joins the lanes, two by two, each one of the first half with that of the second half, and so on. `join` takes
    // vectors as well as numbers.
    template <class Join>
    RANGEEDGE_INLINE T reduce(Join&& join) const {
        Lanes r = *this;
        for (int half = parts / 2; half > 0; half /= 2)
            for (int p = 0; p < half; ++p) r.part[p] = join(r.part[p], r.part[p + half]);
        return reduce_halves<bytes>(r.part[0], join);
    }
    RANGEEDGE_INLINE T sum() const {
        return reduce([](auto a, auto b) RANGEEDGE_ALWAYS { return a + b; });
    }

private:
    template <int size, class Join>
    static RANGEEDGE_INLINE T reduce_halves(const Vector& v, Join&& join) {
        if constexpr (size > 16) {
            typedef Lanes<T, size / 2> Half;
            typename Half::Vector low, high;
            std::memcpy(&low, &v, sizeof low);
            std::memcpy(&high, reinterpret_cast<const char*>(&v) + sizeof low, sizeof high);
            return Half::template reduce_halves<size / 2>(join(low, high), join);
        } else if constexpr (width == 4) {
            return join(join(v[0], v[2]), join(v[1], v[3]));
        } else {
            return join(v[0], v[1]);
        }
    }
    template <class, int>
    friend struct Lanes;
};

// Sixteen floats or ints, eight doubles.
template <int bytes>
using Floats = Lanes<float, bytes>;
template <int bytes>
using Ints = Lanes<int, bytes>;
template <int bytes>
using Doubles = Lanes<double, bytes>;

template <int bytes>
RANGEEDGE_INLINE Doubles<bytes> load_doubles(const float* values) {
    typedef float Half __attribute__((vector_size(bytes / 2)));
    Doubles<bytes> r;
    for (int p = 0; p < r.parts; ++p) {
        Half half;
        std::memcpy(&half, values + p * r.width, sizeof half);
        r.part[p] = __builtin_convertvector(half, typename Doubles<bytes>::Vector);
    }
    return r;
}

template <int bytes>
RANGEEDGE_INLINE Ints<bytes> bits(const Floats<bytes>& a) {
    Ints<bytes> r;
    std::memcpy(&r, &a, sizeof r);
    return r;
}
template <int bytes>
RANGEEDGE_INLINE Floats<bytes> from_bits(const Ints<bytes>& a) {
    Floats<bytes> r;
    std::memcpy(&r, &a, sizeof r);
    return r;
}

template <int bytes>
RANGEEDGE_INLINE Floats<bytes> abs(const Floats<bytes>& a) {
    return from_bits(bits(a) & Ints<bytes>::all(0x7fffffff));
}
template <int bytes>
RANGEEDGE_INLINE Doubles<bytes> abs(const Doubles<bytes>& a) {
    typedef Lanes<std::int64_t, bytes> Bits;
    Bits r;
    std::memcpy(&r, &a, sizeof r);
    r &= Bits::all(0x7fffffffffffffff);
    Doubles<bytes> result;
    std::memcpy(&result, &r, sizeof result);
    return result;
}

// The first n lanes, and 0 in the others. The mask is a stretch of the array below that begins n words before the clear
// ones.
template <class T, int bytes>
RANGEEDGE_INLINE Lanes<T, bytes> keep_first(const Lanes<T, bytes>& a, int n) {
    typedef std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t> Bits;
    using M = Lanes<Bits, bytes>;
    constexpr int count = M::count;
    alignas(64) static constexpr Bits set_then_clear[32] = {-1, -1, -1, -1, -1, -1, -1, -1,
                                                            -1, -1, -1, -1, -1, -1, -1, -1};
    M m;
    std::memcpy(&m, &a, sizeof m);
    m &= M::load(set_then_clear + 16 - std::min(n, count));
    Lanes<T, bytes> r;
    std::memcpy(&r, &m, sizeof r);
    return r;
}

// All bits where a < 0, else none.
template <int bytes>
RANGEEDGE_INLINE Ints<bytes> sign_mask(const Ints<bytes>& a) {
    Ints<bytes> r;
    for (int p = 0; p < r.parts; ++p) r.part[p] = a.part[p] >> 31;
    return r;
}

// a where all bits are set, b where none is.
template <int bytes>
RANGEEDGE_INLINE Floats<bytes> select(const Ints<bytes>& where, const Floats<bytes>& a, const Floats<bytes>& b) {
    return from_bits(bits(b) ^ ((bits(a) ^ bits(b)) & where));
}

}  // namespace rangeedge
