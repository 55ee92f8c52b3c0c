// Distances by lower envelopes: D^2(p) = min over the sources q of |p - q|^2 + f(q), with f = 0 for the plain distance
// and f >= 0 for the additive salience distance.
//
// The two axes are treated one after the other (Felzenszwalb and Huttenlocher). Within a column, the source that is
// nearest to a pixel of that column is found first; whatever column p itself is in, no other source of this column can
// be nearer to p's row. So a row of D^2 is the lower envelope of one parabola per column, (x - column)^2 + height,
// where height is what the column's source contributes along the column. Any two parabolas of one width change places
// once, hence an envelope is built from left to right with a stack, in time proportional to the number of columns.
//
// Where distances are short, looking at every column within reach is quicker than an envelope: window.hpp.
//
// What stands in the output in between, the row of every pixel's source in its own column, takes no memory of its own.
//
// Pixels may be taller than wide: lengths are in pixel widths, and squares along columns count `aspect` times. Where
// the image wraps around, half a row of parabolas is repeated on either side.
//
// P. Felzenszwalb and D. Huttenlocher, "Distance transforms of sampled functions", Theory of Computing 8, 2012.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <vector>

#include "base/array.hpp"
#include "base/parallel.hpp"
#include "distance/distance.hpp"
#include "distance/window.hpp"

namespace rangeedge {
namespace {

// The lower envelope of parabolas scale (x - position)^2 + height over x = 0 .. length - 1, pushed by ascending
// position. Of parabolas that meet at an x, the one of the lowest label is the lower there. As they change places at an
// integer `start`, ties need no care beyond that. With a scale of 1 and heights that are multiples of 2^-20 below 2^32
// all sums are exact.
class Envelope {
public:
    struct Piece {
        double height;
        int position, label, start;
    };

    void reset(int length, double scale) {
        length_ = length;
        scale_ = scale;
        count_ = 0;
    }

    void push(int position, double height, int label) {
        int start = 0;
        while (count_ > 0) {
            const Piece& last = pieces_[count_ - 1];
            if (!is_below(position, height, label, last)) {
                start = first_below(position, height, label, last);
                break;
            }
            --count_;
        }
        if (start >= length_) return;
        if (count_ == pieces_.size()) pieces_.resize(2 * count_ + 16);
        pieces_[count_++] = {height, position, label, start};
    }

    std::ptrdiff_t size() const { return count_; }
    const Piece& operator[](std::ptrdiff_t k) const { return pieces_[k]; }
    int end(std::ptrdiff_t k) const { return k + 1 < count_ ? pieces_[k + 1].start : length_; }

private:
    // Whether the new parabola is the lower one already where the old piece starts.
    bool is_below(int position, double height, int label, const Piece& old) const {
        const double to_new = position - old.start, to_old = old.position - old.start;
        const double rise = height + scale_ * (to_new * to_new) - (old.height + scale_ * (to_old * to_old));
        return rise < 0.0 || (rise == 0.0 && label < old.label);
    }

    // The first x after old.start at which the new parabola is the lower one; `length_` at most.
    int first_below(int position, double height, int label, const Piece& old) const {
        const double shift = position - old.position, step = 2.0 * scale_ * shift;
        const double gap = height - old.height + scale_ * (shift * (double(position) + old.position));
        if (!(gap < step * length_)) return length_;
        int x = static_cast<int>(gap / step);
        const double rest = gap - step * x;  // exact where the sums are, unlike the quotient
        if (rest < 0.0) --x;
        return std::max(rest == 0.0 && label < old.label ? x : x + 1, old.start + 1);
    }

    int length_ = 0;
    double scale_ = 1.0;
    std::ptrdiff_t count_ = 0;
    Array<Piece> pieces_;
};

// Where the sources are and what they add: f in squared pixel widths.
struct Edges {
    const std::uint8_t* edges;

