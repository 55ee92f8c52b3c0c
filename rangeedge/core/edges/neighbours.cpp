// SPDX-License-Identifier: Apache-2.0
#include "edges/neighbours.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>

#include "base/simd.hpp"

namespace rangeedge {
namespace {

constexpr float reach = Cells::size;   // pixels; weights fall from 1 at the candidate itself to 0 there
constexpr float capped = 8;            // a single candidate's share of the evidence
constexpr float lone = 1 / 3.0f;       // what a candidate without neighbours is worth
constexpr float precise = 1e30f;       // at most so much does a slope count
constexpr int kinds = jump_bit | convex_bit | concave_bit;
constexpr int direction_shift = 8;     // of the bit of a direction, beside the kinds
constexpr int lanes = Floats<16>::count;

// What neighbours are asked for; one array each.
enum Field { x_field, y_field, evidence_field, fields_of_lines };
enum TangentField {
    along_x = y_field + 1, along_y, place_x, place_y,
    precision, slope = precision + 2, value = slope + 2,  // of either side
    fields_of_tangents = value + 2
};

// What sums over neighbours need of candidates, by cells, in arrays that may be read a few lanes beyond their end.
class Grid {
public:
    Grid(const std::vector<Candidate>& candidates, int rows, int cols, int fields)
        : cells_(rows, cols), stride_(candidates.size() + lanes), order_(candidates.size()), kinds_(stride_, 0),
          fields_(stride_ * static_cast<std::size_t>(fields), 0.0f) {
        cells_.count(candidates);
        cells_.place(candidates, [&](const Candidate& c, std::size_t k) {
            order_[k] = static_cast<std::int32_t>(&c - candidates.data());
            kinds_[k] = (c.kind & kinds) | c.direction << direction_shift;
            field(x_field)[k] = c.x;
            field(y_field)[k] = c.y;
        });
    }

    float* field(int f) { return fields_.data() + stride_ * static_cast<std::size_t>(f); }
    const float* field(int f) const { return fields_.data() + stride_ * static_cast<std::size_t>(f); }
    const int* kinds_of_all() const { return kinds_.data(); }
    // Calls visit(index of a candidate, its place in the arrays) for all.
    template <class Visit>
    void for_each(Visit&& visit) const {
        for (std::size_t k = 0; k < order_.size(); ++k) visit(static_cast<std::size_t>(order_[k]), k);
    }
    // From now on the candidate at place k is nobody's neighbour.
    void remove(std::size_t k) { kinds_[k] = 0; }

    // A candidate and the places, in three rows of cells, where its neighbours are.
    struct Near {
        const Grid* grid;
        float x, y;
        int kinds;
        int first[3], last[3];
    };

    // Calls visit(index, near) for all candidates, several rows of cells at a time.
    template <class Visit>
    void for_each_near(Team& team, Visit&& visit) const {
        std::atomic<int> taken{0};
        team.run([&](int) {
            for (int row; (row = taken++) < cells_.rows();)
                for (int col = 0; col < cells_.cols(); ++col) visit_cell(col, row, visit);
        });
    }

private:
    template <class Visit>
    void visit_cell(int col, int row, Visit&& visit) const {
        const int begin = cells_.begin(col, row), end = cells_.end(col, row);
        if (begin == end) return;
        Near near{this, 0, 0, 0, {}, {}};
        const int left = std::max(0, col - 1), right = std::min(cells_.cols() - 1, col + 1);
        for (int i = 0; i < 3; ++i) {
            const int y = row + i - 1;
            if (y < 0 || y >= cells_.rows()) continue;
            near.first[i] = cells_.begin(left, y);
            near.last[i] = cells_.end(right, y);
        }
        for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
            near.x = field(x_field)[k];
            near.y = field(y_field)[k];
            near.kinds = kinds_[k] & kinds;
            visit(static_cast<std::size_t>(order_[k]), near);
        }
    }

