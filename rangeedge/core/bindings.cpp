// The Python module: glue only. Arguments are checked by the Python layer.
// SPDX-License-Identifier: Apache-2.0
#include <nanobind/nanobind.h>

void bind_edges(nanobind::module_& m);

NB_MODULE(_core, m) {
    bind_edges(m);
}
