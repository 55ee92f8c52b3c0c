// SPDX-License-Identifier: Apache-2.0
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

#include <array>
#include <optional>
#include <type_traits>

#include "edges.hpp"
#include "noise.hpp"
#include "scanline.hpp"
#include "selection.hpp"
#include "simd.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace rangeedge;

namespace {

template <class T>
using In = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;
template <class T>
using Out = nb::ndarray<T, nb::c_contig, nb::device::cpu>;

// Hands a vector to NumPy without a copy; elements that hold several T become rows.
template <class T, class E>
nb::ndarray<nb::numpy, T> handed_over(std::vector<E>&& values) {
    auto* owner = new std::vector<E>(std::move(values));
    nb::capsule capsule(owner, [](void* p) noexcept { delete static_cast<std::vector<E>*>(p); });
    if constexpr (std::is_same_v<T, E>) return nb::ndarray<nb::numpy, T>(owner->data(), {owner->size()}, capsule);
    else return nb::ndarray<nb::numpy, T>(owner->data(), {owner->size(), sizeof(E) / sizeof(T)}, capsule);
}

// One array a field, by the field's name.
nb::dict columns(const std::vector<Candidate>& candidates) {
    nb::dict result;
    const auto add = [&](const char* name, auto field) {
        using E = std::decay_t<decltype(candidates[0].*field)>;
        std::vector<E> values;
        values.reserve(candidates.size());
        for (const Candidate& c : candidates) values.push_back(c.*field);
        result[name] = handed_over<E>(std::move(values));
    };
    add("x", &Candidate::x);
    add("y", &Candidate::y);
    add("jump", &Candidate::jump);
    add("crease", &Candidate::crease);
    add("kind", &Candidate::kind);
    add("significance", &Candidate::significance);
    add("direction", &Candidate::direction);
    return result;
}

template <class T>
nb::ndarray<nb::numpy, int> split_scan_line(In<T> y, std::optional<In<T>> x, double eps) {
    std::vector<Segment> segments;
    {
        nb::gil_scoped_release release;
        std::vector<T> samples(y.data(), y.data() + y.size());
        samples.resize(y.size() + padding);
        Splitter<T> splitter;
        splitter.add({samples.data(), x ? x->data() : nullptr, nullptr, static_cast<int>(y.size()), static_cast<T>(eps)});
        splitter.split();
        splitter.for_each_segment(0, [&](const Segment& s) { segments.push_back(s); });
    }
    return handed_over<int>(std::move(segments));
}

template <class T>
RangeImage<T> range_image(const In<T>& src, bool projective, const std::array<double, 6>& to_plane,
                          const std::array<double, 3>& axis) {
    const bool points = src.ndim() == 3;
    RangeImage<T> image{};
    image.rows = static_cast<int>(src.shape(0));
    image.cols = static_cast<int>(src.shape(1));
    image.ordinate = points ? nullptr : src.data();
    image.points = points ? src.data() : nullptr;
    image.projective = projective;
    std::copy(to_plane.begin(), to_plane.end(), image.to_plane);
    std::copy(axis.begin(), axis.end(), image.axis);
    return image;
}

using NoiseArgs = std::array<double, 4>;

Noise noise_model(const NoiseArgs& abc, const std::optional<In<float>>& map) {
    return {abc[0], abc[1], abc[2], abc[3], map ? map->data() : nullptr};
}

template <class T, class Real>
void define_inverse(nb::module_& m) {
    m.def(
        "invert_depth",
        [](In<T> depth, Real factor, std::optional<In<std::uint8_t>> mask, Out<Real> inverse) {
            nb::gil_scoped_release release;
            invert_depth(depth.data(), depth.size(), factor, mask ? mask->data() : nullptr, inverse.data());
        },
        "depth"_a.noconvert(), "factor"_a, "mask"_a.noconvert().none(), "inverse"_a.noconvert());
}

template <class T>
void define(nb::module_& m) {
    m.def("split_scan_line", &split_scan_line<T>, "y"_a.noconvert(), "x"_a.noconvert().none(), "eps"_a);
    m.def(
        "noise_statistics",
        [](In<T> ordinate, int threads) {
            NoiseStatistics found;
            {
                nb::gil_scoped_release release;
                found = noise_statistics(ordinate.data(), static_cast<int>(ordinate.shape(0)),
                                         static_cast<int>(ordinate.shape(1)), threads);
            }
            return nb::make_tuple(found.near, found.far, found.lowest, found.highest,
                                  handed_over<double>(std::move(found.ordinates)),
                                  handed_over<double>(std::move(found.deviations)));
        },
        "ordinate"_a.noconvert(), "threads"_a);
    m.def(
        "edge_candidates",
        [](In<T> src, bool projective, std::array<double, 6> to_plane, std::array<double, 3> axis, NoiseArgs noise,
           std::optional<In<float>> noise_map, const Parameters& parameters) {
            std::vector<Candidate> candidates;
            {
                nb::gil_scoped_release release;
                candidates = detect(range_image(src, projective, to_plane, axis), noise_model(noise, noise_map), parameters);
                put_in_order(candidates);
            }
            return columns(candidates);
        },
        "src"_a.noconvert(), "projective"_a, "to_plane"_a, "axis"_a, "noise"_a, "noise_map"_a.noconvert().none(), "parameters"_a);
    m.def(
        "flying_pixels",
        [](In<T> src, bool projective, std::array<double, 6> to_plane, std::array<double, 3> axis, NoiseArgs noise,
           std::optional<In<float>> noise_map, const Parameters& parameters, Out<std::uint8_t> flying) {
            nb::gil_scoped_release release;
            detect(range_image(src, projective, to_plane, axis), noise_model(noise, noise_map), parameters, flying.data());
        },
        "src"_a.noconvert(), "projective"_a, "to_plane"_a, "axis"_a, "noise"_a, "noise_map"_a.noconvert().none(), "parameters"_a,
        "flying"_a.noconvert());
    m.def(
        "edge_strength",
        [](In<T> src, bool projective, std::array<double, 6> to_plane, std::array<double, 3> axis, NoiseArgs noise,
           std::optional<In<float>> noise_map, const Parameters& parameters, Out<float> jump, Out<float> crease,
           Out<std::uint8_t> kind, Out<float> significance) {
            nb::gil_scoped_release release;
            const auto image = range_image(src, projective, to_plane, axis);
            combine(detect(image, noise_model(noise, noise_map), parameters), jump.data(), crease.data(), kind.data(),
                    significance.data());
            mark_boundary(image, boundary_bit, kind.data());
        },
        "src"_a.noconvert(), "projective"_a, "to_plane"_a, "axis"_a, "noise"_a, "noise_map"_a.noconvert().none(), "parameters"_a,
        "jump"_a.noconvert(), "crease"_a.noconvert(), "kind"_a.noconvert(), "significance"_a.noconvert());
}

}  // namespace

