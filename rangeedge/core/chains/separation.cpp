// SPDX-License-Identifier: Apache-2.0
#include "chains/separation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace rangeedge {
namespace {

constexpr double farthest = 1.5;                   // pixels that the line may be moved by at its ends
constexpr double least_area = 1e-9;                // squared pixels
constexpr std::ptrdiff_t pairs_per_conflict = 20;  // pairs of which one may contradict the others

struct Vertex {
    double first, last;  // values of the line at two positions
};

// A convex polygon of lines.
class LineSet {
public:
    explicit LineSet(double reach)
        : vertices_{{{-reach, -reach}, {reach, -reach}, {reach, reach}, {-reach, reach}}}, count_(4) {}

    // Takes away the lines with a.first * first + a.last * last > limit, unless hardly any would be left.
    bool cut(const Vertex& a, double limit) {
        LineSet rest;
        for (std::size_t i = 0; i < count_; ++i) {
            const Vertex &p = vertices_[i], &q = vertices_[i + 1 < count_ ? i + 1 : 0];
            const double here = a.first * p.first + a.last * p.last - limit;
            const double next = a.first * q.first + a.last * q.last - limit;
            if (here <= 0) rest.add(p);
            if ((here < 0 && next > 0) || (here > 0 && next < 0)) {
                const double s = here / (here - next);
                rest.add({p.first + s * (q.first - p.first), p.last + s * (q.last - p.last)});
            }
        }
        if (!(rest.area() > least_area)) return false;
        *this = rest;
        return true;
    }

    Vertex centroid() const {
        double whole = 0;
        Vertex sum{0, 0};
        for_triangles([&](const Vertex& p, const Vertex& q, double twice) {
            whole += twice;
            sum.first += twice * (vertices_[0].first + p.first + q.first) / 3;
            sum.last += twice * (vertices_[0].last + p.last + q.last) / 3;
        });
        return {sum.first / whole, sum.last / whole};
    }

    // The second moments of its area about its centroid, by triangles.
    LineSpread spread(const Vertex& centre) const {
        LineSpread sum;
        double whole = 0;
        for_triangles([&](const Vertex& p, const Vertex& q, double twice) {
            Vertex corners[3] = {vertices_[0], p, q};
            Vertex total{0, 0};
            for (Vertex& v : corners) {
                v.first -= centre.first, v.last -= centre.last;
                total.first += v.first, total.last += v.last;
            }
            const auto add = [&](double& moment, double Vertex::* a, double Vertex::* b) {
                double products = total.*a * total.*b;
                for (const Vertex& v : corners) products += v.*a * v.*b;
                moment += twice * products / 12;
            };
            add(sum.first_first, &Vertex::first, &Vertex::first);
            add(sum.first_last, &Vertex::first, &Vertex::last);
            add(sum.last_last, &Vertex::last, &Vertex::last);
            whole += twice;
        });
        sum.first_first /= whole, sum.first_last /= whole, sum.last_last /= whole;
        return sum;
    }

private:
    LineSet() = default;

    void add(const Vertex& v) {
        if (count_ < vertices_.size()) vertices_[count_++] = v;
    }

    double area() const {
        double twice = 0;
        for_triangles([&](const Vertex&, const Vertex&, double of_one) { twice += of_one; });
        return twice / 2;
    }

    template <class Visit>
    void for_triangles(Visit&& visit) const {
        const Vertex& o = vertices_[0];
        for (std::size_t i = 1; i + 1 < count_; ++i) {
            const Vertex &p = vertices_[i], &q = vertices_[i + 1];
            visit(p, q, (p.first - o.first) * (q.last - o.last) - (p.last - o.last) * (q.first - o.first));
        }
    }

    std::array<Vertex, 32> vertices_;
    std::size_t count_ = 0;
};

}  // namespace

bool separate(const Array<PixelPair>& pairs, AffineFit& fit, LineSpread& spread) {
    const std::ptrdiff_t n = pairs.size();
    if (n < 2) return false;
    double begin = HUGE_VAL, end = -HUGE_VAL;
    for (const PixelPair& p : pairs) {
        begin = std::min({begin, p.upper_position, p.lower_position});
        end = std::max({end, p.upper_position, p.lower_position});
    }
    if (!(end > begin)) return false;
    LineSet lines(farthest);
    const auto below = [&](double position, double value, double sign) {
        const double share = (position - begin) / (end - begin);
        return lines.cut({sign * (1 - share), sign * share}, sign * (value - fit.at(position)));
    };
    // From the middle outward, since what contradicts the others lies at the ends.
    std::ptrdiff_t conflicts = 0;
    for (std::ptrdiff_t k = 0; k < n; ++k) {
        const PixelPair& p = pairs[k % 2 ? n / 2 - 1 - k / 2 : n / 2 + k / 2];
        const bool upper = below(p.upper_position, p.upper, 1), lower = below(p.lower_position, p.lower, -1);
        conflicts += !upper || !lower;
        if (conflicts * pairs_per_conflict > n) return false;
    }
    const Vertex middle = lines.centroid();
    const double slope = (middle.last - middle.first) / (end - begin);
    fit.value += middle.first + slope * (fit.centre - begin);
    fit.slope += slope;
    spread = lines.spread(middle);
    spread.first = begin, spread.last = end;
    return true;
}

}  // namespace rangeedge
