// SPDX-License-Identifier: Apache-2.0
#include "lzw.hpp"

#include <algorithm>

namespace rangeedge {

namespace {

constexpr unsigned clear = 256, end = 257, first_free = 258, table_size = 4096;

// Codes from a stream of bits, the highest bit first.
class CodeReader {
public:
    CodeReader(const std::uint8_t* data, std::size_t size) : data_(data), end_(data + size) {}

    // The next code of this many bits; `end` where the data ends.
    unsigned next(unsigned width) {
        while (bits_ < width) {
            if (data_ == end_) return end;
            held_ = (held_ << 8) | *data_++;
            bits_ += 8;
        }
        bits_ -= width;
        return (held_ >> bits_) & ((1U << width) - 1);
    }

private:
    const std::uint8_t *data_, *end_;
    std::uint32_t held_ = 0;
    unsigned bits_ = 0;
};

}  // namespace

std::size_t lzw_unpack(const std::uint8_t* packed, std::size_t packed_size, std::uint8_t* out, std::size_t size) {
    // Every string of the table has been written to `out` already: where it begins and how long it is says it all.
    std::size_t begin[table_size] = {}, length[table_size] = {};
    CodeReader codes(packed, packed_size);
    unsigned free = first_free, width = 9;
    std::size_t written = 0, before = 0;  // the string of the code before: its length, 0 for none
    while (written < size) {
        const unsigned code = codes.next(width);
        if (code == end) break;
        if (code == clear) {
            free = first_free;
            width = 9;
            before = 0;
            continue;
        }
        if (before == 0 ? code >= clear : code > free) break;
        // The new string is the one before and the byte after it, which is about to be written.
        if (before != 0 && free < table_size) {
            begin[free] = written - before;
            length[free] = before + 1;
            ++free;
            if (free + 1 >= (1U << width) && width < 12) ++width;
        }
        if (code < clear) {
            out[written++] = static_cast<std::uint8_t>(code);
            before = 1;
            continue;
        }
        if (code >= free) break;
        const std::size_t count = std::min(length[code], size - written);
        for (std::size_t i = 0; i < count; ++i) out[written + i] = out[begin[code] + i];
        written += count;
        before = count;
    }
    return written;
}

}  // namespace rangeedge
