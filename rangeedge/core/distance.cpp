#include "distance.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "parallel.hpp"

// Loops over eight lanes are compiled twice and the wider form taken where the processor has it; without contraction
// both round alike.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__SANITIZE_ADDRESS__)
#define RANGEEDGE_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define RANGEEDGE_WIDE
#endif

namespace rangeedge {
namespace {

constexpr double INFINITE = std::numeric_limits<double>::infinity();

std::size_t at(int index) { return static_cast<std::size_t>(index); }

std::size_t pixel(int row, int col, int width) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(col);
}

// What one step of salience is: 1/255 in 8-bit maps.
template <class T>
constexpr double UNIT = 1.0;
template <>
constexpr double UNIT<std::uint8_t> = 255.0;

// ---- |p - q|^2 + f(q): separable, by lower envelopes (Felzenszwalb and Huttenlocher) ----

// The lower envelope of parabolas height + (x - position)^2 over x = 0 .. length - 1, pushed by ascending position.
// Of parabolas that meet at an x, the one of the lowest label is the lower there. Any two of them change places once,
// at the integer `start`, so ties need no care beyond that. Heights are multiples of 2^-20 below 2^32: sums are exact.
class Envelope {
public:
    struct Piece {
        double height;
        int position, label, start;
    };

    void reset(int length) {
        length_ = length;
        pieces_.clear();
    }

    void push(int position, double height, int label) {
        int start = 0;
        while (!pieces_.empty()) {
            start = first_below(pieces_.back(), position, height, label);
            if (start > pieces_.back().start) break;
            pieces_.pop_back();
        }
        if (pieces_.empty()) start = 0;
        if (start < length_) pieces_.push_back({height, position, label, start});
    }

    const std::vector<Piece>& pieces() const { return pieces_; }

private:
    // The first x in 0 .. length at which the new parabola is the lower one.
    int first_below(const Piece& old, int position, double height, int label) const {
        const double step = 2.0 * (position - old.position);
        const double gap = height - old.height + (position - old.position) * (double(position) + old.position);
        if (gap < 0.0) return 0;
        if (gap > step * length_) return length_;
        int x = static_cast<int>(gap / step);
        const double rest = gap - step * x;  // exact, unlike the quotient
        if (rest < 0.0) --x;
        return rest == 0.0 && label < old.label ? x : x + 1;
    }

