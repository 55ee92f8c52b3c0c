// SPDX-License-Identifier: Apache-2.0
#include "scanline.hpp"

#include <cmath>
#include <type_traits>

#include "simd.hpp"

namespace rangeedge {
namespace {

constexpr int exact = 3;  // samples that a quadratic passes through

// Negative lanes are not valid: the bits of a NaN, without its sign, exceed those of infinity.
template <int bytes>
RANGEEDGE_INLINE Ints<bytes> validity(const float* y) {
    return Ints<bytes>::all(0x7f800000) - bits(magnitude(Floats<bytes>::load(y)));
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
        if ((block.joined(join) >= 0) == valid) break;
    }
    for (; k < n; k += I::count) {
        const I invalid = negative(validity<bytes>(y + k)), beyond = I::all(n);
        const I own = I::from(k), exchanged = (own ^ beyond) & invalid;
        const I at = (valid ? own : beyond) ^ exchanged;
        const int first = at.joined([](auto a, auto b) RANGEEDGE_ALWAYS { return a < b ? a : b; });
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

// The quadratic through both end points and the midpoint, y = ym + t (b + a t) with t counted from the midpoint.
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
    T residual(T x, T y) const {
        const T t = x - origin;
        return std::abs(y - (ym + t * (b + a * t)));
    }
};

// The first and the last of some samples; first < 0 where there are none.
struct Ends {
    int first, last;
};

// Where the residual is largest, if it exceeds the line's eps.
template <class T>
Ends worst_of(const Samples<T>& line, const Segment& s) {
    const ThreePoint<T> curve(line, s);
    T most = line.eps;
    Ends at{-1, -1};
    for (int k = s.first + 1; k < s.last; ++k) {
        T r = curve.residual(line.x ? line.x[k] : static_cast<T>(k), line.y[k]);
        if (line.scale) r *= line.scale[k];
        if (r > most) most = r, at = {k, k};
        else if (r == most && at.first >= 0) at.last = k;
    }
    return at;
}

// The same for samples one unit apart, sixteen at a time: each lane keeps its own worst.
template <int bytes>
RANGEEDGE_INLINE Ends worst_in_lanes(const Samples<float>& line, const Segment& s) {
    using F = Floats<bytes>;
    using I = Ints<bytes>;
    const ThreePoint<float> curve(line, s);
    const F ym = F::all(curve.ym), a = F::all(curve.a), b = F::all(curve.b);
    F worst = F::all(-1);
    I at = I::all(s.last), last = I::all(-1);
    const auto look = [&](int k, int count) RANGEEDGE_ALWAYS {
        const F t = F::from(static_cast<float>(k - curve.m));
        F r = magnitude(F::load(line.y + k) - (ym + t * (b + a * t)));
        if (line.scale) r *= F::load(line.scale + k);
        if (count < F::count) r = first_lanes(r, count);
        const I index = I::from(k);
        for (int p = 0; p < F::parts; ++p) {
            const auto larger = r.part[p] > worst.part[p], as_large = r.part[p] >= worst.part[p];
            worst.part[p] = larger ? r.part[p] : worst.part[p];
            at.part[p] = larger ? index.part[p] : at.part[p];
            last.part[p] = as_large ? index.part[p] : last.part[p];
        }
    };
    int k = s.first + 1;
    for (; k + F::count <= s.last; k += F::count) look(k, F::count);
    if (k < s.last) look(k, s.last - k);
    const float most = worst.joined([](auto p, auto q) RANGEEDGE_ALWAYS { return p > q ? p : q; });
    if (!(most > line.eps)) return {-1, -1};
    // Across the lanes, without branches: which is the worst cannot be foretold.
    const F all_most = F::all(most);
    const I beyond = I::all(s.last), before = I::all(-1);
    for (int p = 0; p < F::parts; ++p) {
        const auto here = worst.part[p] == all_most.part[p];
        at.part[p] = here ? at.part[p] : beyond.part[p];
        last.part[p] = here ? last.part[p] : before.part[p];
    }
    return {at.joined([](auto p, auto q) RANGEEDGE_ALWAYS { return p < q ? p : q; }),
            last.joined([](auto p, auto q) RANGEEDGE_ALWAYS { return p > q ? p : q; })};
}

// Of `count` pending nodes, those to be cut; returns how many. Lines without abscissae.
template <int bytes>
RANGEEDGE_INLINE std::size_t find_worst_in(const Samples<float>* lines, const Splitter<float>::Node* nodes,
                                           const int* pending, std::size_t count, Splitter<float>::Worst* worst) {
    std::size_t found = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const Splitter<float>::Node& node = nodes[pending[i]];
        const Ends at = worst_in_lanes<bytes>(lines[node.line], node.segment);
        if (at.first >= 0) worst[found++] = {pending[i], at.first, at.last};
    }
    return found;
}
RANGEEDGE_VERSIONS(std::size_t, find_worst,
                   (const Samples<float>* lines, const Splitter<float>::Node* nodes, const int* pending,
                    std::size_t count, Splitter<float>::Worst* worst),
                   (lines, nodes, pending, count, worst))

// The sample behind which a segment is cut at an extreme one: that joins the neighbour it is closer to, of equally
// close ones that farther from the middle.
template <class T>
int cut_at(const T* y, const Segment& s, int at) {
    const T left = std::abs(y[at] - y[at - 1]), right = std::abs(y[at + 1] - y[at]);
    const bool joins_left = left < right || (left == right && 2 * at < s.first + s.last);
    return joins_left ? at : at - 1;
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
void Splitter<T>::find_worst_of_pending() {
    worst_.resize(pending_.size());
    if constexpr (std::is_same_v<T, float>) {
        if (!lines_.front().x) {
            worst_.resize(find_worst(lines_.data(), nodes_.data(), pending_.data(), pending_.size(), worst_.data()));
            return;
        }
    }
    std::size_t found = 0;
    for (const int i : pending_) {
        const Node& node = nodes_[static_cast<std::size_t>(i)];
        const Ends at = worst_of(lines_[static_cast<std::size_t>(node.line)], node.segment);
        if (at.first >= 0) worst_[found++] = {i, at.first, at.last};
    }
    worst_.resize(found);
}

template <class T>
void Splitter<T>::split() {
    for (; !pending_.empty(); pending_.swap(following_)) {
        find_worst_of_pending();
        std::size_t count = nodes_.size(), follow = 0;
        nodes_.resize(count + 2 * worst_.size());
        following_.resize(3 * worst_.size());
        const auto cut_behind = [&](int i, int cut) {
            Node& node = nodes_[static_cast<std::size_t>(i)];
            const int right = static_cast<int>(count++);
            nodes_[static_cast<std::size_t>(right)] = {{cut + 1, node.segment.last}, node.line, node.next};
            node.segment.last = cut;
            node.next = right;
            return right;
        };
        const auto follow_up = [&](int i) {
            following_[follow] = i;
            follow += static_cast<std::size_t>(nodes_[static_cast<std::size_t>(i)].segment.size() > exact);
        };
        for (const Worst& worst : worst_) {
            const Node& node = nodes_[static_cast<std::size_t>(worst.node)];
            const T* y = lines_[static_cast<std::size_t>(node.line)].y;
            // Of several the one closer to the middle, both where they are equally close: no side is preferred.
            const Segment s = node.segment;
            const int off = worst.first + worst.last - s.first - s.last;
            const int left = cut_at(y, s, off < 0 ? worst.last : worst.first);
            const int right = cut_at(y, s, off > 0 ? worst.first : worst.last);
            const int behind = cut_behind(worst.node, left);
            if (right > left) follow_up(cut_behind(behind, right));
            follow_up(worst.node);
            follow_up(behind);
        }
        nodes_.resize(count);
        following_.resize(follow);
    }
}

template class Splitter<float>;
template class Splitter<double>;

}  // namespace rangeedge
