#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstdint>

#include "distance/distance.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

template <class T>
using Image = nb::ndarray<T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

int rows(const Image<float>& image) { return static_cast<int>(image.shape(0)); }
int cols(const Image<float>& image) { return static_cast<int>(image.shape(1)); }

void distance_transform(const Image<const std::uint8_t>& edges, const Image<float>& distance,
                        const Image<std::int32_t>& labels, int threads) {
    rangeedge::distance_transform(edges.data(), rows(distance), cols(distance), distance.data(), labels.data(),
                                  threads);
}

template <class T>
void salience_multiplicative(const Image<const T>& salience, const Image<float>& distance,
                             const Image<std::int32_t>& labels, int threads) {
    rangeedge::salience_multiplicative(salience.data(), rows(distance), cols(distance), distance.data(),
                                       labels.data(), threads);
}

template <class T>
void salience_additive(const Image<const T>& salience, double lambda, const Image<float>& distance,
                       const Image<std::int32_t>& labels, int threads) {
    rangeedge::salience_additive(salience.data(), rows(distance), cols(distance), lambda, distance.data(),
                                 labels.data(), threads);
}

template <class T>
void bind_salience(nb::module_& m) {
    m.def("salience_multiplicative", &salience_multiplicative<T>, "salience"_a.noconvert(), "distance"_a.noconvert(),
          "labels"_a.noconvert().none(), "threads"_a, nb::call_guard<nb::gil_scoped_release>());
    m.def("salience_additive", &salience_additive<T>, "salience"_a.noconvert(), "lambda_"_a,
          "distance"_a.noconvert(), "labels"_a.noconvert().none(), "threads"_a,
          nb::call_guard<nb::gil_scoped_release>());
}

}  // namespace

// Outputs are written in place; labels may be None. Shapes are the caller's to check.
void bind_distance(nb::module_& m) {
    m.def("distance_transform", &distance_transform, "edges"_a.noconvert(), "distance"_a.noconvert(),
          "labels"_a.noconvert().none(), "threads"_a, nb::call_guard<nb::gil_scoped_release>());
    bind_salience<std::uint8_t>(m);
    bind_salience<float>(m);
}
