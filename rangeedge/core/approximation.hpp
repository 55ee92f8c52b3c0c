// A scan line as a sequence of segments, each with its curve.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <vector>

#include "fit.hpp"
#include "line.hpp"
#include "scanline.hpp"

namespace rangeedge {

struct Approximation {
    std::vector<Segment> segments;
    std::vector<Curve> curves;
};

// Segments while they are joined: a linked list, of which the first one stays. Numbers of all are kept apart, to be
// computed side by side; there is room for a few more.
struct Pieces {
    struct Link {
        Segment segment;
        int previous, next;
    };
    std::vector<Link> links;
    std::vector<double> sigma;     // of the noise where the segment ends, 0 where the next one is not adjacent
    std::vector<double> least;     // significance of a quadratic term, in the unit of the ordinates
    std::vector<double> residual;  // sum of squares
    std::vector<double> cost;      // of taking back the cut on the right

    void resize(std::size_t count, std::size_t room) {
        links.resize(count);
        for (auto* numbers : {&sigma, &least, &residual, &cost}) numbers->resize(room);
    }
};

// Sums over the segments: of samples one unit apart, and of others.
class EvenPieces : public Pieces {
public:
    Projections sums(int i) const;
    void set_sums(int i, const Projections& p);
    template <class T>
    static Projections sums_over(const Line<T>& line, const Segment& s);
    template <class T>
    void fit(const Line<T>& line);
    void price();
    Curve curve(int i) const;

private:
    std::vector<double> n_, base_, mean_, y1_, y2_, squares_;
};

class UnevenPieces : public Pieces {
public:
    const Moments& sums(int i) const { return sums_[static_cast<std::size_t>(i)]; }
    void set_sums(int i, const Moments& moments) { sums_[static_cast<std::size_t>(i)] = moments; }
    template <class T>
    static Moments sums_over(const Line<T>& line, const Segment& s);
    template <class T>
    void fit(const Line<T>& line);
    void price();
    Curve curve(int i) const;

private:
    std::vector<Moments> sums_;
};

// A segment that may be joined with the next one, and what that costs.
struct Join {
    double cost;
    int left;
    // The cheapest, and of equals the leftmost, is on top of a heap.
    bool operator<(const Join& other) const { return cost != other.cost ? cost > other.cost : left > other.left; }
};

// Approximates the lines of one strip after the other; what it needs for that is reused.
template <class T>
class Approximator {
public:
    explicit Approximator(const Parameters& parameters) : parameters_(parameters) {}

    // Splits the lines (section 4.1).
    void split(const Strip<T>& strip);
    // Fits a curve to every segment of the i-th line (4.2, end), takes back cuts that the noise explains, and gives
    // segments that lie across an edge to the surfaces beside it. Holds until the next call.
    const Approximation& approximate(const Strip<T>& strip, std::size_t i);

private:
    void interpolate(const Line<T>& line);
    template <class P>
    void fit(const Line<T>& line, P& pieces);

    Parameters parameters_;
    Splitter<T> splitter_;
    Approximation result_;
    EvenPieces even_;
    UnevenPieces uneven_;
    std::vector<Join> cheap_;
};

// Where f and g meet, the place nearest `near`; false where they do not.
bool intersection(const Curve& f, const Curve& g, double near, double& x);

}  // namespace rangeedge
