// The Python module: glue only. Arguments are checked by the Python layer.
// SPDX-License-Identifier: Apache-2.0
#include <nanobind/nanobind.h>

namespace rangeedge::python {

void bind_cancellation(nanobind::module_& m);
void bind_image(nanobind::module_& m);
void bind_edges(nanobind::module_& m);
void bind_explain(nanobind::module_& m);
void bind_chains(nanobind::module_& m);
void bind_distance(nanobind::module_& m);
void bind_regions(nanobind::module_& m);
void bind_cleaning(nanobind::module_& m);
void bind_outlines(nanobind::module_& m);
void bind_io(nanobind::module_& m);

}  // namespace rangeedge::python

NB_MODULE(_core, m) {
    m.doc() = "The compiled kernels. Arrays are C-contiguous; outputs are written in place.";
    rangeedge::python::bind_cancellation(m);
    rangeedge::python::bind_image(m);
    rangeedge::python::bind_edges(m);
    rangeedge::python::bind_explain(m);
    rangeedge::python::bind_chains(m);
    rangeedge::python::bind_distance(m);
    rangeedge::python::bind_regions(m);
    rangeedge::python::bind_cleaning(m);
    rangeedge::python::bind_outlines(m);
    rangeedge::python::bind_io(m);
}