    Cells cells_;
    std::size_t stride_;
    std::vector<std::int32_t> order_;
    std::vector<int> kinds_;
    std::vector<float> fields_;
};

// Calls visit(k, weights, dx, dy) for the candidates k, k + 1, ... several at a time: their distances from
// the one they are near, and weights that fall with these and are 0 for those beyond reach or of another kind.
template <int bytes, class Visit>
RANGEEDGE_INLINE void for_each_lanes(const Grid::Near& near, Visit&& visit) {
    using F = Floats<bytes>;
    using I = Ints<bytes>;
    const float *x = near.grid->field(x_field), *y = near.grid->field(y_field);
    const int* kinds_there = near.grid->kinds_of_all();
    const F cx = F::all(near.x), cy = F::all(near.y), one = F::all(1), share = F::all(1 / (reach * reach));
    const F half = F::all(0.5f);
    const I own = I::all(near.kinds), none = I::all(0);
    for (int i = 0; i < 3; ++i)
        for (int k = near.first[i]; k < near.last[i]; k += lanes) {
            const F dx = F::load(x + k) - cx, dy = F::load(y + k) - cy;
            F rest = one - (dx * dx + dy * dy) * share;
            rest = half * (rest + magnitude(rest));  // 0 where negative
            const I alike = negative(none - (I::load(kinds_there + k) & own));
            const I counts = alike & negative(I::from(k) - I::all(near.last[i]));
            visit(k, from_bits(bits(rest * rest) & counts), dx, dy);
        }
}

template <int bytes>
RANGEEDGE_INLINE float evidence_in(const Grid::Near& near) {
    using F = Floats<bytes>;
    const float* evidence = near.grid->field(evidence_field);
    F sum = F::all(0);
    for_each_lanes<bytes>(near, [&](int k, const F& w, const F&, const F&) RANGEEDGE_ALWAYS {
        sum += w * F::load(evidence + k);
    });
    return sum.sum();
}
RANGEEDGE_VERSIONS(float, evidence, (const Grid::Near& near), (near))

// Weighted sums of the places of neighbours.
struct PlaceSums {
    float n, x, y, xx, xy, yy;
};

template <int bytes>
RANGEEDGE_INLINE PlaceSums place_sums_in(const Grid::Near& near) {
    using F = Floats<bytes>;
    F n = F::all(0), x = n, y = n, xx = n, xy = n, yy = n;
    for_each_lanes<bytes>(near, [&](int, const F& w, const F& dx, const F& dy) RANGEEDGE_ALWAYS {
        const F wx = w * dx, wy = w * dy;
        n += w, x += wx, y += wy, xx += wx * dx, xy += wx * dy, yy += wy * dy;
    });
    return {n.sum(), x.sum(), y.sum(), xx.sum(), xy.sum(), yy.sum()};
}
RANGEEDGE_VERSIONS(PlaceSums, place_sums, (const Grid::Near& near), (near))

// The line on which a candidate and its neighbours lie: across it, their positions vary least.
struct CommonLine {
    double across[2];  // unit normal
    double offset;     // of the line from the candidate, along `across`
    bool found;
};

CommonLine common_line(const Grid::Near& near) {
    const PlaceSums sums = place_sums(near);
    const double share = 1 / double{sums.n}, mx = sums.x * share, my = sums.y * share;
    const double sxx = sums.xx * share - mx * mx, sxy = sums.xy * share - mx * my, syy = sums.yy * share - my * my;
    // The line runs at half the angle of (sxx - syy, 2 sxy).
    const double spread = std::sqrt((sxx - syy) * (sxx - syy) + 4 * sxy * sxy);
    const double cosine = spread > 0 ? (sxx - syy) / spread : 1, sine = spread > 0 ? 2 * sxy / spread : 0;
    const double larger = std::sqrt((1 + std::abs(cosine)) / 2), smaller = std::abs(sine) / (2 * larger);
    CommonLine line{};
    line.across[0] = -std::copysign(cosine >= 0 ? smaller : larger, sine);
    line.across[1] = cosine >= 0 ? larger : smaller;
    line.offset = line.across[0] * mx + line.across[1] * my;
    line.found = sxx + syy > 0.05;
    return line;
}

// For the gradient of a surface's ordinate from slopes along several directions, by weighted least squares.
struct GradientSums {
    float xx, xy, yy, xm, ym, value;

