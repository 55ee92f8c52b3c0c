// Unpacking of compressed files. The sizes of outputs are the caller's to check.
// SPDX-License-Identifier: Apache-2.0
#include <cstdint>

#include "io/lzf.hpp"
#include "io/lzw.hpp"
#include "python/arrays.hpp"

namespace rangeedge::python {
namespace {

using OutValues = nb::ndarray<std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

bool bound_lzf_unpack(const Values<std::uint8_t>& packed, const OutValues& out) {
    return lzf_unpack(packed.data(), packed.shape(0), out.data(), out.shape(0));
}

std::size_t bound_lzw_unpack(const Values<std::uint8_t>& packed, const OutValues& out) {
    return lzw_unpack(packed.data(), packed.shape(0), out.data(), out.shape(0));
}

}  // namespace

void bind_io(nb::module_& m) {
    m.def("lzf_unpack", &bound_lzf_unpack, array("packed"), array("out"), Unlocked());
    m.def("lzw_unpack", &bound_lzw_unpack, array("packed"), array("out"), Unlocked());
}

}  // namespace rangeedge::python