    int length_ = 0;
    std::vector<Piece> pieces_;
};

constexpr int COLUMNS = 16;  // handled together, for whole cache lines

// rows[p]: the row of the source in p's own column with the least (distance along the column)^2 + penalty; -1 for none.
template <class IsSource, class Penalty>
void nearest_in_columns(int height, int width, IsSource is_source, Penalty penalty, int first, int last,
                        std::int32_t* rows) {
    Envelope envelopes[COLUMNS];
    for (int x0 = first; x0 < last; x0 += COLUMNS) {
        const int count = std::min(COLUMNS, last - x0);
        for (int c = 0; c < count; ++c) envelopes[c].reset(height);
        for (int y = 0; y < height; ++y)
            for (int c = 0; c < count; ++c) {
                const std::size_t p = pixel(y, x0 + c, width);
                if (is_source(p)) envelopes[c].push(y, penalty(p), y);
            }
        std::int32_t current[COLUMNS];
        std::size_t next[COLUMNS] = {};
        int change[COLUMNS];  // the row at which the next piece begins
        for (int c = 0; c < count; ++c) {
            current[c] = -1;
            change[c] = envelopes[c].pieces().empty() ? height : 0;
        }
        for (int y = 0; y < height; ++y) {
            for (int c = 0; c < count; ++c) {
                if (change[c] != y) continue;
                const auto& pieces = envelopes[c].pieces();
                current[c] = pieces[next[c]++].position;
                change[c] = next[c] < pieces.size() ? pieces[next[c]].start : height;
            }
            std::copy_n(current, count, rows + pixel(y, x0, width));
        }
    }
}

// sqrt(min over q of |p - q|^2 + penalty(q)) and its label, from the nearest source of every column.
template <class Penalty>
void nearest_across_columns(int width, Penalty penalty, int first, int last, const std::int32_t* rows,
                            float* distance, std::int32_t* labels) {
    Envelope envelope;
    std::vector<double> squared(at(width));
    for (int y = first; y < last; ++y) {
        const std::size_t row = pixel(y, 0, width);
        envelope.reset(width);
        for (int x = 0; x < width; ++x) {
            const int source = rows[row + at(x)];
            if (source < 0) continue;
            const double dy = y - source;
            const std::size_t label = pixel(source, x, width);
            envelope.push(x, dy * dy + penalty(label), static_cast<int>(label));
        }
        const auto& pieces = envelope.pieces();
        if (pieces.empty()) {
            std::fill_n(distance + row, width, std::numeric_limits<float>::infinity());
            if (labels) std::fill_n(labels + row, width, -1);
            continue;
        }
        for (std::size_t k = 0; k < pieces.size(); ++k) {
            const int end = k + 1 < pieces.size() ? pieces[k + 1].start : width;
            for (int x = pieces[k].start; x < end; ++x) {
                const double dx = x - pieces[k].position;
                squared[at(x)] = dx * dx + pieces[k].height;
            }
            if (labels) std::fill(labels + row + at(pieces[k].start), labels + row + at(end), pieces[k].label);
        }
        for (int x = 0; x < width; ++x) distance[row + at(x)] = static_cast<float>(std::sqrt(squared[at(x)]));
    }
}

template <class IsSource, class Penalty>
void nearest_by_sum(int height, int width, IsSource is_source, Penalty penalty, float* distance, std::int32_t* labels,
                    int threads) {
    std::vector<std::int32_t> rows(pixel(height, 0, width));
    const int groups = (width + COLUMNS - 1) / COLUMNS;
    parallel_for(groups, threads, [&](int begin, int end, int) {
        nearest_in_columns(height, width, is_source, penalty, begin * COLUMNS, std::min(width, end * COLUMNS),
                           rows.data());
    });
    parallel_for(height, threads, [&](int begin, int end, int) {
        nearest_across_columns(width, penalty, begin, end, rows.data(), distance, labels);
    });
}

// ---- |p - q| / s(q): branch and bound over a quadtree of tiles and one of sources ----
//
// D^2 = min w(q) |p - q|^2 with w = 1 / s^2. For a tile of pixels and a block of sources w_min * (least distance)^2 is a
// lower bound, and w * (largest distance)^2 of the block's strongest source an upper one; a block whose lower bound
// exceeds the least upper bound has no say in the tile. Tiles are split into four, and the blocks left into theirs,
// down to TILE x TILE pixels, where the sources left are compared one by one.
// Bounds and comparisons carry rounding errors of a few 2^-24 (float); SLACK allows for more. Where two sources come
// as close as that, the decision is exact.

constexpr int TILE = 8;
constexpr int LANES = 8;
constexpr double SLACK = 1.0 + 1.0 / (1 << 19);

template <class Real>
struct Sources {
    std::vector<Real> weight, x, y;
    std::vector<double> level, salience;  // as in the map, and in (0, 1]
    std::vector<std::int32_t> label;
};

// The non-empty blocks of one size: the box around their sources, the strongest of these, and where the parts begin.
template <class Real>
struct Blocks {
    std::vector<Real> weight, x, y, left, right, top, bottom;
    std::vector<int> first;  // of the next finer blocks, or of the sources; one entry more than blocks
    int size() const { return static_cast<int>(weight.size()); }
};

template <class Real>
struct Tree {
    int height, width;
    Sources<Real> sources;
    std::vector<Blocks<Real>> levels;  // from blocks of TILE up, each twice as wide

    int top() const { return static_cast<int>(levels.size()) - 1; }
};

template <class T, class Real>
class TreeBuilder {
public:
    TreeBuilder(const T* salience, Tree<Real>& tree) : salience_(salience), tree_(tree) {}

    void build() {
        const int size = TILE << tree_.top();
        for (int y = 0; y < tree_.height; y += size)
            for (int x = 0; x < tree_.width; x += size) add_block(tree_.top(), y, x);
        for (int level = 0; level <= tree_.top(); ++level)
            tree_.levels[at(level)].first.push_back(parts(level));
    }

private:
    int parts(int level) const {
        return level > 0 ? tree_.levels[at(level - 1)].size() : static_cast<int>(tree_.sources.label.size());
    }

