// The Python module: glue only. Arguments are checked by the Python layer.
// SPDX-License-Identifier: Apache-2.0
#include <nanobind/nanobind.h>

namespace rangeedge::python {

namespace {

// What the module registers with Python is one for the process; so, too, are NumPy and cv2.
void expect_main_interpreter() {
    if (PyInterpreterState_GetID(PyInterpreterState_Get()) != 0)
        throw nanobind::import_error("rangeedge works in the main interpreter of a process alone, in no other");
}

}  // namespace

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
    rangeedge::python::expect_main_interpreter();
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
