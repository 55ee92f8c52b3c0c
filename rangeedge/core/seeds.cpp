// SPDX-License-Identifier: Apache-2.0
#include "seeds.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <vector>

namespace rangeedge {
namespace {

using Index = std::int32_t;

constexpr int digit_bits = 11;

std::uint32_t bits_of(float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    return bits;
}

// Indices by falling value, equal ones by rising index. The bits of floats >= 0 are ordered as their values are.
void sort_falling(const float* value, std::vector<Index>& order) {
    std::vector<Index> other(order.size());
    for (int shift = 0; shift < 32; shift += digit_bits) {
        constexpr std::uint32_t digits = 1u << digit_bits;
        std::array<std::size_t, digits + 1> start{};
        const auto digit = [&](Index p) { return digits - 1 - ((bits_of(value[p]) >> shift) & (digits - 1)); };
        for (const Index p : order) ++start[digit(p) + 1];
        for (std::size_t d = 1; d <= digits; ++d) start[d] += start[d - 1];
        for (const Index p : order) other[start[digit(p)]++] = p;
        order.swap(other);
    }
}

// The eight neighbours of a pixel that lie in the image.
template <class F>
void for_neighbours(Index p, int height, int width, F&& visit) {
    const int row = p / width, col = p % width;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, height - 1); ++r)
        for (int c = std::max(col - 1, 0); c <= std::min(col + 1, width - 1); ++c)
            if (r != row || c != col) visit(r * width + c);
}

// Sinking water: components of what lies above the level, each known by its highest pixel.
class Islands {
public:
    Islands(const float* distance, int height, int width, float separation)
        : distance_(distance), height_(height), width_(width), separation_(separation),
          parent_(static_cast<std::size_t>(height) * static_cast<std::size_t>(width), -1) {}

    // Peaks by themselves of the pixels in `order`, which fall in distance.
    std::vector<Index> peaks(const std::vector<Index>& order) {
        std::vector<Index> found;
        for (const Index p : order) {
            at(p) = p;
            for_neighbours(p, height_, width_, [&](Index q) {
                if (at(q) >= 0) join(p, q, distance_[p], found);
            });
        }
        for (const Index p : order)
            if (at(p) == p) found.push_back(p);
        return found;
    }

private:
    Index& at(Index p) { return parent_[static_cast<std::size_t>(p)]; }

    Index root(Index p) {
        while (at(p) != p) p = at(p) = at(at(p));
        return p;
    }

    void join(Index p, Index q, float level, std::vector<Index>& found) {
        Index low = root(p), high = root(q);
        if (low == high) return;
        if (distance_[low] > distance_[high] || (distance_[low] == distance_[high] && low < high)) std::swap(low, high);
        if (level < separation_ * distance_[low]) found.push_back(low);
        at(low) = high;
    }

    const float* distance_;
    int height_, width_;
    float separation_;
    std::vector<Index> parent_;
};

}  // namespace

int extract_seeds(const float* distance, const std::uint8_t* mask, int height, int width, float min_distance,
                  float separation, std::int32_t* markers) {
    const Index size = static_cast<Index>(height * width);
    const float lowest = separation * min_distance;
    std::vector<Index> order;
    for (Index p = 0; p < size; ++p) {
        markers[p] = 0;
        if (distance[p] > 0 && distance[p] >= lowest && (!mask || mask[p])) order.push_back(p);
    }
    sort_falling(distance, order);
    const std::vector<Index> peaks = Islands(distance, height, width, separation).peaks(order);

    // Mark every seed by its peak, then number them.
    std::vector<Index> stack;
    for (const Index peak : peaks) {
        if (distance[peak] < min_distance) continue;
        markers[peak] = peak + 1;
        stack.assign(1, peak);
        while (!stack.empty()) {
            const Index p = stack.back();
            stack.pop_back();
            for_neighbours(p, height, width, [&](Index q) {
                if (markers[q] || distance[q] <= 0 || distance[q] < separation * distance[peak] || (mask && !mask[q])) return;
                markers[q] = peak + 1;
                stack.push_back(q);
            });
        }
    }
    std::vector<Index> number(static_cast<std::size_t>(size), 0);
    Index count = 0;
    for (Index p = 0; p < size; ++p) {
        if (!markers[p]) continue;
        Index& n = number[static_cast<std::size_t>(markers[p] - 1)];
        if (!n) n = ++count;
        markers[p] = n;
    }
    return count;
}

}  // namespace rangeedge
