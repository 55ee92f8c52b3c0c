// SPDX-License-Identifier: Apache-2.0
#include "neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "parallel.hpp"

namespace rangeedge {
namespace {

constexpr double degrees = 57.295779513082320877;
constexpr float reach = 4;             // pixels; weights fall from 1 at the candidate itself to 0 there
constexpr float capped = 8;            // a single candidate's share of the evidence
constexpr float lone = 1 / 3.0f;       // what a candidate without neighbours is worth
constexpr int kinds = jump_bit | convex_bit | concave_bit;

struct Vector {
    double x, y, z;
};

// A candidate close to another; the weight falls with the distance.
struct Neighbour {
    const Candidate* candidate;
    float weight;
};

// The first `count` items; reused from candidate to candidate.
struct Neighbours {
    std::vector<Neighbour> items;
    std::size_t count = 0;
    const Neighbour* begin() const { return items.data(); }
    const Neighbour* end() const { return items.data() + count; }
};

// A copy of the candidates by square cells of the image, for those near a given one.
class Grid {
public:
    Grid(const std::vector<Candidate>& candidates, int rows, int cols)
        : rows_(rows / cell_size + 1), cols_(cols / cell_size + 1),
          start_(static_cast<std::size_t>(rows_) * static_cast<std::size_t>(cols_) + 1, 0), places_(candidates.size()),
          candidates_(candidates.size()) {
        for (const Candidate& c : candidates) ++start_[cell(column(c), row(c)) + 1];
        for (std::size_t p = 1; p < start_.size(); ++p) start_[p] += start_[p - 1];
        std::vector<std::int32_t> next(start_.begin(), start_.end() - 1);
        for (std::size_t i = 0; i < candidates.size(); ++i) {
            const Candidate& c = candidates[i];
            const auto k = static_cast<std::size_t>(next[cell(column(c), row(c))]++);
            places_[k] = {c.x, c.y, c.kind & kinds, static_cast<std::int32_t>(i)};
            candidates_[k] = c;
        }
    }

    // Calls visit(candidate, its neighbours, its index in the vector that was copied) for all, cell by cell.
    template <class Visit>
    void for_each(int threads, Visit&& visit) const {
        parallel_for(static_cast<int>(candidates_.size()), threads, [&](int begin, int end, int) {
            Neighbours near;
            for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
                find(candidates_[k], near);
                visit(candidates_[k], near, static_cast<std::size_t>(places_[k].index));
            }
        });
    }

private:
    static constexpr int cell_size = 4;  // pixels, no less than the reach

    // What the search needs to know of a candidate.
    struct Place {
        float x, y;
        int kind;
        std::int32_t index;
    };

    // Finds c itself and every candidate within reach that shares a kind with it.
    void find(const Candidate& c, Neighbours& near) const {
        const int u = column(c), v = row(c);
        const int left = std::max(0, u - 1), right = std::min(cols_ - 1, u + 1);
        near.count = 0;
        for (int y = std::max(0, v - 1); y <= std::min(rows_ - 1, v + 1); ++y) {
            const auto first = static_cast<std::size_t>(start_[cell(left, y)]);
            const auto last = static_cast<std::size_t>(start_[cell(right, y) + 1]);
            if (near.items.size() < near.count + last - first) near.items.resize(2 * (near.count + last - first));
            // Written before it is known to count: a branch on each would be mispredicted too often.
            Neighbour* items = near.items.data();
            std::size_t count = near.count;
            for (std::size_t k = first; k < last; ++k) {
                const Place& n = places_[k];
                const float du = n.x - c.x, dv = n.y - c.y;
                const float rest = 1 - (du * du + dv * dv) / (reach * reach);
                items[count] = {&candidates_[k], rest * rest};
                count += static_cast<std::size_t>(rest > 0) & static_cast<std::size_t>((n.kind & c.kind) != 0);
            }
            near.count = count;
        }
    }