    // The surface's normal; false where the directions do not fix it.
    bool normal(bool projective, const double place[2], double weight, double n[3]) const {
        const double x2 = xx, y2 = yy, determinant = x2 * y2 - double{xy} * xy;
        // Parallel directions, apart from rounding, or nearly so.
        if (!(determinant > 1e-9 * (x2 + y2) * (x2 + y2)) || !(determinant > 0.02 * x2 * y2)) return false;
        n[0] = (y2 * xm - double{xy} * ym) / determinant, n[1] = (x2 * ym - double{xy} * xm) / determinant;
        // q = gx X + gy Y + g0 is the plane gx x + gy y + g0 z = 1.
        n[2] = projective ? value / weight - n[0] * place[0] - n[1] * place[1] : 1;
        return true;
    }
};

// Sums over the tangents on either side of an edge.
struct TangentSums {
    GradientSums sides[2];
    float weight, place[2];
};

template <int bytes>
RANGEEDGE_INLINE TangentSums tangent_sums_in(const Grid::Near& near, int forward_directions) {
    using F = Floats<bytes>;
    using I = Ints<bytes>;
    const auto load = [&near](int field, int k) RANGEEDGE_ALWAYS { return F::load(near.grid->field(field) + k); };
    const F zero = F::all(0);
    const I forward_bits = I::all(forward_directions << direction_shift), none = I::all(0);
    const int* bits_of_all = near.grid->kinds_of_all();
    F weight = zero, u = zero, v = zero;
    F xx[2] = {zero, zero}, xy[2] = {zero, zero}, yy[2] = {zero, zero};
    F xm[2] = {zero, zero}, ym[2] = {zero, zero}, values[2] = {zero, zero};
    for_each_lanes<bytes>(near, [&](int k, const F& w, const F&, const F&) RANGEEDGE_ALWAYS {
        const F x = load(along_x, k), y = load(along_y, k);
        weight += w, u += w * load(place_x, k), v += w * load(place_y, k);
        // A neighbour whose line crosses the edge the other way has the sides exchanged.
        const I forward = negative(none - (I::load(bits_of_all + k) & forward_bits));
        for (int i = 0; i < 2; ++i) {
            const auto on_side = [&](int field) RANGEEDGE_ALWAYS {
                return select(forward, load(field + i, k), load(field + 1 - i, k));
            };
            const F p = w * on_side(precision), m = on_side(slope), px = p * x, py = p * y;
            xx[i] += px * x, xy[i] += px * y, yy[i] += py * y;
            xm[i] += px * m, ym[i] += py * m;
            values[i] += w * on_side(value);
        }
    });
    TangentSums sums{};
    for (int i = 0; i < 2; ++i)
        sums.sides[i] = {xx[i].sum(), xy[i].sum(), yy[i].sum(), xm[i].sum(), ym[i].sum(), values[i].sum()};
    sums.weight = weight.sum();
    sums.place[0] = u.sum(), sums.place[1] = v.sum();
    return sums;
}
RANGEEDGE_VERSIONS(TangentSums, tangent_sums, (const Grid::Near& near, int forward_directions),
                   (near, forward_directions))

// One step along a scan line.
struct Step {
    int dcol, drow;
};
Step step_of(int direction) {
    return {direction == cols_bit ? 0 : 1, direction == rows_bit ? 0 : direction == diag45_bit ? -1 : 1};
}

// Moves a crease along its scan line onto the line it has in common with its neighbours, unless that leads off the
// data.
template <class T>
void align(Candidate& c, const Grid::Near& near, const RangeImage<T>& image, double max_shift) {
    if ((c.kind & jump_bit) || !(c.crease > 0)) return;
    const CommonLine line = common_line(near);
    const Step step = step_of(c.direction);
    const double along = step.dcol * line.across[0] + step.drow * line.across[1];
    if (!line.found || std::abs(along) < 0.3) return;
    const double shift = line.offset / along, total = static_cast<double>(c.shift) + shift;
    if (std::abs(total) > max_shift) return;
    const double x = static_cast<double>(c.x) + shift * step.dcol, y = static_cast<double>(c.y) + shift * step.drow;
    const int u = static_cast<int>(step.dcol ? std::floor(x) : std::round(x));
    const int v = static_cast<int>(step.drow > 0 ? std::floor(y) : step.drow < 0 ? std::ceil(y) : std::round(y));
    if (!image.valid_at(u, v) || !image.valid_at(u + step.dcol, v + step.drow)) return;
    c.shift = static_cast<float>(total);
    c.x = static_cast<float>(x);
    c.y = static_cast<float>(y);
    c.before = v * image.cols + u;
    c.after = (v + step.drow) * image.cols + u + step.dcol;
}

// The angle between the two surfaces that meet at a candidate, in degrees; negative where its neighbours do not fix it.
double normal_angle(const Grid::Near& near, bool projective) {
    const CommonLine line = common_line(near);
    if (!line.found) return -1;
    int forward = 0;  // the directions whose lines cross the edge as the candidate's normal does
    for (const int direction : {rows_bit, cols_bit, diag45_bit, diag135_bit}) {
        const Step step = step_of(direction);
        if (step.dcol * line.across[0] + step.drow * line.across[1] > 0) forward |= direction;
    }
    const TangentSums sums = tangent_sums(near, forward);
    const double place[2] = {sums.place[0] / sums.weight, sums.place[1] / sums.weight};
    double a[3], b[3];
    for (int i = 0; i < 2; ++i)
        if (!sums.sides[i].normal(projective, place, sums.weight, i ? b : a)) return -1;
    const double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    const double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    return degrees_of(std::sqrt(x * x + y * y + z * z), dot);
}

// The grid of candidates with what `normal_angle` asks of them.
Grid tangents_of(const std::vector<Candidate>& candidates, int rows, int cols) {
    Grid grid(candidates, rows, cols, fields_of_tangents);
    grid.for_each([&](std::size_t i, std::size_t k) {
        const Candidate& c = candidates[i];
        // Zero times infinity would spoil sums in which a candidate has no weight.
        const auto finite = [](float v) { return std::isfinite(v) ? v : 0.0f; };
        grid.field(along_x)[k] = finite(c.along[0]), grid.field(along_y)[k] = finite(c.along[1]);
        grid.field(place_x)[k] = finite(c.place[0]), grid.field(place_y)[k] = finite(c.place[1]);
        for (int side = 0; side < 2; ++side) {
            const Side& s = c.sides[side];
            // A slope that its samples do not fix says nothing.
            const bool fixed = s.slope_variance < endless && std::isfinite(s.slope);
            grid.field(precision + side)[k] = fixed ? std::min(1 / s.slope_variance, precise) : 0;
            grid.field(slope + side)[k] = finite(s.slope);
            grid.field(value + side)[k] = finite(s.value);
        }
    });
    return grid;
}

}  // namespace