    void add_block(int level, int y, int x) {
        if (y >= tree_.height || x >= tree_.width) return;
        const int begin = parts(level);
        if (level == 0) {
            add_sources(y, x);
            close_block(level, begin, tree_.sources.x, tree_.sources.x, tree_.sources.y, tree_.sources.y,
                        tree_.sources);
        } else {
            const int half = TILE << (level - 1);
            for (int part = 0; part < 4; ++part) add_block(level - 1, y + part / 2 * half, x + part % 2 * half);
            const Blocks<Real>& finer = tree_.levels[at(level - 1)];
            close_block(level, begin, finer.left, finer.right, finer.top, finer.bottom, finer);
        }
    }

    void add_sources(int y0, int x0) {
        Sources<Real>& sources = tree_.sources;
        const int y1 = std::min(y0 + TILE, tree_.height), x1 = std::min(x0 + TILE, tree_.width);
        for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x) {
                const std::size_t p = pixel(y, x, tree_.width);
                if (!(salience_[p] > T(0))) continue;
                const double level = static_cast<double>(salience_[p]), s = level / UNIT<T>;
                sources.weight.push_back(static_cast<Real>(1.0 / (s * s)));
                sources.x.push_back(static_cast<Real>(x));
                sources.y.push_back(static_cast<Real>(y));
                sources.level.push_back(level);
                sources.salience.push_back(s);
                sources.label.push_back(static_cast<std::int32_t>(p));
            }
    }

    // A block around the parts from `begin` on, if there are any.
    template <class Parts>
    void close_block(int level, int begin, const std::vector<Real>& left, const std::vector<Real>& right,
                     const std::vector<Real>& top, const std::vector<Real>& bottom, const Parts& part) {
        const int end = parts(level);
        if (begin == end) return;
        Blocks<Real>& blocks = tree_.levels[at(level)];
        const auto strongest =
            at(static_cast<int>(std::min_element(part.weight.begin() + begin, part.weight.begin() + end) -
                                part.weight.begin()));
        blocks.weight.push_back(part.weight[strongest]);
        blocks.x.push_back(part.x[strongest]);
        blocks.y.push_back(part.y[strongest]);
        blocks.left.push_back(*std::min_element(left.begin() + begin, left.begin() + end));
        blocks.right.push_back(*std::max_element(right.begin() + begin, right.begin() + end));
        blocks.top.push_back(*std::min_element(top.begin() + begin, top.begin() + end));
        blocks.bottom.push_back(*std::max_element(bottom.begin() + begin, bottom.begin() + end));
        blocks.first.push_back(begin);
    }

    const T* salience_;
    Tree<Real>& tree_;
};

// Candidates for a tile in flat arrays, padded to whole lanes with copies of the last.
template <class Real>
struct Candidates {
    std::vector<Real> weight, x, y, left, right, top, bottom;
    std::vector<int> id;
    int count = 0;

    // The parts of the blocks kept.
    void expand(const std::vector<int>& kept, const std::vector<int>& first) {
        id.clear();
        for (const int k : kept)
            for (int part = first[at(k)]; part < first[at(k + 1)]; ++part) id.push_back(part);
        pad();
    }

    void pad() {
        count = static_cast<int>(id.size());
        while (id.size() % LANES) id.push_back(id.back());
    }

    void copy(const Sources<Real>& sources) {
        copy(sources.weight, weight);
        copy(sources.x, x);
        copy(sources.y, y);
    }

    void copy(const Blocks<Real>& blocks) {
        copy(blocks.weight, weight);
        copy(blocks.x, x);
        copy(blocks.y, y);
        copy(blocks.left, left);
        copy(blocks.right, right);
        copy(blocks.top, top);
        copy(blocks.bottom, bottom);
    }

private:
    void copy(const std::vector<Real>& from, std::vector<Real>& to) {
        to.resize(id.size());
        for (std::size_t i = 0; i < id.size(); ++i) to[i] = from[at(id[i])];
    }
};

