// Edge candidates as Python takes them, and the maps made of them.
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <type_traits>
#include <vector>

#include "edges/candidate.hpp"
#include "edges/combine.hpp"
#include "python/arrays.hpp"

namespace rangeedge::python {

using Columns = nb::typed<nb::dict, nb::str, nb::any>;

// One array a field, by the field's name.
inline Columns columns(const CandidateList& candidates) {
    nb::dict result;
    const auto add = [&](const char* name, auto member) {
        using E = std::decay_t<decltype(candidates[0].*member)>;
        std::vector<E> values;
        values.reserve(candidates.size());
        for (const Candidate& c : candidates) values.push_back(c.*member);
        result[name] = handed_over<E>(std::move(values));
    };
    add("x", &Candidate::x);
    add("y", &Candidate::y);
    add("jump", &Candidate::jump);
    add("crease", &Candidate::crease);
    add("kind", &Candidate::kind);
    add("significance", &Candidate::significance);
    add("direction", &Candidate::direction);
    add("shift", &Candidate::shift);
    add("before", &Candidate::before);
    add("after", &Candidate::after);
    return result;
}

// The maps of edges that Python hands over.
inline EdgeMaps maps_of(const OutImage<float>& jump, const OutImage<float>& crease, const OutImage<std::uint8_t>& kind,
                        const OutImage<float>& significance) {
    return {static_cast<std::int32_t>(jump.size()), jump.data(), crease.data(), kind.data(), significance.data()};
}

}  // namespace rangeedge::python
