// Kernels run while other Python threads do, and are given up on Ctrl-C or when another thread says so.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nanobind/nanobind.h>

#include "base/watch.hpp"

namespace rangeedge::python {

class Unlock {
public:
    Unlock();

private:
    nanobind::gil_scoped_release release_;
    Watch watch_;
};
using Unlocked = nanobind::call_guard<Unlock>;

}  // namespace rangeedge::python