template <class Real>
struct Tile {
    int y, x;                       // of its first pixel
    Real left, right, top, bottom;  // its first and last columns and rows inside the image
};

// Lower bounds of the candidates on a tile; returns the least upper bound, slack included.
template <class Real>
RANGEEDGE_WIDE Real bound_blocks(const Candidates<Real>& from, const Tile<Real>& tile, Real* lower) {
    Real least[LANES];
    std::fill_n(least, LANES, std::numeric_limits<Real>::max());
    const Real *weight = from.weight.data(), *x = from.x.data(), *y = from.y.data();
    const Real *left = from.left.data(), *right = from.right.data();
    const Real *top = from.top.data(), *bottom = from.bottom.data();
    const int count = static_cast<int>(from.id.size());
    for (int i = 0; i < count; i += LANES)
        for (int k = i; k < i + LANES; ++k) {
            const Real near_x = std::max(std::max(left[k] - tile.right, tile.left - right[k]), Real(0));
            const Real near_y = std::max(std::max(top[k] - tile.bottom, tile.top - bottom[k]), Real(0));
            const Real far_x = std::max(x[k] - tile.left, tile.right - x[k]);
            const Real far_y = std::max(y[k] - tile.top, tile.bottom - y[k]);
            lower[k] = weight[k] * (near_x * near_x + near_y * near_y);
            const Real upper = weight[k] * (far_x * far_x + far_y * far_y);
            least[k - i] = std::min(least[k - i], upper);
        }
    return *std::min_element(least, least + LANES) * static_cast<Real>(SLACK);
}

template <class Real>
RANGEEDGE_WIDE Real bound_sources(const Candidates<Real>& from, const Tile<Real>& tile, Real* lower) {
    Real least[LANES];
    std::fill_n(least, LANES, std::numeric_limits<Real>::max());
    const Real *weight = from.weight.data(), *x = from.x.data(), *y = from.y.data();
    const int count = static_cast<int>(from.id.size());
    for (int i = 0; i < count; i += LANES)
        for (int k = i; k < i + LANES; ++k) {
            const Real before_x = tile.left - x[k], after_x = x[k] - tile.right;
            const Real before_y = tile.top - y[k], after_y = y[k] - tile.bottom;
            const Real near_x = std::max(std::max(before_x, after_x), Real(0));
            const Real near_y = std::max(std::max(before_y, after_y), Real(0));
            const Real far_x = std::min(before_x, after_x), far_y = std::min(before_y, after_y);  // negative
            lower[k] = weight[k] * (near_x * near_x + near_y * near_y);
            const Real upper = weight[k] * (far_x * far_x + far_y * far_y);
            least[k - i] = std::min(least[k - i], upper);
        }
    return *std::min_element(least, least + LANES) * static_cast<Real>(SLACK);
}

// For every pixel of a tile the least and second least w d^2 and the number of the candidate with the least.
template <class Real>
RANGEEDGE_WIDE void compare(int count, const Real* weight, const Real* x, const Real* y, int tile_y, int tile_x,
                            Real (&least)[TILE][TILE], Real (&second)[TILE][TILE], int (&winner)[TILE][TILE]) {
    Real column[TILE];
    for (int c = 0; c < TILE; ++c) column[c] = static_cast<Real>(tile_x + c);
    for (int r = 0; r < TILE; ++r) {
        const Real row = static_cast<Real>(tile_y + r);
        Real best[TILE], next[TILE];
        int who[TILE] = {};
        std::fill_n(best, TILE, std::numeric_limits<Real>::max());
        std::fill_n(next, TILE, std::numeric_limits<Real>::max());
        for (int i = 0; i < count; ++i) {
            const Real dy2 = (row - y[i]) * (row - y[i]), w = weight[i], xi = x[i];
            for (int c = 0; c < TILE; ++c) {
                const Real value = w * ((column[c] - xi) * (column[c] - xi) + dy2);
                next[c] = std::min(next[c], std::max(best[c], value));
                who[c] = value < best[c] ? i : who[c];
                best[c] = std::min(best[c], value);
            }
        }
        std::copy_n(best, TILE, least[r]);
        std::copy_n(next, TILE, second[r]);
        std::copy_n(who, TILE, winner[r]);
    }
}