    int column(const Candidate& c) const { return std::min(std::max(static_cast<int>(c.x) / cell_size, 0), cols_ - 1); }
    int row(const Candidate& c) const { return std::min(std::max(static_cast<int>(c.y) / cell_size, 0), rows_ - 1); }
    std::size_t cell(int column, int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(cols_) + static_cast<std::size_t>(column);
    }

    int rows_, cols_;
    std::vector<std::int32_t> start_;
    std::vector<Place> places_;
    std::vector<Candidate> candidates_;
};

float joint_significance(const Candidate& c, const Neighbours& near) {
    float sum = 0;
    for (const Neighbour& n : near) {
        const float s = std::min(n.candidate->significance, capped);
        sum += n.weight * s * s;
    }
    return std::max(std::sqrt(sum), c.significance * lone);
}

// The gradient of a surface's ordinate from slopes along several directions, by weighted least squares.
struct Gradient {
    double xx = 0, xy = 0, yy = 0, xm = 0, ym = 0, value = 0, weight = 0;

    void add(const float along[2], const Side& side, double w) {
        const double x = static_cast<double>(along[0]), y = static_cast<double>(along[1]);
        const double m = static_cast<double>(side.slope);
        // A slope that its samples do not fix says nothing.
        const double ws = side.slope_variance < endless ? w / std::max(static_cast<double>(side.slope_variance), 1e-30) : 0;
        xx += ws * x * x, xy += ws * x * y, yy += ws * y * y;
        xm += ws * x * m, ym += ws * y * m;
        value += w * static_cast<double>(side.value), weight += w;
    }
    // The surface's normal; false where the directions do not fix it.
    bool normal(bool projective, const double place[2], Vector& n) const {
        const double determinant = xx * yy - xy * xy;
        // Parallel directions, apart from rounding, or nearly so.
        if (!(determinant > 1e-9 * (xx + yy) * (xx + yy)) || !(determinant > 0.02 * xx * yy)) return false;
        const double gx = (yy * xm - xy * ym) / determinant, gy = (xx * ym - xy * xm) / determinant;
        // q = gx X + gy Y + g0 is the plane gx x + gy y + g0 z = 1.
        n = {gx, gy, projective ? value / weight - gx * place[0] - gy * place[1] : 1};
        return true;
    }
};

// The line on which a candidate and its neighbours lie: across it, their positions vary least.
struct CommonLine {
    double across[2];  // unit normal
    double offset;     // of the line from the candidate, along `across`
    double weight;     // of all neighbours
    bool found;
};

CommonLine common_line(const Candidate& c, const Neighbours& near) {
    double n = 0, mx = 0, my = 0, sxx = 0, sxy = 0, syy = 0;
    for (const Neighbour& other : near) {
        const double w = static_cast<double>(other.weight);
        const double x = static_cast<double>(other.candidate->x - c.x);
        const double y = static_cast<double>(other.candidate->y - c.y);
        n += w, mx += w * x, my += w * y, sxx += w * x * x, sxy += w * x * y, syy += w * y * y;
    }
    mx /= n, my /= n;
    sxx = sxx / n - mx * mx, sxy = sxy / n - mx * my, syy = syy / n - my * my;
    const double angle = 0.5 * std::atan2(2 * sxy, sxx - syy);  // of the line
    CommonLine line{{-std::sin(angle), std::cos(angle)}, 0, n, sxx + syy > 0.05};
    line.offset = line.across[0] * mx + line.across[1] * my;
    return line;
}

// One step of a candidate's scan line.
struct Step {
    int dcol, drow;
};
Step step_of(const Candidate& c) {
    return {c.direction == cols_bit ? 0 : 1, c.direction == rows_bit ? 0 : c.direction == diag45_bit ? -1 : 1};
}

// Moves a crease along its scan line onto the line it has in common with its neighbours, unless that leads off the data.
template <class T>
void align(const Candidate& c, const Neighbours& near, const RangeImage<T>& image, double max_shift,
           Candidate& moved) {
    if ((c.kind & jump_bit) || !(c.crease > 0)) return;
    const CommonLine line = common_line(c, near);
    const Step step = step_of(c);
    const double along = step.dcol * line.across[0] + step.drow * line.across[1];
    if (!line.found || std::abs(along) < 0.3) return;
    const double shift = line.offset / along, total = static_cast<double>(c.shift) + shift;
    if (std::abs(total) > max_shift) return;
    const double x = static_cast<double>(c.x) + shift * step.dcol, y = static_cast<double>(c.y) + shift * step.drow;
    const int u = static_cast<int>(step.dcol ? std::floor(x) : std::round(x));
    const int v = static_cast<int>(step.drow > 0 ? std::floor(y) : step.drow < 0 ? std::ceil(y) : std::round(y));
    if (!image.valid_at(u, v) || !image.valid_at(u + step.dcol, v + step.drow)) return;
    moved.shift = static_cast<float>(total);
    moved.x = static_cast<float>(x);
    moved.y = static_cast<float>(y);
    moved.before = v * image.cols + u;
    moved.after = (v + step.drow) * image.cols + u + step.dcol;
}

// The angle between the two surfaces that meet at c, in degrees; negative where its neighbours do not fix it.
double normal_angle(const Candidate& c, const Neighbours& near, bool projective) {
    const CommonLine line = common_line(c, near);
    if (!line.found) return -1;
    const double* across = line.across;
    Gradient a, b;
    double place[2] = {0, 0};
    for (const Neighbour& n : near) {
        const Candidate& other = *n.candidate;
        const double w = static_cast<double>(n.weight);
        const Step step = step_of(other);
        const bool forward = step.dcol * across[0] + step.drow * across[1] > 0;
        a.add(other.along, other.sides[forward ? 0 : 1], w);
        b.add(other.along, other.sides[forward ? 1 : 0], w);
        for (int i = 0; i < 2; ++i) place[i] += w * static_cast<double>(other.place[i]);
    }
    for (double& p : place) p /= line.weight;
    Vector na{}, nb{};
    if (!a.normal(projective, place, na) || !b.normal(projective, place, nb)) return -1;
    const Vector cross{na.y * nb.z - na.z * nb.y, na.z * nb.x - na.x * nb.z, na.x * nb.y - na.y * nb.x};
    const double dot = na.x * nb.x + na.y * nb.y + na.z * nb.z;
    return std::atan2(std::sqrt(cross.x * cross.x + cross.y * cross.y + cross.z * cross.z), dot) * degrees;
}

}  // namespace

