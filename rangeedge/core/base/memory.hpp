// Memory of large arrays.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <new>
#include <utility>
#include <vector>

#include "base/watch.hpp"

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace rangeedge {

// Asks for large pages where there is much: what is near in an image is far apart in memory, and looking up one of many
// small pages takes as long as what is then done with a pixel. Elements without a value are not set.
template <class T>
struct LargeAllocator {
    using value_type = T;

    LargeAllocator() = default;
    template <class U>
    LargeAllocator(const LargeAllocator<U>&) {}

    T* allocate(std::size_t n) {
        if (!is_large(n)) return static_cast<T*>(::operator new(n * sizeof(T)));
        void* const p = ::operator new(n * sizeof(T), std::align_val_t{page});
#if defined(__linux__) && defined(MADV_HUGEPAGE)
        madvise(p, n * sizeof(T) / page * page, MADV_HUGEPAGE);
#endif
        return static_cast<T*>(p);
    }
    void deallocate(T* p, std::size_t n) {
        if (is_large(n))
            ::operator delete(p, std::align_val_t{page});
        else
            ::operator delete(p);
    }
    template <class U>
    void construct(U* p) {
        ::new (static_cast<void*>(p)) U;
    }
    template <class U, class... Args>
    void construct(U* p, Args&&... args) {
        ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
    }

    template <class U>
    bool operator==(const LargeAllocator<U>&) const {
        return true;
    }
    template <class U>
    bool operator!=(const LargeAllocator<U>&) const {
        return false;
    }

private:
    static constexpr std::size_t page = std::size_t{1} << 21, least = 2 * page;  // bytes

    static bool is_large(std::size_t n) { return n > least / sizeof(T); }
};

template <class T>
using LargeVector = std::vector<T, LargeAllocator<T>>;

// As resize(size, value), with checkpoints: memory that is touched for the first time comes slowly.
template <class T>
void fill_up(LargeVector<T>& values, std::size_t size, const T& value) {
    constexpr std::size_t block = (std::size_t{1} << 22) / sizeof(T) + 1;
    if (size > values.capacity()) values.reserve(std::max(size, 2 * values.capacity()));
    while (values.size() + block < size) {
        values.resize(values.size() + block, value);
        Watch::checkpoint();
    }
    values.resize(size, value);
}

}  // namespace rangeedge
