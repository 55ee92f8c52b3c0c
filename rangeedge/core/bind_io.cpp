// Unpacking of compressed files. Outputs are written in place; their sizes are the caller's to check.
// SPDX-License-Identifier: Apache-2.0
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>

#include "io/lzf.hpp"
#include "io/lzw.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

template <class T>
using Bytes = nb::ndarray<T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

bool lzf_unpack(const Bytes<const std::uint8_t>& packed, const Bytes<std::uint8_t>& out) {
    return rangeedge::lzf_unpack(packed.data(), packed.shape(0), out.data(), out.shape(0));
}

std::size_t lzw_unpack(const Bytes<const std::uint8_t>& packed, const Bytes<std::uint8_t>& out) {
    return rangeedge::lzw_unpack(packed.data(), packed.shape(0), out.data(), out.shape(0));
}

}  // namespace

void bind_io(nb::module_& m) {
    m.def("lzf_unpack", &lzf_unpack, "packed"_a.noconvert(), "out"_a.noconvert(),
          nb::call_guard<nb::gil_scoped_release>());
    m.def("lzw_unpack", &lzw_unpack, "packed"_a.noconvert(), "out"_a.noconvert(),
          nb::call_guard<nb::gil_scoped_release>());
}
