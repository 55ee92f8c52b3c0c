#include "distance/distance.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <numeric>
#include <vector>

#include "base/parallel.hpp"
#include "base/simd.hpp"

namespace rangeedge {
namespace {

std::size_t at(int index) { return static_cast<std::size_t>(index); }

std::size_t pixel(int row, int col, int width) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(col);
}

// What one step of salience is: 1/255 in 8-bit maps.
template <class T>
constexpr double UNIT = 1.0;
template <>
constexpr double UNIT<std::uint8_t> = 255.0;

// What is less salient than 2^-30 counts as zero, so that weights have a bounded range.
template <class T>
bool is_salient(T value) {
    return static_cast<double>(value) >= 0x1p-30;
}

void fill_unreached(std::size_t count, float* distance, std::int32_t* labels) {
    std::fill_n(distance, count, std::numeric_limits<float>::infinity());
    if (labels) std::fill_n(labels, count, -1);
}

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
        count_ = 0;
        pieces_.resize(at(length));
    }

    void push(int position, double height, int label) {
        while (count_ > 0 && is_below(position, height, label, pieces_[at(count_ - 1)])) --count_;
        const int start = count_ > 0 ? first_below(position, height, label, pieces_[at(count_ - 1)]) : 0;
        if (start >= length_) return;
        Piece& piece = pieces_[at(count_++)];
        piece.height = height;
        piece.position = position;
        piece.label = label;
        piece.start = start;
    }

    int size() const { return count_; }
    const Piece& operator[](int k) const { return pieces_[at(k)]; }
    int end(int k) const { return k + 1 < count_ ? pieces_[at(k + 1)].start : length_; }

private:
    // Whether the new parabola is the lower one already where the old piece starts.
    static bool is_below(int position, double height, int label, const Piece& old) {
        const double to_new = position - old.start, to_old = old.position - old.start;
        const double rise = height + to_new * to_new - (old.height + to_old * to_old);
        return rise < 0.0 || (rise == 0.0 && label < old.label);
    }

    // The first x in 0 .. length at which the new parabola is the lower one.
    int first_below(int position, double height, int label, const Piece& old) const {
        const double shift = position - old.position, step = 2.0 * shift;
        const double gap = height - old.height + shift * (double(position) + old.position);
        if (gap > step * length_) return length_;
        int x = static_cast<int>(gap / step);
        const double rest = gap - step * x;  // exact, unlike the quotient
        if (rest < 0.0) --x;
        return rest == 0.0 && label < old.label ? x : x + 1;
    }

    int length_ = 0, count_ = 0;
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
        int next[COLUMNS] = {};
        int change[COLUMNS];  // the row at which the next piece begins
        for (int c = 0; c < count; ++c) {
            current[c] = -1;
            change[c] = envelopes[c].size() > 0 ? 0 : height;
        }
        for (int y = 0; y < height; ++y) {
            std::int32_t* row = rows + pixel(y, x0, width);
            for (int c = 0; c < count; ++c) {
                if (change[c] == y) {
                    current[c] = envelopes[c][next[c]].position;
                    change[c] = envelopes[c].end(next[c]++);
                }
                row[c] = current[c];
            }
        }
    }
}

