// SPDX-License-Identifier: Apache-2.0
#include "seeds.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

namespace rangeedge {
namespace {

using Index = std::int32_t;

// A pixel by falling distance, equal ones by rising index: the bits of floats >= 0 are ordered as their values are.
struct Place {
    std::uint32_t fall;
    Index pixel;
};

Place place_of(float distance, Index pixel) {
    std::uint32_t bits;
    std::memcpy(&bits, &distance, sizeof bits);
    return {~bits, pixel};
}

// By rising `fall`; equal ones stay in order.
void sort(std::vector<Place>& places) {
    constexpr int bits = 13, most_passes = 3;
    constexpr std::uint32_t digits = 1u << bits;
    std::uint32_t least = ~0u, most = 0;
    for (const Place& place : places) least = std::min(least, place.fall), most = std::max(most, place.fall);
    int passes = 0;
    while (passes < most_passes && !places.empty() && (most - least) >> (passes * bits)) ++passes;
    const auto digit = [=](const Place& place, int pass) {
        return ((place.fall - least) >> (pass * bits)) & (digits - 1);
    };
    std::vector<std::array<std::uint32_t, digits>> start(most_passes);
    for (const Place& place : places)
        for (int pass = 0; pass < passes; ++pass) ++start[static_cast<std::size_t>(pass)][digit(place, pass)];
    std::vector<Place> other(places.size());
    for (int pass = 0; pass < passes; ++pass) {
        auto& next = start[static_cast<std::size_t>(pass)];
        std::uint32_t sum = 0;
        for (std::uint32_t& n : next) sum += std::exchange(n, sum);
        for (const Place& place : places) other[next[digit(place, pass)]++] = place;
        places.swap(other);
    }
}

// Of which of the eight neighbours one of each connected group is the first, by which of them there are.
constexpr std::array<std::uint8_t, 256> first_of_groups() {
    constexpr int x[8] = {-1, 0, 1, -1, 1, -1, 0, 1}, y[8] = {-1, -1, -1, 0, 0, 1, 1, 1};
    std::array<std::uint8_t, 256> first{};
    for (unsigned there = 0; there < 256; ++there)
        for (unsigned rest = there; rest;) {
            unsigned group = rest & (0u - rest);
            first[there] = static_cast<std::uint8_t>(first[there] | group);
            for (unsigned before = 0; before != group;) {
                before = group;
                for (int i = 0; i < 8; ++i)
                    for (int j = 0; j < 8; ++j)
                        if ((before >> i & 1) && (rest >> j & 1) && (x[i] - x[j]) * (x[i] - x[j]) <= 1 &&
                            (y[i] - y[j]) * (y[i] - y[j]) <= 1)
                            group |= 1u << j;
            }
            rest &= ~group;
        }
    return first;
}

// Sinking water: islands are the components of what lies above the level, each known by its peak.
class Islands {
public:
    Islands(const std::vector<float>& distance, float separation) : distance_(distance), separation_(separation) {}

    // Peaks by themselves of the pixels in `order`, which fall in distance. Pixels have an index in an image with a
    // margin; `neighbours` are the steps to the eight around, in raster order.
    std::vector<Index> peaks(const std::vector<Place>& order, const std::array<Index, 8>& neighbours);

private:
    struct Island {
        Index peak;
        std::size_t home;  // the island that has taken this one in, or itself
    };

    std::size_t home(std::size_t i) {
        while (island_[i].home != i) i = island_[i].home = island_[island_[i].home].home;
        return i;
    }
    float top(std::size_t i) const { return distance_[static_cast<std::size_t>(island_[i].peak)]; }
    std::size_t join(std::size_t low, std::size_t high, float level);

