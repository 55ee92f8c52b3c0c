// Edge candidates of a range image from its scan lines, and their combination (paper, sections 4.1 and 4.2).
// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <vector>

namespace rangeedge {

// How pixels become samples of a plane curve (s, r). The ordinate y grows toward the viewer: inverse depth where
// `projective`, else height or negative depth. NaN marks an invalid pixel.
template <class T>
struct RangeImage {
    int rows, cols;
    const T* ordinate;    // (rows, cols), or null where `points` is given
    const T* points;      // (rows, cols, 3) in the camera frame, or null
    bool projective;      // rays from one point; else parallel to `axis`
    double to_plane[6];   // pixel (u, v, 1) to normalised image coordinates, or to lengths on the grid
    double axis[3];       // viewing direction of `points`
};

// Standard deviation of a length z: a + b z + c z^2, or given for every pixel.
struct Noise {
    double a, b, c;
    const float* map;  // (rows, cols) or null
};

struct Parameters {
    double eps;               // tolerance as a length; 0: `eps_factor` times the noise
    double eps_factor;
    int directions;
    bool interpolate;         // FIT_INTERP
    bool endpoint;            // MEASURE_ENDPOINT
    double max_shift;         // samples
    int max_gap;              // samples
    double min_significance;
    int threads;
};

// One cut of one scan line. Pixels are linear indices; slopes are per unit of the plane's abscissa.
struct Candidate {
    float x, y;
    float jump, crease;
    float significance;
    std::uint8_t kind, direction, unused[2];
    std::int32_t before, after;
    float value_before, value_after, slope_before, slope_after;
    float slope_variance_before, slope_variance_after;
};

// All candidates, direction by direction, line by line; the same for any number of threads.
template <class T>
std::vector<Candidate> detect(const RangeImage<T>& image, const Noise& noise, const Parameters& parameters);

// Largest strengths per pixel; the kind of a crease comes with its largest angle. The outputs have `size` pixels.
void combine_maximum(const std::vector<Candidate>& candidates, std::int64_t size, float* jump, float* crease,
                     std::uint8_t* kind, float* significance);

}  // namespace rangeedge
