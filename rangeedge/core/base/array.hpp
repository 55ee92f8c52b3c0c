// A vector whose indices are signed, as are those of pixels, samples and segments, which are counted down as well as up
// and compared with -1.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <vector>

#include "base/memory.hpp"

namespace rangeedge {

template <class T>
class Array {
public:
    using Index = std::ptrdiff_t;

    Array() = default;
    explicit Array(Index size, const T& value = T()) { resize(size, value); }

    Index size() const { return static_cast<Index>(values_.size()); }
    int count() const { return static_cast<int>(values_.size()); }  // where that is known to suffice
    bool empty() const { return values_.empty(); }
    void resize(Index size, const T& value = T()) { fill_up(values_, at(size), value); }
    void assign(Index size, const T& value) {
        values_.clear();
        fill_up(values_, at(size), value);
    }
    void clear() { values_.clear(); }
    void push_back(const T& value) { values_.push_back(value); }
    void swap(Array& other) { values_.swap(other.values_); }

    T& operator[](Index i) { return values_[at(i)]; }
    const T& operator[](Index i) const { return values_[at(i)]; }
    T& back() { return values_.back(); }
    const T& back() const { return values_.back(); }
    T* data() { return values_.data(); }
    const T* data() const { return values_.data(); }
    T* begin() { return values_.data(); }
    const T* begin() const { return values_.data(); }
    T* end() { return values_.data() + values_.size(); }
    const T* end() const { return values_.data() + values_.size(); }

private:
    static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
    LargeVector<T> values_;
};

}  // namespace rangeedge
