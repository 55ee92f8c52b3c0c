// Bits of floats can be made whole numbers in the order of the floats. These are counted by their highest digits, and
// in the digit that holds a rank by the next ones, until they are known: passes over the image, and no copy of it.
// SPDX-License-Identifier: Apache-2.0
#include "image/ranks.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>

#include "base/watch.hpp"

namespace rangeedge {
namespace {

constexpr int digit_bits = 16;
constexpr std::int64_t block = 1 << 16;  // values between checkpoints

template <class F>
void for_blocks(std::int64_t size, F&& visit) {
    for (std::int64_t begin = 0; begin < size; begin += block) {
        Watch::checkpoint();
        const std::int64_t end = std::min(begin + block, size);
        for (std::int64_t i = begin; i < end; ++i) visit(i);
    }
}

template <class T>
class Counting {
public:
    using Key = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;

    Counting(const T* values, std::int64_t size) : values_(values), size_(size) {}

    // The ranks among keys that begin with `prefix`, which `bits` more complete; their values go to `found`.
    void find(Key prefix, int bits, std::vector<std::int64_t> ranks, std::vector<T>& found) const {
        if (bits == 0) {
            found.insert(found.end(), ranks.size(), value_of(prefix));
            return;
        }
        const int rest = bits - digit_bits;
        std::vector<std::int64_t> counts(std::size_t{1} << digit_bits, 0);
        for_blocks(size_, [&](std::int64_t i) {
            const Key key = key_of(values_[i]);
            if ((bits == all || key >> bits == prefix) && values_[i] == values_[i])
                ++counts[static_cast<std::size_t>(key >> rest) & (counts.size() - 1)];
        });
        std::int64_t below = 0;
        auto next = ranks.begin();
        for (std::size_t digit = 0; digit < counts.size() && next != ranks.end(); below += counts[digit++]) {
            std::vector<std::int64_t> own;
            for (; next != ranks.end() && *next < below + counts[digit]; ++next) own.push_back(*next - below);
            if (!own.empty()) find(static_cast<Key>(prefix << digit_bits | digit), rest, own, found);
        }
    }

    static constexpr int all = 8 * sizeof(T);

private:
    static constexpr Key sign = Key{1} << (all - 1);

    static Key key_of(T value) {
        Key bits;
        std::memcpy(&bits, &value, sizeof bits);
        return bits & sign ? ~bits : bits | sign;
    }
    static T value_of(Key key) {
        const Key bits = key & sign ? key & ~sign : ~key;
        T value;
        std::memcpy(&value, &bits, sizeof value);
        return value;
    }

    const T* values_;
    std::int64_t size_;
};

}  // namespace

template <class T>
std::int64_t count_numbers(const T* values, std::int64_t size) {
    std::int64_t count = 0;
    for_blocks(size, [&](std::int64_t i) { count += values[i] == values[i]; });
    return count;
}

template <class T>
std::vector<T> values_of_ranks(const T* values, std::int64_t size, const std::vector<std::int64_t>& ranks) {
    std::vector<T> found;
    Counting<T>(values, size).find(0, Counting<T>::all, ranks, found);
    return found;
}

template std::int64_t count_numbers(const float*, std::int64_t);
template std::int64_t count_numbers(const double*, std::int64_t);
template std::vector<float> values_of_ranks(const float*, std::int64_t, const std::vector<std::int64_t>&);
template std::vector<double> values_of_ranks(const double*, std::int64_t, const std::vector<std::int64_t>&);

}  // namespace rangeedge
