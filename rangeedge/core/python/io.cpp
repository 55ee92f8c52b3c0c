// Unpacking of compressed files. The sizes of outputs are the caller's to check.
// SPDX-License-Identifier: Apache-2.0
#include <cstdint>

#include "io/lzf.hpp"
#include "io/lzw.hpp"
#include "io/png.hpp"
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

bool bound_png_unfilter(const Values<std::uint8_t>& filtered, std::size_t pixel_bytes,
                        const OutImage<std::uint8_t>& out) {
    return png_unfilter(filtered.data(), out.shape(0), out.shape(1), pixel_bytes, out.data());
}

}  // namespace

void bind_io(nb::module_& m) {
    m.def("lzf_unpack", &bound_lzf_unpack, array("packed"), array("out"), Unlocked());
    m.def("png_unfilter", &bound_png_unfilter, array("filtered"), "pixel_bytes"_a, array("out"), Unlocked());
    m.def("lzw_unpack", &bound_lzw_unpack, array("packed"), array("out"), Unlocked());
}

}  // namespace rangeedge::python
