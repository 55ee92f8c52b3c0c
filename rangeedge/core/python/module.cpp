// The Python module: glue only. Arguments are checked by the Python layer.
// SPDX-License-Identifier: Apache-2.0
#include <nanobind/nanobind.h>

void bind_edges(nanobind::module_& m);
void bind_distance(nanobind::module_& m);
void bind_regions(nanobind::module_& m);

NB_MODULE(_core, m) {
    bind_edges(m);
    bind_distance(m);
    bind_regions(m);
}