// Whether d2a / a^2 < d2b / b^2, exactly, for integers d2 below 2^53 and a, b of 24 bits.
// 0: less, 1: equal... 
inline int compare_exactly(double d2a, double a, double d2b, double b) {
    const double left = d2a * (b * b), right = d2b * (a * a);
    if (left != right) return left < right ? -1 : 1;
    const double rest_left = std::fma(d2a, b * b, -left), rest_right = std::fma(d2b, a * a, -right);
    return rest_left < rest_right ? -1 : rest_left > rest_right;
}

template <class Real>
class Search {
public:
    Search(const Tree<Real>& tree, float* distance, std::int32_t* labels)
        : tree_(tree), distance_(distance), labels_(labels), kept_(tree.levels.size() + 1),
          candidates_(tree.levels.size() + 1) {
        std::vector<int> all(at(tree.levels.back().size()));
        for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
        Candidates<Real>& roots = candidates_.back();
        roots.id = all;
        roots.pad();
        roots.copy(tree.levels.back());
    }

    // Fills the tile of TILE << level pixels at (y, x) from the candidates of that level.
    void fill(int level, int y, int x) {
        const int size = TILE << level;
        const Tile<Real> tile{y, x, static_cast<Real>(x), static_cast<Real>(std::min(x + size, tree_.width) - 1),
                              static_cast<Real>(y), static_cast<Real>(std::min(y + size, tree_.height) - 1)};
        const Candidates<Real>& from = candidates_[at(level + 1)];
        std::vector<int>& kept = kept_[at(level + 1)];
        lower_.resize(from.id.size());
        keep(from, bound_blocks(from, tile, lower_.data()), kept);
        Candidates<Real>& parts = candidates_[at(level)];
        parts.expand(kept, tree_.levels[at(level)].first);
        if (level == 0) {
            parts.copy(tree_.sources);
            fill_pixels(tile);
            return;
        }
        parts.copy(tree_.levels[at(level - 1)]);
        const int half = size / 2;
        for (int part = 0; part < 4; ++part) {
            const int part_y = y + part / 2 * half, part_x = x + part % 2 * half;
            if (part_y < tree_.height && part_x < tree_.width) fill(level - 1, part_y, part_x);
        }
    }

private:
    void keep(const Candidates<Real>& from, Real limit, std::vector<int>& kept) {
        kept.resize(at(from.count));
        std::size_t count = 0;
        for (int i = 0; i < from.count; ++i) {
            kept[count] = from.id[at(i)];
            count += lower_[at(i)] <= limit;
        }
        kept.resize(count);
    }

    void fill_pixels(const Tile<Real>& tile) {
        Candidates<Real>& from = candidates_[0];
        lower_.resize(from.id.size());
        const Real limit = bound_sources(from, tile, lower_.data());
        int count = 0;
        for (int i = 0; i < from.count; ++i) {
            from.weight[at(count)] = from.weight[at(i)];
            from.x[at(count)] = from.x[at(i)];
            from.y[at(count)] = from.y[at(i)];
            from.id[at(count)] = from.id[at(i)];
            count += lower_[at(i)] <= limit;
        }
        Real least[TILE][TILE], second[TILE][TILE];
        int winner[TILE][TILE];
        compare(count, from.weight.data(), from.x.data(), from.y.data(), tile.y, tile.x, least, second, winner);
        const int rows = std::min(TILE, tree_.height - tile.y), cols = std::min(TILE, tree_.width - tile.x);
        for (int r = 0; r < rows; ++r)
            for (int c = 0; c < cols; ++c) {
                const Real close = least[r][c] * static_cast<Real>(SLACK);
                int source = from.id[at(winner[r][c])];
                if (second[r][c] <= close) source = nearest_exactly(count, tile.y + r, tile.x + c, close);
                const double dx = double(tree_.sources.x[at(source)]) - (tile.x + c),
                             dy = double(tree_.sources.y[at(source)]) - (tile.y + r);
                const std::size_t p = pixel(tile.y + r, tile.x + c, tree_.width);
                distance_[p] = static_cast<float>(std::sqrt(dx * dx + dy * dy) / tree_.sources.salience[at(source)]);
                if (labels_) labels_[p] = tree_.sources.label[at(source)];
            }
    }