template <class T>
void pool(std::vector<Candidate>& candidates, const RangeImage<T>& image, const Parameters& parameters, Team& team) {
    const auto least = static_cast<float>(parameters.min_significance);
    const bool aligned = parameters.max_shift > 0;
    if (!(least > 0 || aligned || parameters.normals)) return;
    const auto weak = [&](const Candidate& c) { return c.significance < least; };
    {
        Grid grid(candidates, image.rows, image.cols, fields_of_lines);
        grid.for_each([&](std::size_t i, std::size_t k) {
            const float s = std::min(candidates[i].significance, capped);
            grid.field(evidence_field)[k] = s * s;
        });
        grid.for_each_near(team, [&](std::size_t i, const Grid::Near& near) {
            Candidate& c = candidates[i];
            c.significance = std::max(std::sqrt(evidence(near)), c.significance * lone);
        });
        if (aligned) {
            grid.for_each([&](std::size_t i, std::size_t k) {
                if (weak(candidates[i])) grid.remove(k);
            });
            grid.for_each_near(team, [&](std::size_t i, const Grid::Near& near) {
                if (!weak(candidates[i])) align(candidates[i], near, image, parameters.max_shift);
            });
        }
    }
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(), weak), candidates.end());
    if (!parameters.normals) return;
    const Grid tangents = tangents_of(candidates, image.rows, image.cols);
    tangents.for_each_near(team, [&](std::size_t i, const Grid::Near& near) {
        Candidate& c = candidates[i];
        const double angle = c.crease > 0 ? normal_angle(near, image.projective) : -1;
        if (angle >= 0) c.crease = static_cast<float>(angle);
    });
}

template void pool(std::vector<Candidate>&, const RangeImage<float>&, const Parameters&, Team&);
template void pool(std::vector<Candidate>&, const RangeImage<double>&, const Parameters&, Team&);

}  // namespace rangeedge
