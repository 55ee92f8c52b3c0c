// Edge candidates of a range image from its scan lines, and their combination (paper, sections 4.1 and 4.2).
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "geometry.hpp"

namespace rangeedge {

// Standard deviation of a length z: a + b z + c z^2, or given for every pixel.
struct Noise {
    double a, b, c;
    double correlation;  // how much larger it is over a segment than between neighbours
    const float* map;    // (rows, cols) or null
};

// Lengths are in the unit of the image, reaches in samples, significances in standard deviations.
struct Parameters {
    double eps;                 // tolerance as a length; 0: `eps_factor` times the noise
    double eps_factor;
    int directions;             // bits
    bool interpolate;           // curves through end points and midpoint instead of least squares
    bool endpoint;              // strengths extrapolated from either end point
    bool normals;               // crease angles between surface normals
    double max_shift;           // between the cut and the position of the edge
    int max_gap;                // between the ends of two runs that are compared
    int max_smear;              // samples of a smeared step
    bool shadows;               // whether the two sides of a wider gap are compared for outlines
    bool spaced;                // whether the spacing of pixels is known as a length
    double merge_significance;  // below it a cut is taken back
    double min_significance;    // below it a candidate is dropped
    int threads;
};

// Bits of Parameters::directions, one of which is Candidate::direction.
enum Direction : std::uint8_t { rows_bit = 1, cols_bit = 2, diag45_bit = 4, diag135_bit = 8 };

// Bits of Candidate::kind.
enum Kind : std::uint8_t {
    jump_bit = 1,
    convex_bit = 2,
    concave_bit = 4,
    occluding_bit = 8,  // of a candidate: the surface before the cut is the nearer one
    occluded_bit = 16,
    boundary_bit = 32,  // of a pixel
};

constexpr double degrees = 57.295779513082320877;  // in a radian

// The angle between two directions in degrees, from 0 to 180, by their cross and dot products; NaN of none.
inline double degrees_of(double cross, double dot) {
    const double scale = 1 / std::max(std::abs(cross), std::abs(dot));  // lest they leave the range of single precision
    return std::abs(std::atan2(static_cast<float>(cross * scale), static_cast<float>(dot * scale))) * degrees;
}

constexpr float endless = 1e30f;  // at most so large are variances and significances

// One side of a cut: the curve's ordinate there, its slope per unit of the plane and the slope's variance.
struct Side {
    float value, slope, slope_variance;
};

// One cut of one scan line.
struct Candidate {
    float x, y;                  // position in pixels
    float shift;                 // samples that it lies from the cut
    float jump, crease;          // length, degrees
    float significance;          // joined with that of its neighbours
    std::uint8_t kind, direction;
    std::int32_t before, after;  // linear indices of the pixels on either side
    std::int32_t order;          // by direction, then by line, then along the line
    Side sides[2];
    float place[2], along[2];    // position and direction of the line in the plane of the image
};

// All candidates, by their place in the image; the same for any number of threads. `smeared`, unless null, becomes 255
// at pixels over which a step is smeared; it holds zeros before.
template <class T>
std::vector<Candidate> detect(const RangeImage<T>& image, const Noise& noise, const Parameters& parameters,
                              std::uint8_t* smeared = nullptr);

// Brings them into their order along directions and lines.
void put_in_order(std::vector<Candidate>& candidates);

// Largest strengths per pixel; the kind of a crease comes with its largest angle. The outputs hold zeros before.
void combine(const std::vector<Candidate>& candidates, float* jump, float* crease, std::uint8_t* kind,
             float* significance);

}  // namespace rangeedge
