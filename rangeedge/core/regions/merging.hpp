// Merging: patches of one surface, and patches whose surfaces go on into each other, become one region.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "regions/adjacency.hpp"

namespace rangeedge {

void merge(PatchMap& patches, Adjacency& adjacency);

// Strips along rounded edges are no surfaces: small patches, open to their neighbours, whose pixels those explain.
// Their pixels go to these.
void absorb_strips(PatchMap& patches, Adjacency& adjacency);

}  // namespace rangeedge
