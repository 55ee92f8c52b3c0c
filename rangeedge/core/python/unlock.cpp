// SPDX-License-Identifier: Apache-2.0
#include "python/unlock.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace rangeedge::python {
namespace {

namespace nb = nanobind;
using namespace nb::literals;

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

// A call of a function of the package by a thread that is within such blocks. What of it is Python and what other
// libraries do is given up as well, between two steps of Python: by an exception that is raised there, and that leaves
// the call as CancelledError. All of this is guarded by Python's lock.
struct Call {
    unsigned long thread;
    const std::vector<const Cancellation*>* entered;
    bool told = false;
};
std::vector<Call> calls;
PyObject* given_up;  // derived from BaseException, which nobody catches on the way

struct CallBlock {};  // the `with` block of a call

struct Depth {
    int calls = 0;  // one within the other
    bool listed = false;
};
Depth& depth() {
    thread_local Depth own;
    return own;
}

// Once Python ends, a thread that asks for its lock is ended in the middle of what it does, which C++ does not survive.
// So threads that are still at work wait for the end of the process then, but for the one that ends Python, which waits
// for those that have asked before.
std::atomic<bool> python_ends{false};
std::atomic<int> asking{0};
std::thread::id ending;

void ask_for_lock() {
    ++asking;
    if (!python_ends || std::this_thread::get_id() == ending) return;
    --asking;
    while (true) std::this_thread::sleep_for(std::chrono::hours(1));
}

void end_python() {
    ending = std::this_thread::get_id();
    python_ends = true;
    const nb::gil_scoped_release released;
    while (asking > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

// The child of a fork has one thread, which holds the lock; those that were asking for it are not there.
void forget_others() {
    asking = 0;
    calls.erase(std::remove_if(calls.begin(), calls.end(), [](const Call& c) { return c.entered != &entered(); }),
                calls.end());
}

void ask_cancellations() {
    for (const Cancellation* c : entered())
        if (c->set.load(std::memory_order_relaxed)) throw Cancelled();
}

void ask() {
    ask_cancellations();
    ask_for_lock();
    const nb::gil_scoped_acquire locked;
    --asking;
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

void cancel(Cancellation& self) {
    self.set = true;
    for (Call& call : calls)
        if (std::find(call.entered->begin(), call.entered->end(), &self) != call.entered->end())
            call.told = PyThreadState_SetAsyncExc(call.thread, given_up) > 0;
}

void begin_call() {
    if (depth().calls == 0 && !entered().empty()) {
        ask_cancellations();
        calls.push_back({PyThread_get_thread_ident(), &entered()});
        depth().listed = true;
    }
    ++depth().calls;
}

void end_call(const nb::object& type, const nb::args&) {
    if (--depth().calls > 0 || !depth().listed) return;
    depth().listed = false;
    const auto own = std::find_if(calls.begin(), calls.end(), [](const Call& c) { return c.entered == &entered(); });
    if (own->told) PyThreadState_SetAsyncExc(own->thread, nullptr);  // which has come or will not be needed
    calls.erase(own);
    if (type.is(given_up)) throw Cancelled();
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

Released::Released() : state_(PyEval_SaveThread()) {}
Released::~Released() {
    ask_for_lock();
    PyEval_RestoreThread(state_);
    --asking;
}

Unlock::Unlock() : watch_(ask) { ask_cancellations(); }

void bind_cancellation(nb::module_& m) {
    nb::class_<Cancellation>(m, "Cancellation", "Gives up the kernels that threads call within its `with` block.")
        .def(nb::init<>())
        .def("set", &cancel)
        .def("is_set", [](const Cancellation& self) { return self.set.load(); })
        .def("__enter__", &enter)
        .def("__exit__", &leave);
    nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
        try {
            std::rethrow_exception(thrown);
        } catch (const Cancelled&) {
            if (depth().listed) {  // on its way out of a call
                PyErr_SetNone(given_up);
                return;
            }
            const nb::object type = nb::module_::import_("concurrent.futures").attr("CancelledError");
            const nb::object raised = type("the call was given up");
            raised.attr("__suppress_context__") = true;
            PyErr_SetObject(type.ptr(), raised.ptr());
        }
    });
    given_up = PyErr_NewException("rangeedge._core.GivenUp", PyExc_BaseException, nullptr);
    nb::class_<CallBlock>(m, "Call",
                          "A block in which cancellations of this thread are heeded between steps of Python.")
        .def(nb::init<>())
        .def("__enter__", [](const CallBlock&) { begin_call(); })
        .def(
            "__exit__", [](const CallBlock&, const nb::object& type, const nb::args& rest) { end_call(type, rest); },
            "type"_a.none(), "rest"_a);
    m.def("checkpoint", &ask_cancellations, "Gives up a call that is within the block of a set cancellation.");
    nb::set_leak_warnings(false);  // of what threads hold that are still at work then
    nb::module_::import_("atexit").attr("register")(nb::cpp_function(&end_python));
    const nb::module_ os = nb::module_::import_("os");
    if (nb::hasattr(os, "register_at_fork"))
        os.attr("register_at_fork")("after_in_child"_a = nb::cpp_function(&forget_others));
}

}  // namespace rangeedge::python
