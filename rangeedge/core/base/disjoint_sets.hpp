// Union-find: disjoint sets of numbers, each known by one of its members.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace rangeedge {

// Numbers 0 .. size() - 1, each a set by itself until sets are linked. Which member represents a set is the caller's to
// say, since rules of precedence differ; paths are halved on the way (Tarjan and van Leeuwen, JACM 31(2), 1984).
class DisjointSets {
public:
    explicit DisjointSets(int size = 0) {
        while (this->size() < size) add();
    }

    int size() const { return static_cast<int>(parent_.size()); }
    int add() {
        parent_.push_back(size());
        return size() - 1;
    }
    // The representative of the set that holds i.
    int find(int i) {
        while (parent(i) != i) i = parent(i) = parent(parent(i));
        return i;
    }
    bool is_root(int i) const { return parent_[static_cast<std::size_t>(i)] == i; }
    // The set of one representative joins that of another.
    void link(int root, int to) { parent(root) = to; }

private:
    int& parent(int i) { return parent_[static_cast<std::size_t>(i)]; }

    std::vector<int> parent_;
};

}  // namespace rangeedge