// sqrt(min over q of |p - q|^2 + penalty(q)) and its label, from the nearest source of every column.
template <class Penalty>
void nearest_across_columns(int width, Penalty penalty, int first, int last, const std::int32_t* rows, float* distance,
                            std::int32_t* labels) {
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
        if (envelope.size() == 0) {
            fill_unreached(at(width), distance + row, labels ? labels + row : nullptr);
            continue;
        }
        for (int k = 0; k < envelope.size(); ++k) {
            const Envelope::Piece& piece = envelope[k];
            const int end = envelope.end(k);
            for (int x = piece.start; x < end; ++x) {
                const double dx = x - piece.position;
                squared[at(x)] = dx * dx + piece.height;
            }
            if (labels) std::fill(labels + row + at(piece.start), labels + row + at(end), piece.label);
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
// D^2 = min w(q) |p - q|^2 with w = 1 / s^2. For a tile of pixels and a block of sources w_min * (least distance)^2 is
// a lower bound, and w * (largest distance)^2 of the block's strongest source an upper one: a block whose lower bound
// exceeds the least upper bound has no say in the tile. Tiles are split into four, and the blocks left into theirs,
// down to TILE x TILE pixels. There a source goes that exceeds the one of the least upper bound, the pivot, on the
// whole tile, and those left, about a dozen, are compared pixel by pixel.
// All this is done in float. SLACK allows for its rounding in the bounds; where the two best sources of a pixel come
// too close to tell, the choice is made exactly.

constexpr int TILE = 8, PIXELS = TILE * TILE;
constexpr int LANES = 4;  // slots of a group: a block's four parts
constexpr float SLACK = 1.0f / (1 << 19);
constexpr float HUGE_WEIGHT = 0x1p64f, FAR_AWAY = -0x1p25f;  // of an empty slot: bounds above all others, and finite

// A block of sources: its strongest one, the box around all of them, and the groups of its parts.
struct Block {
    float weight = HUGE_WEIGHT, x = FAR_AWAY, y = FAR_AWAY;
    float left = FAR_AWAY, right = FAR_AWAY, top = FAR_AWAY, bottom = FAR_AWAY;
    int begin = 0, end = 0;

    bool empty() const { return begin == end; }

    void add(const Block& part) {
        if (empty()) {
            *this = part;
            return;
        }
        if (part.weight < weight) {
            weight = part.weight;
            x = part.x;
            y = part.y;
        }
        left = std::min(left, part.left);
        right = std::max(right, part.right);
        top = std::min(top, part.top);
        bottom = std::max(bottom, part.bottom);
    }
};

struct Points {
    std::vector<float> weight, x, y;

    int groups() const { return static_cast<int>(weight.size()) / LANES; }
};

struct Blocks : Points {
    std::vector<float> left, right, top, bottom;
    std::vector<int> begin, end;

    void push(const Block& block) {
        weight.push_back(block.weight);
        x.push_back(block.x);
        y.push_back(block.y);
        left.push_back(block.left);
        right.push_back(block.right);
        top.push_back(block.top);
        bottom.push_back(block.bottom);
        begin.push_back(block.begin);
        end.push_back(block.end);
    }
};

struct Source {
    double level, salience;  // as in the map, and in (0, 1]
    std::int32_t label;
};

struct Sources : Points {
    std::vector<Source> exact;

    void push(float w, float col, float row, const Source& source) {
        weight.push_back(w);
        x.push_back(col);
        y.push_back(row);
        exact.push_back(source);
    }
};

// The sources of a map in blocks of TILE << level pixels, four parts each, so that four neighbours in memory are
// bounded at once.
template <class T>
class Tree {
public:
    Tree(const T* salience, int height, int width, int top)
        : levels(at(top + 1)), salience_(salience), height_(height), width_(width) {
        const int size = TILE << top;
        for (int y = 0; y < height; y += size)
            for (int x = 0; x < width; x += size) levels[at(top)].push(block(top, y, x));
        while (levels[at(top)].weight.size() % LANES) levels[at(top)].push({});
    }

    Sources sources;
    std::vector<Blocks> levels;

private:
    Block block(int level, int y, int x) {
        if (y >= height_ || x >= width_) return {};
        if (level == 0) return smallest_block(y, x);
        const int half = TILE << (level - 1);
        Block whole, parts[LANES];
        for (int k = 0; k < LANES; ++k) {
            parts[k] = block(level - 1, y + k / 2 * half, x + k % 2 * half);
            if (!parts[k].empty()) whole.add(parts[k]);
        }
        if (whole.empty()) return whole;
        Blocks& finer = levels[at(level - 1)];
        whole.begin = finer.groups();
        whole.end = whole.begin + 1;
        for (const Block& part : parts) finer.push(part);
        return whole;
    }

    Block smallest_block(int y0, int x0) {
        const int y1 = std::min(y0 + TILE, height_), x1 = std::min(x0 + TILE, width_);
        const int begin = sources.groups();
        Block whole;
        for (int y = y0; y < y1; ++y) {
            const T* row = salience_ + pixel(y, 0, width_);
            for (int x = x0; x < x1; ++x) {
                if (!is_salient(row[x])) continue;
                const double level = static_cast<double>(row[x]), s = level / UNIT<T>;
                const auto w = static_cast<float>(1.0 / (s * s)), col = static_cast<float>(x),
                           line = static_cast<float>(y);
                sources.push(w, col, line, {level, s, static_cast<std::int32_t>(pixel(y, x, width_))});
                whole.add({w, col, line, col, col, line, line, begin, begin + 1});
            }
        }
        while (sources.weight.size() % LANES) sources.push(HUGE_WEIGHT, FAR_AWAY, FAR_AWAY, {});
        whole.end = sources.groups();
        whole.begin = whole.empty() ? whole.end : begin;
        return whole;
    }

    const T* salience_;
    int height_, width_;
};

struct Tile {
    int y, x;                        // its first pixel
    float left, right, top, bottom;  // its first and last columns and rows inside the image
};

// Groups of slots copied into flat arrays.
struct Candidates {
    std::vector<int> groups;
    std::vector<float> weight, x, y, left, right, top, bottom;

    int count() const { return static_cast<int>(groups.size()) * LANES; }
    int slot(int i) const { return groups[at(i / LANES)] * LANES + i % LANES; }

    void gather(const Points& from) {
        gather(from.weight, weight);
        gather(from.x, x);
        gather(from.y, y);
    }

    void gather(const Blocks& from) {
        gather(static_cast<const Points&>(from));
        gather(from.left, left);
        gather(from.right, right);
        gather(from.top, top);
        gather(from.bottom, bottom);
    }

private:
    void gather(const std::vector<float>& from, std::vector<float>& to) const {
        to.resize(at(count()));
        for (std::size_t i = 0; i < groups.size(); ++i)
            std::memcpy(&to[i * LANES], &from[at(groups[i]) * LANES], LANES * sizeof(float));
    }
};

std::int32_t bits(float value) {
    std::int32_t result;
    std::memcpy(&result, &value, sizeof result);
    return result;
}

float value_of(std::int32_t bits) {
    float result;
    std::memcpy(&result, &bits, sizeof result);
    return result;
}

// The number of a candidate takes the place of the last bits of a float: so a minimum finds its argument as well.
class Tag {
public:
    explicit Tag(int count) {
        while (~mask_ + 1 < count) mask_ *= 2;
    }

    float set(float value, int number) const { return value_of((bits(value) & mask_) | number); }
    int number(float tagged) const { return bits(tagged) & ~mask_; }
    // The largest value that may have become `tagged`.
    float above(float tagged) const { return value_of(bits(tagged) | ~mask_); }

private:
    std::int32_t mask_ = -1;
};

// Lower bounds of the blocks on a tile; returns the least upper bound. Floats that are not negative are ordered as
// their bits, and minima of integers may be taken in any order, so that the loop runs on several lanes; likewise below.
RANGEEDGE_WIDE float bound(const Candidates& from, const Tile& tile, float* lower) {
    const float *weight = from.weight.data(), *x = from.x.data(), *y = from.y.data();
    const float *left = from.left.data(), *right = from.right.data();
    const float *top = from.top.data(), *bottom = from.bottom.data();
    std::int32_t least = std::numeric_limits<std::int32_t>::max();
    const int count = from.count();
    for (int k = 0; k < count; ++k) {
        const float near_x = std::max(std::max(left[k] - tile.right, tile.left - right[k]), 0.0f);
        const float near_y = std::max(std::max(top[k] - tile.bottom, tile.top - bottom[k]), 0.0f);
        const float far_x = std::max(x[k] - tile.left, tile.right - x[k]);
        const float far_y = std::max(y[k] - tile.top, tile.bottom - y[k]);
        lower[k] = weight[k] * (near_x * near_x + near_y * near_y);
        least = std::min(least, bits(weight[k] * (far_x * far_x + far_y * far_y)));
    }
    return value_of(least);
}

// Upper bounds of the sources on a tile; returns the number of about the least one.
RANGEEDGE_WIDE int find_pivot(const Candidates& from, const Tile& tile, float* upper) {
    const Tag tag(from.count());
    const float *weight = from.weight.data(), *x = from.x.data(), *y = from.y.data();
    std::int32_t least = std::numeric_limits<std::int32_t>::max();
    const int count = from.count();
    for (int k = 0; k < count; ++k) {
        const float far_x = std::max(x[k] - tile.left, tile.right - x[k]);
        const float far_y = std::max(y[k] - tile.top, tile.bottom - y[k]);
        upper[k] = weight[k] * (far_x * far_x + far_y * far_y);
        least = std::min(least, bits(tag.set(upper[k], k)));
    }
    return tag.number(value_of(least));
}

// The least of w (t - x)^2 - pivot_w (t - pivot_x)^2 over t in [0, length].
inline float least_excess(float w, float x, float pivot_w, float pivot_x, float length) {
    const auto excess = [=](float t) { return w * ((t - x) * (t - x)) - pivot_w * ((t - pivot_x) * (t - pivot_x)); };
    const float vertex = (w * x - pivot_w * pivot_x) / (w - pivot_w);
    const float inside = std::min(std::max(0.0f, vertex), length);  // 0 where w = pivot_w and there is no vertex
    return std::min(std::min(excess(0.0f), excess(length)), excess(inside));
}

// By how much each source exceeds the pivot everywhere on the tile, less what rounding may amount to: one above 0 has
// no say there. Coordinates from the tile's corner keep the error of the vertex small.
RANGEEDGE_WIDE void exceed(const Candidates& from, int pivot, const Tile& tile, const float* upper, float* excess) {
    const float *weight = from.weight.data(), *x = from.x.data(), *y = from.y.data();
    const float left = tile.left, top = tile.top, width = tile.right - left, height = tile.bottom - top;
    const float pivot_w = weight[pivot], pivot_x = x[pivot] - left, pivot_y = y[pivot] - top;
    const float pivot_upper = upper[pivot];
    const int count = from.count();
    for (int k = 0; k < count; ++k)
        excess[k] = least_excess(weight[k], x[k] - left, pivot_w, pivot_x, width) +
                    least_excess(weight[k], y[k] - top, pivot_w, pivot_y, height) - (upper[k] + pivot_upper) * SLACK;
}

// For every pixel of a tile the least and the second least w d^2, tagged with the number of the source.
RANGEEDGE_WIDE void compare(int count, const float* weight, const float* x, const float* y, const Tile& tile,
                            const Tag& tag, float* least, float* second) {
    float column[PIXELS], row[PIXELS];
    for (int p = 0; p < PIXELS; ++p) {
        column[p] = tile.left + static_cast<float>(p % TILE);
        row[p] = tile.top + static_cast<float>(p / TILE);
    }
    std::fill_n(least, PIXELS, std::numeric_limits<float>::max());
    std::fill_n(second, PIXELS, std::numeric_limits<float>::max());
    for (int i = 0; i < count; ++i) {
        const float w = weight[i], xi = x[i], yi = y[i];
        for (int p = 0; p < PIXELS; ++p) {
            const float dx = column[p] - xi, dy = row[p] - yi;
            const float value = tag.set(w * (dx * dx + dy * dy), i);
            second[p] = std::min(second[p], std::max(least[p], value));
            least[p] = std::min(least[p], value);
        }
    }
}

// The sign of d2a / a^2 - d2b / b^2 without rounding, for integers d2a, d2b below 2^53 and a, b of 24 bits: squares of
// such are exact, and fma gives what rounding takes from a product.
int compare_exactly(double d2a, double a, double d2b, double b) {
    const double left = d2a * (b * b), right = d2b * (a * a);
    if (left != right) return left < right ? -1 : 1;
    const double left_rest = std::fma(d2a, b * b, -left), right_rest = std::fma(d2b, a * a, -right);
    return (left_rest > right_rest) - (left_rest < right_rest);
}

template <class T>
class Search {
public:
    Search(const Tree<T>& tree, int height, int width, float* distance, std::int32_t* labels)
        : tree_(tree), height_(height), width_(width), distance_(distance), labels_(labels),
          blocks_(tree.levels.size()) {
        Candidates& all = blocks_.back();
        all.groups.resize(at(tree.levels.back().groups()));
        std::iota(all.groups.begin(), all.groups.end(), 0);
        all.gather(tree.levels.back());
    }

    // Fills the tile of TILE << level pixels at (y, x), for which blocks_[level] are the candidates.
    void fill(int level, int y, int x) {
        const int size = TILE << level;
        const Tile tile{y,
                        x,
                        static_cast<float>(x),
                        static_cast<float>(std::min(x + size, width_) - 1),
                        static_cast<float>(y),
                        static_cast<float>(std::min(y + size, height_) - 1)};
        Candidates& parts = level > 0 ? blocks_[at(level - 1)] : sources_;
        expand(level, tile, parts.groups);
        if (level == 0) {
            sources_.gather(tree_.sources);
            fill_pixels(tile);
            return;
        }
        parts.gather(tree_.levels[at(level - 1)]);
        const int half = size / 2;
        for (int k = 0; k < LANES; ++k) {
            const int part_y = y + k / 2 * half, part_x = x + k % 2 * half;
            if (part_y < height_ && part_x < width_) fill(level - 1, part_y, part_x);
        }
    }

private:
    // The parts of those blocks that have a say in the tile.
    void expand(int level, const Tile& tile, std::vector<int>& groups) {
        const Candidates& from = blocks_[at(level)];
        const Blocks& blocks = tree_.levels[at(level)];
        lower_.resize(at(from.count()));
        const float limit = bound(from, tile, lower_.data()) * (1.0f + SLACK);
        groups.clear();
        keep_up_to(limit);
        for (const int i : kept_) {
            const std::size_t slot = at(from.slot(i));
            for (int group = blocks.begin[slot]; group < blocks.end[slot]; ++group) groups.push_back(group);
        }
    }

    void fill_pixels(const Tile& tile) {
        keep_contenders(tile);
        const int count = static_cast<int>(contenders_.size());
        const Tag tag(count);
        float least[PIXELS], second[PIXELS];
        compare(count, weight_.data(), x_.data(), y_.data(), tile, tag, least, second);
        double squared[PIXELS], salience[PIXELS];
        std::int32_t label[PIXELS];
        for (int p = 0; p < PIXELS; ++p) {
            int number = tag.number(least[p]);
            const float close = tag.above(least[p]) * (1.0f + SLACK);
            const double row = tile.y + p / TILE, col = tile.x + p % TILE;
            if (second[p] <= close) number = nearest_exactly(row, col, close);
            squared[p] = squared_distance(number, row, col);
            salience[p] = contenders_[at(number)].salience;
            label[p] = contenders_[at(number)].label;
        }
        float distance[PIXELS];
        for (int p = 0; p < PIXELS; ++p) distance[p] = static_cast<float>(std::sqrt(squared[p]) / salience[p]);
        const int cols = std::min(TILE, width_ - tile.x);
        for (int r = 0; r < std::min(TILE, height_ - tile.y); ++r) {
            std::copy_n(distance + r * TILE, cols, distance_ + pixel(tile.y + r, tile.x, width_));
            if (labels_) std::copy_n(label + r * TILE, cols, labels_ + pixel(tile.y + r, tile.x, width_));
        }
    }

    // Moves those sources that the pivot does not beat all over the tile into weight_, x_, y_, contenders_.
    void keep_contenders(const Tile& tile) {
        const int count = sources_.count();
        upper_.resize(at(count));
        lower_.resize(at(count));
        exceed(sources_, find_pivot(sources_, tile, upper_.data()), tile, upper_.data(), lower_.data());
        keep_up_to(0.0f);
        contenders_.resize(kept_.size());
        weight_.resize(kept_.size());
        x_.resize(kept_.size());
        y_.resize(kept_.size());
        for (std::size_t k = 0; k < kept_.size(); ++k) {
            const std::size_t i = at(kept_[k]), slot = at(sources_.slot(kept_[k]));
            weight_[k] = sources_.weight[i];
            x_[k] = sources_.x[i];
            y_[k] = sources_.y[i];
            contenders_[k] = tree_.sources.exact[slot];
        }
    }

    // Into kept_ the numbers of the candidates with lower_ at most `limit`; no branch, as none could be predicted.
    void keep_up_to(float limit) {
        kept_.resize(lower_.size());
        std::size_t count = 0;
        for (std::size_t i = 0; i < lower_.size(); ++i) {
            kept_[count] = static_cast<int>(i);
            count += lower_[i] <= limit;
        }
        kept_.resize(count);
    }

    double squared_distance(int number, double row, double col) const {
        const double dy = row - double(y_[at(number)]), dx = col - double(x_[at(number)]);
        return dy * dy + dx * dx;
    }

    // The nearest of the contenders whose w d^2 is at most about `close`, of the lowest label among equals.
    int nearest_exactly(double row, double col, float close) const {
        const double limit = double(close) * (1.0 + double(SLACK));
        int best = -1;
        double best_squared = 0.0;
        for (int i = 0; i < static_cast<int>(contenders_.size()); ++i) {
            const double squared = squared_distance(i, row, col);
            if (double(weight_[at(i)]) * squared > limit) continue;
            const auto nearer = [&](const Source& source, const Source& than) {
                const int sign = compare_exactly(squared, source.level, best_squared, than.level);
                return sign < 0 || (sign == 0 && source.label < than.label);
            };
            if (best >= 0 && !nearer(contenders_[at(i)], contenders_[at(best)])) continue;
            best = i;
            best_squared = squared;
        }
        return best;
    }

    const Tree<T>& tree_;
    int height_, width_;
    float* distance_;
    std::int32_t* labels_;
    std::vector<Candidates> blocks_;  // by level
    Candidates sources_;
    std::vector<float> lower_, upper_;
    std::vector<float> weight_, x_, y_;  // of the contenders for a tile
    std::vector<Source> contenders_;
    std::vector<int> kept_;
};

constexpr int TOP_TILES = 256;  // at most

template <class T>
void nearest_by_ratio(const T* salience, int height, int width, float* distance, std::int32_t* labels, int threads) {
    const auto tiles = [](int length, int level) { return (length - 1) / (TILE << level) + 1; };
    int top = 0;
    while (static_cast<long long>(tiles(height, top)) * tiles(width, top) > TOP_TILES) ++top;
    const Tree<T> tree(salience, height, width, top);
    if (tree.sources.exact.empty()) {
        fill_unreached(pixel(height, 0, width), distance, labels);
        return;
    }
    const int size = TILE << top, columns = tiles(width, top), count = columns * tiles(height, top);
    std::atomic<int> next{0};  // tiles differ in cost, so each thread takes another when it is done with one
    parallel_for(std::min(threads, count), threads, [&](int, int, int) {
        Search<T> search(tree, height, width, distance, labels);
        for (int tile = next++; tile < count; tile = next++)
            search.fill(top, tile / columns * size, tile % columns * size);
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
        height, width, [=](std::size_t p) { return is_salient(salience[p]); }, penalty, distance, labels, threads);
}

template <class T>
void salience_multiplicative(const T* salience, int height, int width, float* distance, std::int32_t* labels,
                             int threads) {
    nearest_by_ratio(salience, height, width, distance, labels, threads);
}

template void salience_multiplicative(const std::uint8_t*, int, int, float*, std::int32_t*, int);
template void salience_multiplicative(const float*, int, int, float*, std::int32_t*, int);
template void salience_additive(const std::uint8_t*, int, int, double, float*, std::int32_t*, int);
template void salience_additive(const float*, int, int, double, float*, std::int32_t*, int);

}  // namespace rangeedge
