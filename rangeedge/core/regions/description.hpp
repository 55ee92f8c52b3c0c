// What labelled regions are like: extent, moments of their points, and how far points lie off quadrics.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace rangeedge {

// Labels 0 .. count - 1 of rows * cols pixels.
struct LabelImage {
    const std::int32_t* labels;
    int rows, cols, count;
};

// For every label left, top, width, height and area in `boxes` (5 each; of a label without pixels 0), and the mean
// column and row in `centroids` (2 each; NaN).
void label_statistics(const LabelImage& image, int threads, std::int32_t* boxes, double* centroids);

constexpr int moment_count = 35;  // of x^i y^j z^k, i + j + k <= 4

// For every label but 0, of the points (3 coordinates each) of its pixels: the middle of their box in `origins` (3
// each) and half its largest side in `scales`; the means of x^i y^j z^k of (point - origin) / scale in `moments`, by
// rising degree, then falling i, then falling j. `curved` says whether a quadratic over columns and rows describes the
// ordinates much better than a plane.
void region_moments(const LabelImage& image, const double* points, const double* ordinate, int threads, double* origins,
                    double* scales, double* moments, std::uint8_t* curved);

// The root mean square of F / max(|grad F|, floor) over the points of every label whose floor is > 0, in units of its
// scale; F = a x^2 + b y^2 + c z^2 + d xy + e xz + f yz + g x + h y + i z + j of (point - origin) / scale.
void quadric_misfits(const LabelImage& image, const double* points, int threads, const double* origins,
                     const double* scales, const double* quadrics, const double* floors, double* misfits);

}  // namespace rangeedge