void bind_edges(nb::module_& m) {
    nb::class_<Parameters>(m, "Parameters")
        .def(
            "__init__",
            [](Parameters* self, double eps, double eps_factor, int directions, bool interpolate, bool endpoint, bool normals,
               double max_shift, int max_gap, int max_smear, bool shadows, bool spaced, double merge_significance, double min_significance,
               int threads) {
                new (self) Parameters{eps,       eps_factor, directions,         interpolate,      endpoint, normals,
                                      max_shift, max_gap, max_smear, shadows, spaced, merge_significance, min_significance, threads};
            },
            nb::kw_only(), "eps"_a, "eps_factor"_a, "directions"_a, "interpolate"_a, "endpoint"_a, "normals"_a, "max_shift"_a,
            "max_gap"_a, "max_smear"_a, "shadows"_a, "spaced"_a, "merge_significance"_a, "min_significance"_a, "threads"_a);
    m.def(
        "long_components",
        [](In<std::uint8_t> edges, int min_length, Out<std::uint8_t> kept) {
            nb::gil_scoped_release release;
            long_components(edges.data(), static_cast<int>(edges.shape(0)), static_cast<int>(edges.shape(1)), min_length,
                            kept.data());
        },
        "edges"_a.noconvert(), "min_length"_a, "kept"_a.noconvert());
    define<float>(m);
    define<double>(m);
    define_inverse<float, float>(m);
    define_inverse<double, double>(m);
    define_inverse<std::uint16_t, float>(m);
}
