// SPDX-License-Identifier: Apache-2.0
#include "python/unlock.hpp"

#include <algorithm>
#include <atomic>
#include <vector>

namespace rangeedge::python {
namespace {

namespace nb = nanobind;

struct Cancelled : std::exception {
    const char* what() const noexcept override { return "cancelled"; }
};

// Kernels of a thread that is within its `with` block are given up once it is set, on whatever thread.
struct Cancellation {
    std::atomic<bool> set{false};
};

// Those whose `with` blocks the thread is in, the innermost last.
std::vector<const Cancellation*>& entered() {
    thread_local std::vector<const Cancellation*> all;
    return all;
}

// Once Python ends, its lock is no longer to be had by threads that still work.
std::atomic<bool> python_ends{false};

void ask_cancellations() {
    for (const Cancellation* c : entered())
        if (c->set.load(std::memory_order_relaxed)) throw Cancelled();
}

void ask() {
    ask_cancellations();
    if (python_ends) return;
    const nb::gil_scoped_acquire locked;
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

nb::object enter(nb::handle self) {
    entered().push_back(nb::cast<const Cancellation*>(self));
    return nb::borrow(self);
}

void leave(const Cancellation& self, const nb::args&) {
    std::vector<const Cancellation*>& all = entered();
    const auto last = std::find(all.rbegin(), all.rend(), &self);
    if (last != all.rend()) all.erase(std::next(last).base());
}

}  // namespace

Unlock::Unlock() : watch_(ask) { ask_cancellations(); }

void bind_cancellation(nb::module_& m) {
    nb::class_<Cancellation>(m, "Cancellation", "Gives up the kernels that threads call within its `with` block.")
        .def(nb::init<>())
        .def("set", [](Cancellation& self) { self.set = true; })
        .def("is_set", [](const Cancellation& self) { return self.set.load(); })
        .def("__enter__", &enter)
        .def("__exit__", &leave);
    nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
        try {
            std::rethrow_exception(thrown);
        } catch (const Cancelled&) {
            const nb::object type = nb::module_::import_("concurrent.futures").attr("CancelledError");
            PyErr_SetString(type.ptr(), "the call was given up");
        }
    });
    nb::set_leak_warnings(false);  // of what threads hold that are still at work then
    nb::module_::import_("atexit").attr("register")(nb::cpp_function([] { python_ends = true; }));
}

}  // namespace rangeedge::python
