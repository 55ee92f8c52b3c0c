// Kernels run while other Python threads do, and are given up on Ctrl-C or when another thread says so.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nanobind/nanobind.h>

#include "base/watch.hpp"

namespace rangeedge::python {

// Python's lock, given back while this lasts.
class Released {
public:
    Released();
    ~Released();
    Released(const Released&) = delete;
    Released& operator=(const Released&) = delete;

private:
    PyThreadState* state_;
};

class Unlock {
public:
    Unlock();

private:
    Released released_;
    Watch watch_;
};
using Unlocked = nanobind::call_guard<Unlock>;

}  // namespace rangeedge::python
