// A scan line as a sequence of segments, each with its curve.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <vector>

#include "scanline/fit.hpp"
#include "scanline/line.hpp"
#include "scanline/split.hpp"

namespace rangeedge {

// The segments of one line and their curves.
struct Approximation {
    const Segment* segments;
    const Curve* curves;
    std::size_t count;
};

// Segments while they are joined: the list of those of all lines of a strip, in order, and of a last one that stands
// for its end. Numbers of all are kept apart, to be computed side by side; there is room for a few more.
struct Pieces {
    struct Link {
        Segment segment;
        int line, previous, next;
        bool chosen;
    };
    std::vector<Link> links;
    std::vector<double> sigma;     // of the noise where the segment ends, 0 where the next one is not adjacent
    std::vector<double> least;     // significance of a quadratic term, in the unit of the ordinates
    std::vector<double> residual;  // sum of squares
    std::vector<double> cost;      // of taking back the cut on the right

    void resize(std::size_t count);
    int end() const { return static_cast<int>(links.size()) - 1; }
};

// With the sums over segments of samples one unit apart.
class EvenPieces : public Pieces {
public:
    template <class T>
    static Projections sums_over(const Line<T>& line, const Segment& s);
    template <class T>
    void fit(const std::vector<Line<T>>& lines);
    void price_all();
    void price(const std::vector<int>& cuts);
    Projections sums(int i) const;
    void set_sums(int i, const Projections& p);
    Curve curve(int i) const;

private:
    enum Column { n, mean, y1, y2, squares, columns };
    double* column(Column c) { return sums_[c].data(); }
    std::vector<double> sums_[columns], base_, gathered_;
};

// With the sums over segments of other samples.
class UnevenPieces : public Pieces {
public:
    template <class T>
    static Moments sums_over(const Line<T>& line, const Segment& s);
    template <class T>
    void fit(const std::vector<Line<T>>& lines);
    void price_all();
    void price(const std::vector<int>& cuts);
    const Moments& sums(int i) const { return sums_[static_cast<std::size_t>(i)]; }
    void set_sums(int i, const Moments& moments) { sums_[static_cast<std::size_t>(i)] = moments; }
    Curve curve(int i) const;

private:
    void price(std::size_t i);
    std::vector<Moments> sums_;
};

// Approximates strip after strip; what it needs for that is reused.
template <class T>
class Approximator {
public:
    explicit Approximator(const Parameters& parameters) : parameters_(parameters) {}

    // Splits the lines (section 4.1), fits a curve to every segment (4.2, end), takes back cuts that the noise
    // explains, and gives segments that lie across an edge to the surfaces beside it.
    void approximate(const Strip<T>& strip);
    // Of the i-th line; holds until the next call of `approximate`.
    Approximation line(std::size_t i) const {
        return {segments_.data() + starts_[i], curves_.data() + starts_[i], starts_[i + 1] - starts_[i]};
    }

private:
    void split(const Strip<T>& strip);
    void interpolate(const Strip<T>& strip);
    template <class P>
    void fit(const Strip<T>& strip, P& pieces);

    Parameters parameters_;
    Splitter<T> splitter_;
    std::vector<Segment> segments_;
    std::vector<Curve> curves_;
    std::vector<std::size_t> starts_;  // of lines in both
    EvenPieces even_;
    UnevenPieces uneven_;
    std::vector<int> cuts_, chosen_;
};

// Where f and g meet, the place nearest `near`; false where they do not. Places farther than `reach` are not sought,
// but may be found.
bool intersection(const Curve& f, const Curve& g, double near, double reach, double& x);

}  // namespace rangeedge
