// How arrays and options pass between Python and the kernels. Arrays are C-contiguous, of exactly the type that a
// kernel takes, and never converted; outputs are written in place. An argument that may be None is an array without
// data then. Shapes and values are for the Python layer to check.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <type_traits>
#include <utility>
#include <vector>

#include "python/unlock.hpp"

namespace rangeedge::python {

namespace nb = nanobind;
using namespace nb::literals;

template <class T>
using Values = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <class T>
using Image = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
template <class T>
using OutValues = nb::ndarray<T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <class T>
using OutImage = nb::ndarray<T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

template <class A>
int rows(const A& image) {
    return static_cast<int>(image.shape(0));
}
template <class A>
int cols(const A& image) {
    return static_cast<int>(image.shape(1));
}

// An array argument, and one that may be None.
inline auto array(const char* name) { return nb::arg(name).noconvert(); }
inline auto optional_array(const char* name) { return nb::arg(name).noconvert().none(); }

// Hands a vector to NumPy without a copy; elements that hold several T become rows.
template <class T, class E>
auto handed_over(std::vector<E>&& values) {
    auto* owner = new std::vector<E>(std::move(values));
    nb::capsule capsule(owner, [](void* p) noexcept { delete static_cast<std::vector<E>*>(p); });
    if constexpr (std::is_same_v<T, E>)
        return nb::ndarray<nb::numpy, T, nb::ndim<1>>(owner->data(), {owner->size()}, capsule);
    else
        return nb::ndarray<nb::numpy, T, nb::ndim<2>>(owner->data(), {owner->size(), sizeof(E) / sizeof(T)}, capsule);
}

// A struct of options as a Python class: its fields are keywords of the constructor, all required.
template <class Options, class Type>
struct Field {
    const char* name;
    Type Options::* member;
};
template <class Options, class Type>
Field<Options, Type> field(const char* name, Type Options::* member) {
    return {name, member};
}

template <class Options, class... Types>
void bind_options(nb::module_& m, const char* name, Field<Options, Types>... fields) {
    nb::class_<Options>(m, name).def(
        "__init__",
        [fields...](Options* self, Types... values) {
            new (self) Options{};
            ((self->*fields.member = values), ...);
        },
        nb::kw_only(), nb::arg(fields.name)...);
}

}  // namespace rangeedge::python