    const std::vector<float>& distance_;
    float separation_;
    std::vector<Island> island_;
    std::vector<Index> found_;
};

// The higher island, or that of lower index, takes in the other, and keeps its number.
std::size_t Islands::join(std::size_t low, std::size_t high, float level) {
    if (low == high) return high;
    const Index a = island_[low].peak, b = island_[high].peak;
    if (top(low) > top(high) || (top(low) == top(high) && a < b)) std::swap(low, high);
    if (level < separation_ * top(low)) found_.push_back(island_[low].peak);
    island_[low].home = high;
    return high;
}

std::vector<Index> Islands::peaks(const std::vector<Place>& order, const std::array<Index, 8>& neighbours) {
    static constexpr std::array<std::uint8_t, 256> first = first_of_groups();
    const std::array<Index, 8> steps = neighbours;
    std::vector<std::uint8_t> above(distance_.size(), 0);  // which neighbours are
    std::vector<std::uint32_t> number(distance_.size());   // of a pixel's island
    for (const Place& place : order) {
        const auto p = static_cast<std::size_t>(place.pixel);
        // Neighbours that touch each other are on one island.
        const unsigned groups = first[above[p]];
        std::size_t own = island_.size();
        if (!groups) island_.push_back({place.pixel, own});
        for (std::size_t i = 0; groups >> i; ++i)
            if (groups >> i & 1) {
                const std::size_t other = home(number[static_cast<std::size_t>(place.pixel + steps[i])]);
                own = own == island_.size() ? other : join(own, other, distance_[p]);
            }
        number[p] = static_cast<std::uint32_t>(own);
        for (std::size_t i = 0; i < 8; ++i)
            above[static_cast<std::size_t>(place.pixel + steps[i])] |= static_cast<std::uint8_t>(128u >> i);
    }
    for (std::size_t i = 0; i < island_.size(); ++i)
        if (island_[i].home == i) found_.push_back(island_[i].peak);
    return std::move(found_);
}

}  // namespace

int extract_seeds(const float* distance, const std::uint8_t* mask, int height, int width, float min_distance,
                  float separation, std::int32_t* markers) {
    const Index stride = width + 2;
    const std::array<Index, 8> neighbours{-stride - 1, -stride, -stride + 1, -1, 1, stride - 1, stride, stride + 1};
    const float lowest = separation * min_distance;
    std::vector<float> inside(static_cast<std::size_t>(stride) * static_cast<std::size_t>(height + 2), 0);
    std::vector<Place> order;
    order.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int row = 0; row < height; ++row)
        for (int col = 0; col < width; ++col) {
            const Index k = row * width + col, p = (row + 1) * stride + col + 1;
            if (!(distance[k] > 0) || distance[k] < lowest || (mask && !mask[k])) continue;
            inside[static_cast<std::size_t>(p)] = distance[k];
            order.push_back(place_of(distance[k], p));
        }
    sort(order);

    // Flood every seed from its peak.
    std::vector<Index> seed(inside.size(), 0), stack;
    Index seeds = 0;
    for (const Index peak : Islands(inside, separation).peaks(order, neighbours)) {
        const float top = inside[static_cast<std::size_t>(peak)];
        if (top < min_distance) continue;
        const float least = std::max(separation * top, std::numeric_limits<float>::denorm_min());
        seed[static_cast<std::size_t>(peak)] = ++seeds;
        stack.assign(1, peak);
        while (!stack.empty()) {
            const Index p = stack.back();
            stack.pop_back();
            for (const Index step : neighbours) {
                const auto q = static_cast<std::size_t>(p + step);
                if (inside[q] < least || seed[q]) continue;
                seed[q] = seeds;
                stack.push_back(p + step);
            }
        }
    }
    // Number them.
    std::vector<Index> number(static_cast<std::size_t>(seeds) + 1, 0);
    Index count = 0;
    for (int row = 0; row < height; ++row)
        for (int col = 0; col < width; ++col) {
            const Index own = seed[static_cast<std::size_t>((row + 1) * stride + col + 1)];
            Index& n = number[static_cast<std::size_t>(own)];
            if (own && !n) n = ++count;
            markers[row * width + col] = n;
        }
    return count;
}

}  // namespace rangeedge
