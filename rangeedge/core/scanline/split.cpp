// SPDX-License-Identifier: Apache-2.0
#include "scanline/split.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "base/simd.hpp"
#include "base/watch.hpp"

namespace rangeedge {
namespace {

constexpr int exact = 3;  // samples through which a quadratic passes

// Negative lanes are not valid: the bits of a NaN, without its sign, exceed those of infinity.
template <int bytes>
RANGEEDGE_INLINE Ints<bytes> validity(const float* y) {
    return Ints<bytes>::all(0x7f800000) - bits(abs(Floats<bytes>::load(y)));
}

// The first sample that is valid or is not: blocks without one are passed over, then lanes; in these it is sought
// without branches.
template <int bytes, bool valid>
RANGEEDGE_INLINE int find_in(const float* y, int k, int n) {
    using I = Ints<bytes>;
    const auto join = [](auto a, auto b) RANGEEDGE_ALWAYS { return valid ? a & b : a | b; };
    for (; k + 4 * I::count <= n; k += 4 * I::count) {
        const I block = join(join(validity<bytes>(y + k), validity<bytes>(y + k + I::count)),
                             join(validity<bytes>(y + k + 2 * I::count), validity<bytes>(y + k + 3 * I::count)));
        if ((block.reduce(join) >= 0) == valid) break;
    }
    for (; k < n; k += I::count) {
        const I invalid = sign_mask(validity<bytes>(y + k)), beyond = I::all(n);
        const I own = I::from(k), exchanged = (own ^ beyond) & invalid;
        const I at = (valid ? own : beyond) ^ exchanged;
        const int first = at.reduce([](auto a, auto b) RANGEEDGE_ALWAYS { return a < b ? a : b; });
        if (first < n) return first;
    }
    return n;
}
template <int bytes>
RANGEEDGE_INLINE int first_valid_in(const float* y, int k, int n) {
    return find_in<bytes, true>(y, k, n);
}
template <int bytes>
RANGEEDGE_INLINE int first_invalid_in(const float* y, int k, int n) {
    return find_in<bytes, false>(y, k, n);
}
RANGEEDGE_VERSIONS(int, first_valid, (const float* y, int k, int n), (y, k, n))
RANGEEDGE_VERSIONS(int, first_invalid, (const float* y, int k, int n), (y, k, n))

// The quadratic through both end points and the midpoint (paper, 4.1), y = ym + t (b + a t) with t counted from the
// midpoint.
template <class T>
struct ThreePoint {
    int m;
    T origin, ym, a, b;

    ThreePoint(const Samples<T>& line, const Segment& s) : m(midpoint(line, s)) {
        origin = line.x ? line.x[m] : static_cast<T>(m);
        ym = line.y[m];
        const T left = line.width(s.first, m), right = line.width(m, s.last), inverse = 1 / line.width(s.first, s.last);
        if (m == s.first) {
            a = 0;
            b = (line.y[s.last] - line.y[m]) * inverse;
            return;
        }
        const T slope_left = (line.y[m] - line.y[s.first]) / left;
        const T slope_right = (line.y[s.last] - line.y[m]) / right;
        a = (slope_right - slope_left) * inverse;
        b = (slope_left * right + slope_right * left) * inverse;
    }
    // |y - f(x)|, that is compared with the tolerance (paper, 4.1); for samples at equal distances find_worst_of_even
    // has it for several at once.
    T residual(T x, T y) const {
        const T t = x - origin;
        return std::abs(y - (ym + t * (b + a * t)));
    }
};

// The first and the last of some samples; negative where there are none.
struct Ends {
    int first = -1, last = -1;
};

// The samples of the largest residual, if that exceeds the line's eps.
template <class T>
Ends worst_samples(const Samples<T>& line, const Segment& s) {
    const ThreePoint<T> curve(line, s);
    T largest = line.eps;
    Ends worst;
    for (int k = s.first + 1; k < s.last; ++k) {
        T r = curve.residual(line.x ? line.x[k] : static_cast<T>(k), line.y[k]);
        if (line.scale) r *= line.scale[k];
        if (r > largest)
            largest = r, worst = {k, k};
        else if (r == largest && worst.first >= 0)
            worst.last = k;
    }
    return worst;
}

// The same for samples one unit apart, several at a time: each lane keeps its own worst.
template <int bytes, class T>
RANGEEDGE_INLINE Ends worst_samples_in(const Samples<T>& line, const Segment& s) {
    using F = Lanes<T, bytes>;
    using I = Lanes<std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>, bytes>;
    const ThreePoint<T> curve(line, s);
    const F ym = F::all(curve.ym), a = F::all(curve.a), b = F::all(curve.b);
    const I beyond = I::all(s.last), before = I::all(-1);
    F worst = F::all(-1);
    I first = beyond, last = before;
    const auto look = [&](int k, int count) RANGEEDGE_ALWAYS {
        const F t = F::from(static_cast<T>(k - curve.m));
        F r = abs(F::load(line.y + k) - (ym + t * (b + a * t)));
        if (line.scale) r *= F::load(line.scale + k);
        if (count < F::count) r = keep_first(r, count);
        const I index = I::from(k);
        for (int p = 0; p < F::parts; ++p) {
            const auto larger = r.part[p] > worst.part[p], as_large = r.part[p] >= worst.part[p];
            worst.part[p] = larger ? r.part[p] : worst.part[p];
            first.part[p] = larger ? index.part[p] : first.part[p];
            last.part[p] = as_large ? index.part[p] : last.part[p];
        }
    };
    int k = s.first + 1;
    for (; k + F::count <= s.last; k += F::count) look(k, F::count);
    if (k < s.last) look(k, s.last - k);
    const T largest = worst.reduce([](auto p, auto q) RANGEEDGE_ALWAYS { return p > q ? p : q; });
    if (!(largest > line.eps)) return {};
    // Of the lanes that have it, without branches: which these are cannot be foretold.
    const F everywhere = F::all(largest);
    for (int p = 0; p < F::parts; ++p) {
        const auto here = worst.part[p] == everywhere.part[p];
        first.part[p] = here ? first.part[p] : beyond.part[p];
        last.part[p] = here ? last.part[p] : before.part[p];
    }
    return {static_cast<int>(first.reduce([](auto p, auto q) RANGEEDGE_ALWAYS { return p < q ? p : q; })),
            static_cast<int>(last.reduce([](auto p, auto q) RANGEEDGE_ALWAYS { return p > q ? p : q; }))};
}

// Of `count` pending nodes, those to be cut; returns how many. Lines without abscissae.
template <int bytes, class T>
RANGEEDGE_INLINE std::ptrdiff_t find_worst_of_even_in(const Samples<T>* lines, const typename Splitter<T>::Node* nodes,
                                                      const int* pending, std::ptrdiff_t count,
                                                      typename Splitter<T>::Worst* worst) {
    std::ptrdiff_t found = 0;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        const typename Splitter<T>::Node& node = nodes[pending[i]];
        const Ends samples = worst_samples_in<bytes>(lines[node.line], node.segment);
        if (samples.first >= 0) worst[found++] = {pending[i], samples.first, samples.last};
    }
    return found;
}
#define RANGEEDGE_FIND_WORST(T)                                                                      \
    RANGEEDGE_VERSIONS(std::ptrdiff_t, find_worst_of_even,                                           \
                       (const Samples<T>* lines, const Splitter<T>::Node* nodes, const int* pending, \
                        std::ptrdiff_t count, Splitter<T>::Worst* worst),                            \
                       (lines, nodes, pending, count, worst))
RANGEEDGE_FIND_WORST(float)
RANGEEDGE_FIND_WORST(double)

// The sample behind which a segment is cut at an extreme one: that joins the neighbour it is closer to, of two that are
// equally close, but for rounding, the one farther from the middle.
template <class T>
int cut_at(const T* y, const Segment& s, int k) {
    const T left = std::abs(y[k] - y[k - 1]), right = std::abs(y[k + 1] - y[k]);
    const T rounding = 4 * std::numeric_limits<T>::epsilon() * std::abs(y[k]);
    const bool joins_left = left < right - rounding || (left <= right + rounding && 2 * k < s.first + s.last);
    return joins_left ? k : k - 1;
}

// Of several extreme samples the one closest to the middle of the segment counts, or both where two are equally close.
template <class T>
Ends cuts_at(const T* y, const Segment& s, int first, int last) {
    const int off = first + last - s.first - s.last;
    return {cut_at(y, s, off < 0 ? last : first), cut_at(y, s, off > 0 ? first : last)};
}

}  // namespace

