// The segments of a strip of lines while they are merged: a linked list, from which segments can be removed, whose
// numbers lie in one array each, so that they are computed for several segments side by side. Samples one unit apart,
// those of depth images and grids, need fewer numbers than samples anywhere, those of points.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <vector>

#include "base/array.hpp"
#include "scanline/curve.hpp"
#include "scanline/fit.hpp"
#include "scanline/line.hpp"
#include "scanline/segment.hpp"
#include "scanline/sums.hpp"

namespace rangeedge {

// The segments of all lines of a strip, their curves, and the first one of each line.
struct StripSegments {
    Array<Segment> segments;
    Array<Curve> curves;
    Array<std::ptrdiff_t> starts;

    void clear() {
        segments.clear();
        curves.clear();
        starts.assign(1, 0);
    }
    // Calls visit(line, segment) for all in order.
    template <class T, class Visit>
    void for_each(const std::vector<Line<T>>& lines, Visit&& visit) const {
        for (std::size_t i = 0; i < lines.size(); ++i)
            for (std::ptrdiff_t k = starts[static_cast<int>(i)]; k < starts[static_cast<int>(i) + 1]; ++k)
                visit(lines[i], segments[k]);
    }
};

// In order, with a last one that stands for the end of the list. Arrays have room for a few segments more.
class SegmentList {
public:
    struct Link {
        Segment segment;
        int line, previous, next;
        bool chosen;
    };
    Array<Link> links;
    Array<double> sigma;     // of single samples where the segment ends, 0 where the next one is not adjacent
    Array<double> waves;     // and that of fits to many samples there
    Array<double> least;     // significance of a quadratic term, in the unit of the ordinates
    Array<double> residual;  // sum of squares
    Array<double> cost;      // of taking back the cut on the right

    int end() const { return static_cast<int>(links.size()) - 1; }
    template <class T>
    void fill(const std::vector<Line<T>>& lines, const StripSegments& found);
    // The segments that are left, in place of all; their curves move together.
    void collect(StripSegments& found) const;

    // The noise of fits along the lines of the strip.
    const FitNoise& noise() const { return *noise_; }

private:
    const FitNoise* noise_ = nullptr;
};

// The significance that a quadratic term must have over n samples, in the unit of the ordinates: such a term is the
// difference of the slopes of two halves.
inline double least_quadratic(const SampleNoise& noise, int n, const FitFactors& slope) {
    constexpr double curved_significance = 6;  // standard deviations
    return curved_significance * slope[n / 2] * noise.of_fit(n);
}
// By how much the sum of squared residuals rises where one segment takes the place of two of n and m samples, in
// variances of the fit to the shorter one; of equal costs, rounding included, that of fewer samples is lower.
inline double cost_of_joining(double joint, double left, double right, const SampleNoise& noise, int n, int m,
                              const FitFactors& join) {
    constexpr double tie = 1e-6;  // of a cost, for every sample
    const int shorter = std::min(n, m);
    const double deviation = join[shorter] * noise.of_fit(shorter);
    const double cost = (joint - left - right) / (deviation * deviation) + tie * (n + m);
    return noise.sigma > 0 && cost == cost ? cost : HUGE_VAL;
}

// Of samples one unit apart.
class EvenSegments : public SegmentList {
public:
    template <class T>
    static OrthogonalSums sums_over(const Line<T>& line, const Segment& s);
    template <class T>
    void sum_up(const std::vector<Line<T>>& lines);
    void update_all_costs();
    void update_costs(const Array<int>& cuts);
    void fit(Array<Curve>& curves) const;

    OrthogonalSums sums(int i) const {
        return {sums_[n][i], sums_[mean][i], sums_[y1][i], sums_[y2][i], sums_[squares][i]};
    }
    void set_sums(int i, const OrthogonalSums& p) {
        sums_[n][i] = p.n, sums_[mean][i] = p.mean, sums_[y1][i] = p.y1, sums_[y2][i] = p.y2;
        sums_[squares][i] = p.squares;
    }
    Curve curve(int i) const { return fit_least_squares(sums(i), links[i].segment.first, least[i]); }

private:
    enum Column { n, mean, y1, y2, squares, columns };
    double* column(Column c) { return sums_[c].data(); }

    Array<double> sums_[columns], base_, gathered_;
};

// Of other samples.
class UnevenSegments : public SegmentList {
public:
    template <class T>
    static PowerSums sums_over(const Line<T>& line, const Segment& s);
    template <class T>
    void sum_up(const std::vector<Line<T>>& lines);
    void update_all_costs();
    void update_costs(const Array<int>& cuts);
    void fit(Array<Curve>& curves) const;

    const PowerSums& sums(int i) const { return sums_[i]; }
    void set_sums(int i, const PowerSums& sums) { sums_[i] = sums; }
    Curve curve(int i) const { return fit_least_squares(sums_[i], least[i]); }

private:
    void update_cost(int i);

    Array<PowerSums> sums_;
};

}  // namespace rangeedge