    bool is_source(std::size_t p) const { return edges[p] != 0; }
    double height(std::size_t) const { return 0.0; }
};

template <class T>
class Penalties {
public:
    Penalties(const T* salience, double lambda) : salience_(salience), lambda_(lambda) {
        if constexpr (sizeof(T) == 1)
            for (std::size_t value = 1; value < of_.size(); ++value) of_[value] = penalty(static_cast<T>(value));
    }
    bool is_source(std::size_t p) const { return static_cast<double>(salience_[p]) >= least_salience; }
    double height(std::size_t p) const {
        if constexpr (sizeof(T) == 1)
            return of_[salience_[p]];
        else
            return penalty(salience_[p]);
    }

private:
    double penalty(T value) const {
        constexpr double grain = 1 << 20;
        const double s = static_cast<double>(value) / salience_unit<T>;
        return std::nearbyint(lambda_ * lambda_ * (1.0 / (s * s) - 1.0) * grain) / grain;
    }

    const T* salience_;
    double lambda_;
    std::array<double, sizeof(T) == 1 ? 256 : 0> of_{};
};

// Columns that one thread treats together: whole cache lines of a row, and more of them where an image is so wide that
// there are strips enough, since rows are read faster the longer they are.
constexpr int least_strip = 64, most_strip = 512;
constexpr int rows_between_checkpoints = 64;  // of a strip

int strip_width(int cols, int threads) {
    constexpr int strips = 4;  // of a thread
    return std::clamp(cols / (strips * threads) / least_strip * least_strip, least_strip, most_strip);
}

// rows[p]: the row of the source in p's own column that is nearest to p; -1 for none. Here without penalties: the last
// source above or the next below, of which the upper one where both are equally near.
void nearest_in_columns(const Edges& sources, const Grid& grid, int first, int last, std::int32_t* rows) {
    constexpr std::int32_t none = std::numeric_limits<std::int32_t>::min() / 2;
    std::int32_t nearest[most_strip];
    std::fill_n(nearest, last - first, none);
    Checkpoints checkpoints(rows_between_checkpoints);
    for (int y = 0; y < grid.rows; ++y) {
        checkpoints.pass();
        const std::uint8_t* edges = sources.edges + grid.index(y, first);
        std::int32_t* row = rows + grid.index(y, first);
        for (int c = 0; c < last - first; ++c) row[c] = nearest[c] = edges[c] ? y : nearest[c];
    }
    std::fill_n(nearest, last - first, -none);
    for (int y = grid.rows - 1; y >= 0; --y) {
        checkpoints.pass();
        std::int32_t* row = rows + grid.index(y, first);
        for (int c = 0; c < last - first; ++c) {
            nearest[c] = row[c] == y ? y : nearest[c];
            const std::int32_t source = y - row[c] <= nearest[c] - y ? row[c] : nearest[c];
            row[c] = source >= 0 && source < grid.rows ? source : -1;
        }
    }
}

template <class Sources>
void nearest_in_columns(const Sources& sources, const Grid& grid, int first, int last, std::int32_t* rows) {
    std::vector<Envelope> envelopes(static_cast<std::size_t>(last - first));
    const auto envelope = [&](int c) -> Envelope& { return envelopes[static_cast<std::size_t>(c)]; };
    for (int c = 0; c < last - first; ++c) envelope(c).reset(grid.rows, grid.aspect());
    Checkpoints checkpoints(rows_between_checkpoints);
    for (int y = 0; y < grid.rows; ++y) {
        checkpoints.pass();
        for (int x = first; x < last; ++x) {
            const std::size_t p = grid.index(y, x);
            if (sources.is_source(p)) envelope(x - first).push(y, sources.height(p), y);
        }
    }
    std::int32_t current[most_strip];
    int next[most_strip] = {}, change[most_strip];  // the next piece and the row at which it begins
    for (int c = 0; c < last - first; ++c) {
        current[c] = -1;
        change[c] = envelope(c).size() > 0 ? 0 : grid.rows;
    }
    for (int y = 0; y < grid.rows; ++y) {
        checkpoints.pass();
        std::int32_t* row = rows + grid.index(y, first);
        for (int c = 0; c < last - first; ++c) {
            if (change[c] == y) {
                current[c] = envelope(c)[next[c]].position;
                change[c] = envelope(c).end(next[c]++);
            }
            row[c] = current[c];
        }
    }
}

// A row of distances and labels from `rows`, the row of the nearest source in every column.
template <class Sources>
void nearest_across_columns(const Sources& sources, const Grid& grid, int y, const std::int32_t* rows,
                            Envelope& envelope, Array<double>& squared, float* distance, std::int32_t* labels) {
    const double aspect = grid.aspect();
    const auto push = [&](int x, int position) {
        const int source = rows[x];
        if (source < 0) return;
        const double dy = y - source;
        const std::size_t label = grid.index(source, x);
        envelope.push(position, aspect * (dy * dy) + sources.height(label), static_cast<int>(label));
    };
    const int beyond = grid.wrap ? grid.cols / 2 : 0;
    envelope.reset(grid.cols, 1.0);
    for (int x = grid.cols - beyond; x < grid.cols; ++x) push(x, x - grid.cols);
    for (int x = 0; x < grid.cols; ++x) push(x, x);
    for (int x = 0; x < beyond; ++x) push(x, x + grid.cols);
    if (envelope.size() == 0) {
        std::fill_n(distance, grid.cols, std::numeric_limits<float>::infinity());
        if (labels) std::fill_n(labels, grid.cols, -1);
        return;
    }
    for (std::ptrdiff_t k = 0; k < envelope.size(); ++k) {
        const Envelope::Piece& piece = envelope[k];
        const int end = envelope.end(k);
        for (int x = piece.start; x < end; ++x) {
            const double dx = x - piece.position;
            squared[x] = dx * dx + piece.height;
        }
        if (labels) std::fill(labels + piece.start, labels + end, piece.label);
    }
    for (int x = 0; x < grid.cols; ++x) distance[x] = static_cast<float>(grid.width * std::sqrt(squared[x]));
}

// What a thread needs for a row.
struct RowBuffers {
    Array<std::int32_t> rows;
    Envelope envelope;
    Array<double> squared;
    Window window;
};

template <class Sources>
void nearest_by_sum(const Sources& sources, const Grid& grid, float* distance, std::int32_t* labels, int threads) {
    static_assert(sizeof(float) == sizeof(std::int32_t));
    std::int32_t* const rows = reinterpret_cast<std::int32_t*>(distance);
    const int strip = strip_width(grid.cols, threads), strips = (grid.cols - 1) / strip + 1;
    constexpr int bunch = 8;  // rows
    Team team(std::min(threads, std::max(strips, grid.rows / bunch)));
    parallel_each(strips, team, [&](int s, int) {
        nearest_in_columns(sources, grid, s * strip, std::min(grid.cols, (s + 1) * strip), rows);
    });
    std::vector<RowBuffers> buffers(static_cast<std::size_t>(team.size()));
    for (RowBuffers& b : buffers) {
        b.rows.resize(grid.cols);
        b.squared.resize(grid.cols);
    }
    const bool plain = std::is_same_v<Sources, Edges> && !labels && grid.height == grid.width;
    parallel_each((grid.rows - 1) / bunch + 1, team, [&](int b, int thread) {
        RowBuffers& own = buffers[static_cast<std::size_t>(thread)];
        bool short_ones = plain;  // in the row above: the next one is likely to be alike
        for (int y = b * bunch; y < std::min(grid.rows, (b + 1) * bunch); ++y) {
            const std::size_t row = grid.index(y, 0);
            std::copy_n(rows + row, grid.cols, own.rows.data());
            short_ones = short_ones && own.window.distances(own.rows.data(), y, grid, distance + row);
            if (!short_ones)
                nearest_across_columns(sources, grid, y, own.rows.data(), own.envelope, own.squared, distance + row,
                                       labels ? labels + row : nullptr);
        }
    });
}

}  // namespace

void distance_transform(const std::uint8_t* edges, const Grid& grid, float* distance, std::int32_t* labels,
                        int threads) {
    nearest_by_sum(Edges{edges}, grid, distance, labels, threads);
}

template <class T>
void salience_additive(const T* salience, const Grid& grid, double lambda, float* distance, std::int32_t* labels,
                       int threads) {
    nearest_by_sum(Penalties<T>(salience, lambda / grid.width), grid, distance, labels, threads);
}
template void salience_additive(const std::uint8_t*, const Grid&, double, float*, std::int32_t*, int);
template void salience_additive(const float*, const Grid&, double, float*, std::int32_t*, int);

}  // namespace rangeedge
