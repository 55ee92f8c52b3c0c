// What is slow in Python about reading files. Outputs are written in place; their sizes are the caller's to check.
// SPDX-License-Identifier: Apache-2.0
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>

#include "io/lzf.hpp"
#include "io/lzw.hpp"
#include "io/ply.hpp"
#include "io/png.hpp"

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

std::size_t ply_first_items(const Bytes<const std::uint8_t>& data, std::size_t length_bytes, bool big_endian,
                            std::size_t item_bytes,
                            const nb::ndarray<std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>& first) {
    return rangeedge::ply_first_items(data.data(), data.shape(0), first.shape(0),
                                      {length_bytes, big_endian, item_bytes}, first.data());
}

bool png_unfilter(const Bytes<const std::uint8_t>& filtered, std::size_t pixel_bytes,
                  const nb::ndarray<std::uint8_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>& out) {
    return rangeedge::png_unfilter(filtered.data(), out.shape(0), out.shape(1), pixel_bytes, out.data());
}

}  // namespace

void bind_io(nb::module_& m) {
    m.def("lzf_unpack", &lzf_unpack, "packed"_a.noconvert(), "out"_a.noconvert(),
          nb::call_guard<nb::gil_scoped_release>());
    m.def("ply_first_items", &ply_first_items, "data"_a.noconvert(), "length_bytes"_a, "big_endian"_a, "item_bytes"_a,
          "first"_a.noconvert(), nb::call_guard<nb::gil_scoped_release>());
    m.def("png_unfilter", &png_unfilter, "filtered"_a.noconvert(), "pixel_bytes"_a, "out"_a.noconvert(),
          nb::call_guard<nb::gil_scoped_release>());
    m.def("lzw_unpack", &lzw_unpack, "packed"_a.noconvert(), "out"_a.noconvert(),
          nb::call_guard<nb::gil_scoped_release>());
}