template <class T>
void pool(std::vector<Candidate>& candidates, const RangeImage<T>& image, const Parameters& parameters) {
    const auto least = static_cast<float>(parameters.min_significance);
    if (!(least > 0 || parameters.max_shift > 0 || parameters.normals)) return;
    // Each step sees all candidates as the step before left them.
    const auto update = [&](auto&& step) {
        const Grid grid(candidates, image.rows, image.cols);
        grid.for_each(parameters.threads, [&](const Candidate& c, const Neighbours& near, std::size_t i) {
            step(c, near, candidates[i]);
        });
    };
    update([](const Candidate& c, const Neighbours& near, Candidate& joined) {
        joined.significance = joint_significance(c, near);
    });
    const auto weak = [&](const Candidate& c) { return c.significance < least; };
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(), weak), candidates.end());
    update([&](const Candidate& c, const Neighbours& near, Candidate& moved) {
        align(c, near, image, parameters.max_shift, moved);
    });
    if (!parameters.normals) return;
    update([&](const Candidate& c, const Neighbours& near, Candidate& measured) {
        const double angle = c.crease > 0 ? normal_angle(c, near, image.projective) : -1;
        if (angle >= 0) measured.crease = static_cast<float>(angle);
    });
}

template void pool(std::vector<Candidate>&, const RangeImage<float>&, const Parameters&);
template void pool(std::vector<Candidate>&, const RangeImage<double>&, const Parameters&);

}  // namespace rangeedge
