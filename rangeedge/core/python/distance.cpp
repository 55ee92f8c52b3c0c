// Distance transforms.
// SPDX-License-Identifier: Apache-2.0
#include "distance/distance.hpp"

#include <cstdint>

#include "python/arrays.hpp"

namespace rangeedge::python {
namespace {

using Labels = OutImage<std::int32_t>;

// The size of pixels, and whether the last column is followed by the first.
struct Pixels {
    double width, height;
    bool wrap;
};

template <class A>
Grid grid_of(const A& image, const Pixels& pixels) {
    return {rows(image), cols(image), pixels.width, pixels.height, pixels.wrap};
}

void bound_distance_transform(const Image<std::uint8_t>& edges, const Image<std::uint8_t>& barrier,
                              const Pixels& pixels, const OutImage<float>& distance, const Labels& labels,
                              int threads) {
    const Grid grid = grid_of(edges, pixels);
    if (barrier.data())
        geodesic_transform(edges.data(), barrier.data(), grid, distance.data(), labels.data(), threads);
    else
        distance_transform(edges.data(), grid, distance.data(), labels.data(), threads);
}

template <class T>
void bind_salience(nb::module_& m) {
    m.def(
        "salience_multiplicative",
        [](const Image<T>& salience, const Pixels& pixels, const OutImage<float>& distance, const Labels& labels,
           int threads) {
            salience_multiplicative(salience.data(), grid_of(salience, pixels), distance.data(), labels.data(),
                                    threads);
        },
        array("salience"), "pixels"_a, array("distance"), optional_array("labels"), "threads"_a, Unlocked());
    m.def(
        "salience_additive",
        [](const Image<T>& salience, double lambda, const Pixels& pixels, const OutImage<float>& distance,
           const Labels& labels, int threads) {
            salience_additive(salience.data(), grid_of(salience, pixels), lambda, distance.data(), labels.data(),
                              threads);
        },
        array("salience"), "lambda_"_a, "pixels"_a, array("distance"), optional_array("labels"), "threads"_a,
        Unlocked());
}

}  // namespace

void bind_distance(nb::module_& m) {
    bind_options(m, "Pixels", field("width", &Pixels::width), field("height", &Pixels::height),
                 field("wrap", &Pixels::wrap));
    m.def("distance_transform", &bound_distance_transform, array("edges"), optional_array("barrier"), "pixels"_a,
          array("distance"), optional_array("labels"), "threads"_a, Unlocked());
    bind_salience<std::uint8_t>(m);
    bind_salience<float>(m);
}

}  // namespace rangeedge::python
