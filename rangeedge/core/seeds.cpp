// SPDX-License-Identifier: Apache-2.0
#include "seeds.hpp"

#include <array>
#include <cstddef>
#include <cstring>
#include <utility>
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

// Sinking water: components of what lies above the level, each known by its highest pixel.
class Islands {
public:
    // Pixels have an index in an image with a margin; `neighbours` are the steps to the eight around.
    Islands(const std::vector<float>& distance, const std::array<Index, 8>& neighbours, float separation)
        : distance_(distance), neighbours_(neighbours), separation_(separation), parent_(distance.size(), -1) {}

    // Peaks by themselves of the pixels in `order`, which fall in distance.
    std::vector<Index> peaks(const std::vector<Index>& order) {
        std::vector<Index> found;
        for (const Index p : order) {
            parent(p) = p;
            for (const Index step : neighbours_)
                if (parent(p + step) >= 0) join(p, p + step, found);
        }
        for (const Index p : order)
            if (parent(p) == p) found.push_back(p);
        return found;
    }

private:
    float at(Index p) const { return distance_[static_cast<std::size_t>(p)]; }
    Index& parent(Index p) { return parent_[static_cast<std::size_t>(p)]; }

    Index root(Index p) {
        while (parent(p) != p) p = parent(p) = parent(parent(p));
        return p;
    }

    void join(Index level, Index q, std::vector<Index>& found) {
        Index low = root(level), high = root(q);
        if (low == high) return;
        if (at(low) > at(high) || (at(low) == at(high) && low < high)) std::swap(low, high);
        if (at(level) < separation_ * at(low)) found.push_back(low);
        parent(low) = high;
    }

    const std::vector<float>& distance_;
    std::array<Index, 8> neighbours_;
    float separation_;
    std::vector<Index> parent_;
};

}  // namespace

int extract_seeds(const float* distance, const std::uint8_t* mask, int height, int width, float min_distance,
                  float separation, std::int32_t* markers) {
    const Index stride = width + 2;
    const std::array<Index, 8> neighbours{-stride - 1, -stride, -stride + 1, -1, 1, stride - 1, stride, stride + 1};
    const float lowest = separation * min_distance;
    std::vector<float> inside(static_cast<std::size_t>(stride) * static_cast<std::size_t>(height + 2), 0);
    std::vector<Index> order;
    for (int row = 0; row < height; ++row)
        for (int col = 0; col < width; ++col) {
            const Index k = row * width + col, p = (row + 1) * stride + col + 1;
            if (!(distance[k] > 0) || distance[k] < lowest || (mask && !mask[k])) continue;
            inside[static_cast<std::size_t>(p)] = distance[k];
            order.push_back(p);
        }
    sort_falling(inside.data(), order);

    // Flood every seed from its peak.
    std::vector<Index> seed(inside.size(), 0), stack;
    for (const Index peak : Islands(inside, neighbours, separation).peaks(order)) {
        const float top = inside[static_cast<std::size_t>(peak)];
        if (top < min_distance) continue;
        seed[static_cast<std::size_t>(peak)] = peak;
        stack.assign(1, peak);
        while (!stack.empty()) {
            const Index p = stack.back();
            stack.pop_back();
            for (const Index step : neighbours) {
                const auto q = static_cast<std::size_t>(p + step);
                if (seed[q] || !(inside[q] > 0) || inside[q] < separation * top) continue;
                seed[q] = peak;
                stack.push_back(p + step);
            }
        }
    }
    // Number them.
    std::vector<Index> number(inside.size(), 0);
    Index count = 0;
    for (int row = 0; row < height; ++row)
        for (int col = 0; col < width; ++col) {
            const Index peak = seed[static_cast<std::size_t>((row + 1) * stride + col + 1)];
            Index& n = number[static_cast<std::size_t>(peak)];
            if (peak && !n) n = ++count;
            markers[row * width + col] = n;
        }
    return count;
}

}  // namespace rangeedge