int find_valid(const float* y, int k, int n) { return first_valid(y, k, n); }
int find_invalid(const float* y, int k, int n) { return first_invalid(y, k, n); }

template <class T>
void Splitter<T>::clear() {
    lines_.clear();
    nodes_.clear();
    heads_.clear();
    pending_.clear();
}

template <class T>
void Splitter<T>::add(const Samples<T>& line) {
    const int own = static_cast<int>(lines_.size());
    lines_.push_back(line);
    heads_.push_back(-1);
    for_each_run(line.y, line.x, line.size, [&](int first, int last) {
        const int node = static_cast<int>(nodes_.size());
        (heads_.back() < 0 ? heads_.back() : nodes_.back().next) = node;
        nodes_.push_back({{first, last}, own, -1});
        if (last - first >= exact) pending_.push_back(node);
    });
}

template <class T>
void Splitter<T>::find_worst() {
    worst_.resize(pending_.size());
    if (!lines_[0].x) {
        worst_.resize(
            find_worst_of_even(lines_.data(), nodes_.data(), pending_.data(), pending_.size(), worst_.data()));
        return;
    }
    std::ptrdiff_t found = 0;
    for (const int node : pending_) {
        const Ends samples = worst_samples(lines_[nodes_[node].line], nodes_[node].segment);
        if (samples.first >= 0) worst_[found++] = {node, samples.first, samples.last};
    }
    worst_.resize(found);
}

template <class T>
void Splitter<T>::split() {
    for (; !pending_.empty(); pending_.swap(following_)) {
        Watch::checkpoint();
        find_worst();
        int count = static_cast<int>(nodes_.size());
        std::ptrdiff_t follow = 0;
        nodes_.resize(count + 2 * worst_.size());
        following_.resize(3 * worst_.size());
        // The part on the right is a new node.
        const auto cut_behind = [&](int i, int sample) {
            Node& node = nodes_[i];
            nodes_[count] = {{sample + 1, node.segment.last}, node.line, node.next};
            node.segment.last = sample;
            node.next = count;
            return count++;
        };
        // Parts that a quadratic may not pass through follow; written first and counted then, without branches.
        const auto follow_up = [&](int i) {
            following_[follow] = i;
            follow += nodes_[i].segment.size() > exact;
        };
        for (const Worst& worst : worst_) {
            const Node& node = nodes_[worst.node];
            const Ends cuts = cuts_at(lines_[node.line].y, node.segment, worst.first, worst.last);
            const int right = cut_behind(worst.node, cuts.first);
            if (cuts.last > cuts.first) follow_up(cut_behind(right, cuts.last));
            follow_up(worst.node);
            follow_up(right);
        }
        nodes_.resize(count);
        following_.resize(follow);
    }
}

template class Splitter<float>;
template class Splitter<double>;

}  // namespace rangeedge