    // Of the candidates whose w d^2 is at most `close`, the truly nearest, of the lowest label.
    int nearest_exactly(int count, int y, int x, Real close) const {
        const Candidates<Real>& from = candidates_[0];
        const Sources<Real>& sources = tree_.sources;
        int best = -1;
        double best_d2 = 0.0;
        for (int i = 0; i < count; ++i) {
            const Real dx = static_cast<Real>(x) - from.x[at(i)], dy = static_cast<Real>(y) - from.y[at(i)];
            if (from.weight[at(i)] * (dx * dx + dy * dy) > close) continue;
            const int source = from.id[at(i)];
            const double d2 = double(dx) * double(dx) + double(dy) * double(dy);
            const int order = best < 0 ? -1
                                       : compare_exactly(d2, sources.level[at(source)], best_d2,
                                                         sources.level[at(best)]);
            if (order > 0 || (order == 0 && sources.label[at(source)] > sources.label[at(best)])) continue;
            best = source;
            best_d2 = d2;
        }
        return best;
    }

    const Tree<Real>& tree_;
    float* distance_;
    std::int32_t* labels_;
    std::vector<Real> lower_;
    std::vector<std::vector<int>> kept_;
    std::vector<Candidates<Real>> candidates_;  // [0]: sources, [level + 1]: blocks of a level
};

constexpr int TOP_TILES = 256;

template <class Real, class T>
void nearest_by_ratio(const T* salience, int height, int width, float* distance, std::int32_t* labels, int threads) {
    const auto tiles = [](int length, int level) { return (length + (TILE << level) - 1) / (TILE << level); };
    int top = 0;
    while (static_cast<long long>(tiles(height, top)) * tiles(width, top) > TOP_TILES) ++top;
    Tree<Real> tree{height, width, {}, std::vector<Blocks<Real>>(at(top + 1))};
    TreeBuilder<T, Real>(salience, tree).build();
    if (tree.sources.label.empty()) {
        std::fill_n(distance, pixel(height, 0, width), std::numeric_limits<float>::infinity());
        if (labels) std::fill_n(labels, pixel(height, 0, width), -1);
        return;
    }
    const int size = TILE << top, columns = tiles(width, top), count = columns * tiles(height, top);
    std::atomic<int> next{0};  // tiles differ in cost: each thread takes the next one
    parallel_for(std::min(threads, count), threads, [&](int, int, int) {
        Search<Real> search(tree, distance, labels);
        for (int tile = next++; tile < count; tile = next++) search.fill(top, tile / columns * size, tile % columns * size);
    });
}

}  // namespace

void distance_transform(const std::uint8_t* edges, int height, int width, float* distance, std::int32_t* labels,
                        int threads) {
    nearest_by_sum(
        height, width, [=](std::size_t p) { return edges[p] != 0; }, [](std::size_t) { return 0.0; }, distance, labels,
        threads);
}

template <class T>
void salience_additive(const T* salience, int height, int width, double lambda, float* distance, std::int32_t* labels,
                       int threads) {
    constexpr double GRAIN = 1 << 20;
    const auto penalty = [=](std::size_t p) {
        const double s = static_cast<double>(salience[p]) / UNIT<T>;
        return std::nearbyint(lambda * lambda * (1.0 / (s * s) - 1.0) * GRAIN) / GRAIN;
    };
    nearest_by_sum(
        height, width, [=](std::size_t p) { return salience[p] > T(0); }, penalty, distance, labels, threads);
}

template <class T>
void salience_multiplicative(const T* salience, int height, int width, float* distance, std::int32_t* labels,
                             int threads) {
    nearest_by_ratio<float>(salience, height, width, distance, labels, threads);
}

template void salience_multiplicative(const std::uint8_t*, int, int, float*, std::int32_t*, int);
template void salience_multiplicative(const float*, int, int, float*, std::int32_t*, int);
template void salience_additive(const std::uint8_t*, int, int, double, float*, std::int32_t*, int);
template void salience_additive(const float*, int, int, double, float*, std::int32_t*, int);

}  // namespace rangeedge
