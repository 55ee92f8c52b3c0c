// Which patches touch each other, and how their surfaces go on into each other along their common borders.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "regions/patches.hpp"

namespace rangeedge {

// The border of two patches, in pairs of neighbouring pixels.
struct Border {
    int pixels = 0;
    int open = 0;     // without an edge
    int smooth = 0;   // of the open ones, where both surfaces agree
    int similar = 0;  // of the open ones, where they agree roughly
    int joined = 0;   // of the open ones, where they meet, under any angle
};

struct Tolerance {
    double deviations;    // of a pixel from its surface
    double smooth_angle;  // degrees: surfaces that meet under less are one
};

// The borders between patches of different regions. Borders follow patches that are joined; what is known of a border
// is found out anew only if one of its surfaces has changed.
class Adjacency {
public:
    struct Neighbours {
        int a, b;  // patches, each standing for its surface; a < b
        Border border;
    };

    Adjacency(PatchMap& patches, const Tolerance& tolerance);

    // Brings borders to the present state of the patches; the longest come first.
    const std::vector<Neighbours>& update();
    // Patch i has another surface than at the last update.
    void has_changed(int i) { changed_[i] = 1; }
    const Tolerance& tolerance() const { return tolerance_; }
    // Sides of pixels where a patch ends, at the beginning.
    int perimeter(int i) const { return perimeter_[i]; }

private:
    // Contacts of two patches as they were at the beginning.
    struct Section {
        int a, b;
        int first, last;  // in contacts_
        bool known = false;
        Border border;
    };
    struct Contact {
        int p, q, section;
    };

    void collect();
    void sort_by_section();
    Border measure(const Section& section, const Patch& a, const Patch& b) const;

    PatchMap& patches_;
    Tolerance tolerance_;
    std::vector<Contact> contacts_;
    Array<Section> sections_;
    Array<char> changed_;
    Array<int> perimeter_;
    std::vector<Neighbours> neighbours_;
};

}  // namespace rangeedge
