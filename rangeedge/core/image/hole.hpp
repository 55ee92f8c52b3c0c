// Small holes of scan lines. Single pixels without data, as many scanners have them everywhere, would cut lines into
// pieces so short that noise lets nothing be told of them. So samples between two others are interpolated: nothing is
// found at these pixels, but surfaces run on.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace rangeedge {

constexpr int most_bridged = 2;  // samples of a hole

// Samples [first, end) without data, between two that have some.
struct Hole {
    int first, end;

    int size() const { return end - first; }
};

// On the straight line between the samples beside the hole; the same from either side.
template <class T>
void interpolate(const Hole& hole, T* values) {
    const T left = values[hole.first - 1], right = values[hole.end];
    const int whole = hole.size() + 1;
    for (int i = 1; i < whole; ++i)
        values[hole.first + i - 1] =
            (static_cast<T>(whole - i) * left + static_cast<T>(i) * right) / static_cast<T>(whole);
}

}  // namespace rangeedge
