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
constexpr int align_rounds = 2;
constexpr int kinds = jump_bit | convex_bit | concave_bit;

struct Vector {
    double x, y, z;
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

    // Calls visit(candidate, index in the vector that was copied) for all of them, cell by cell.
    template <class Visit>
    void for_each(int threads, Visit&& visit) const {
        parallel_for(static_cast<int>(candidates_.size()), threads, [&](int begin, int end, int) {
            for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k)
                visit(candidates_[k], static_cast<std::size_t>(places_[k].index));
        });
    }

    // Calls visit(candidate, weight) for c itself and every candidate within reach that shares a kind with it.
    template <class Visit>
    void for_each_near(const Candidate& c, Visit&& visit) const {
        const int u = column(c), v = row(c);
        const int left = std::max(0, u - 1), right = std::min(cols_ - 1, u + 1);
        for (int y = std::max(0, v - 1); y <= std::min(rows_ - 1, v + 1); ++y) {
            const auto last = start_[cell(right, y) + 1];
            for (auto first = start_[cell(left, y)]; first < last; first += block_size)
                visit_block(first, std::min(last, first + block_size), c, visit);
        }
    }

private:
    static constexpr int cell_size = 4;  // pixels, no less than the reach
    static constexpr int block_size = 64;

    // What the search needs to know of a candidate.
    struct Place {
        float x, y;
        int kind;
        std::int32_t index;
    };

    // Lists those within reach before it visits them: a branch on each would be mispredicted too often.
    template <class Visit>
    void visit_block(std::int32_t first, std::int32_t last, const Candidate& c, Visit&& visit) const {
        float weights[block_size];
        std::int32_t near[block_size];
        int count = 0;
        for (auto k = first; k < last; ++k) {
            const Place& n = places_[static_cast<std::size_t>(k)];
            const float du = n.x - c.x, dv = n.y - c.y;
            const float rest = 1 - (du * du + dv * dv) / (reach * reach);
            weights[count] = rest * rest;
            near[count] = k;
            count += static_cast<int>(rest > 0) & static_cast<int>((n.kind & c.kind) != 0);
        }
        for (int i = 0; i < count; ++i) visit(candidates_[static_cast<std::size_t>(near[i])], weights[i]);
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

float joint_significance(const Grid& grid, const Candidate& c) {
    float sum = 0;
    grid.for_each_near(c, [&](const Candidate& n, float weight) {
        const float s = std::min(n.significance, capped);
        sum += weight * s * s;
    });
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

CommonLine common_line(const Grid& grid, const Candidate& c) {
    double n = 0, mx = 0, my = 0, sxx = 0, sxy = 0, syy = 0;
    grid.for_each_near(c, [&](const Candidate& near, float weight) {
        const double w = static_cast<double>(weight), x = static_cast<double>(near.x - c.x), y = static_cast<double>(near.y - c.y);
        n += w, mx += w * x, my += w * y, sxx += w * x * x, sxy += w * x * y, syy += w * y * y;
    });
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
    return {c.direction == 2 ? 0 : 1, c.direction == 1 ? 0 : c.direction == 4 ? -1 : 1};
}

// Moves a crease along its scan line onto the line it has in common with its neighbours, unless that leads off the data.
template <class T>
void align(const Grid& grid, const Candidate& c, const RangeImage<T>& image, double max_shift, Candidate& moved) {
    if ((c.kind & jump_bit) || !(c.crease > 0)) return;
    const CommonLine line = common_line(grid, c);
    const Step step = step_of(c);
    const double along = step.dcol * line.across[0] + step.drow * line.across[1];
    if (!line.found || std::abs(along) < 0.3) return;
    const double shift = line.offset / along;
    if (std::abs(shift) > max_shift) return;
    const double x = static_cast<double>(c.x) + shift * step.dcol, y = static_cast<double>(c.y) + shift * step.drow;
    const int u = static_cast<int>(step.dcol ? std::floor(x) : std::round(x));
    const int v = static_cast<int>(step.drow > 0 ? std::floor(y) : step.drow < 0 ? std::ceil(y) : std::round(y));
    if (!image.valid_at(u, v) || !image.valid_at(u + step.dcol, v + step.drow)) return;
    moved.x = static_cast<float>(x);
    moved.y = static_cast<float>(y);
    moved.before = v * image.cols + u;
    moved.after = (v + step.drow) * image.cols + u + step.dcol;
}

// The angle between the two surfaces that meet at c, in degrees; negative where its neighbours do not fix it.
double normal_angle(const Grid& grid, const Candidate& c, bool projective) {
    const CommonLine line = common_line(grid, c);
    if (!line.found) return -1;
    const double* across = line.across;
    const double n = line.weight;
    Gradient a, b;
    double place[2] = {0, 0};
    grid.for_each_near(c, [&](const Candidate& near, float weight) {
        const double w = static_cast<double>(weight);
        const Step step = step_of(near);
        const bool forward = step.dcol * across[0] + step.drow * across[1] > 0;
        a.add(near.along, near.sides[forward ? 0 : 1], w);
        b.add(near.along, near.sides[forward ? 1 : 0], w);
        for (int i = 0; i < 2; ++i) place[i] += w * static_cast<double>(near.place[i]);
    });
    for (double& p : place) p /= n;
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
    if (!(least > 0) && !parameters.normals) return;
    // Each step sees all candidates as the step before left them.
    const auto update = [&](auto&& step) {
        const Grid grid(candidates, image.rows, image.cols);
        grid.for_each(parameters.threads, [&](const Candidate& c, std::size_t i) { step(grid, c, candidates[i]); });
    };
    update([](const Grid& grid, const Candidate& c, Candidate& joined) {
        joined.significance = joint_significance(grid, c);
    });
    const auto weak = [&](const Candidate& c) { return c.significance < least; };
    candidates.erase(std::remove_if(candidates.begin(), candidates.end(), weak), candidates.end());
    for (int round = 0; round < align_rounds; ++round)
        update([&](const Grid& grid, const Candidate& c, Candidate& moved) {
            align(grid, c, image, parameters.max_shift, moved);
        });
    if (!parameters.normals) return;
    update([&](const Grid& grid, const Candidate& c, Candidate& measured) {
        const double angle = c.crease > 0 ? normal_angle(grid, c, image.projective) : -1;
        if (angle >= 0) measured.crease = static_cast<float>(angle);
    });
}

template void pool(std::vector<Candidate>&, const RangeImage<float>&, const Parameters&);
template void pool(std::vector<Candidate>&, const RangeImage<double>&, const Parameters&);

}  // namespace rangeedge
