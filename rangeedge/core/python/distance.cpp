// Distance transforms.
// SPDX-License-Identifier: Apache-2.0
#include "distance/distance.hpp"

#include <cstdint>

#include "python/arrays.hpp"

namespace rangeedge::python {
namespace {

using Labels = OutImage<std::int32_t>;

void bound_distance_transform(const Image<std::uint8_t>& edges, const OutImage<float>& distance, const Labels& labels,
                              int threads) {
    distance_transform(edges.data(), rows(edges), cols(edges), distance.data(), labels.data(), threads);
}

template <class T>
void bind_salience(nb::module_& m) {
    m.def(
        "salience_multiplicative",
        [](const Image<T>& salience, const OutImage<float>& distance, const Labels& labels, int threads) {
            salience_multiplicative(salience.data(), rows(salience), cols(salience), distance.data(), labels.data(),
                                    threads);
        },
        array("salience"), array("distance"), optional_array("labels"), "threads"_a, Unlocked());
    m.def(
        "salience_additive",
        [](const Image<T>& salience, double lambda, const OutImage<float>& distance, const Labels& labels,
           int threads) {
            salience_additive(salience.data(), rows(salience), cols(salience), lambda, distance.data(), labels.data(),
                              threads);
        },
        array("salience"), "lambda_"_a, array("distance"), optional_array("labels"), "threads"_a, Unlocked());
}

}  // namespace

void bind_distance(nb::module_& m) {
    m.def("distance_transform", &bound_distance_transform, array("edges"), array("distance"), optional_array("labels"),
          "threads"_a, Unlocked());
    bind_salience<std::uint8_t>(m);
    bind_salience<float>(m);
}

}  // namespace rangeedge::python
