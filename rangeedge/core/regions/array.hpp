// A vector that is indexed by int, as pixels, patches and labels are.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace rangeedge {

template <class T>
class Array : public std::vector<T> {
public:
    using std::vector<T>::vector;
    T& operator[](int i) { return std::vector<T>::operator[](static_cast<std::size_t>(i)); }
    const T& operator[](int i) const { return std::vector<T>::operator[](static_cast<std::size_t>(i)); }
    int count() const { return static_cast<int>(this->size()); }
};

}  // namespace rangeedge
