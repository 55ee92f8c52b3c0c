// Edges in a buffer of heights, by the C++ core alone: a step of 0.5 in noise of 0.01, seen from above.
#include <rangeedge/edges/combine.hpp>
#include <rangeedge/edges/detect.hpp>
#include <rangeedge/noise/estimate.hpp>

#include <cstdio>
#include <random>
#include <vector>

int main() {
    constexpr int rows = 60, cols = 80;
    std::mt19937 random(1);
    std::normal_distribution<float> noise(0, 0.01f);
    std::vector<float> height(rows * cols);
    for (int i = 0; i < rows * cols; ++i) height[i] = (i % cols < 50 ? 0.5f : 0.0f) + noise(random);

    // The image: heights on a grid of unit spacing, invalid where they are NaN, and its noise.
    rangeedge::Frame<float> frame{rows, cols, height.data(), nullptr, false, {1, 0, 0, 0, 1, 0}, {}, false, false, {}};
    const auto found = rangeedge::estimate_noise(height.data(), rows, cols, false, 0, 1);
    frame.noise = {found.single,
                   found.fits.waves,
                   rangeedge::FitNoise(found.fits.rows),
                   rangeedge::FitNoise(found.fits.cols),
                   rangeedge::FitNoise(found.fits.rows),
                   nullptr};

    // Tolerance 0: `eps_factor` times the noise. All four directions, least squares, jumps and creases beyond 4 sigma.
    const rangeedge::ScanLineOptions options{0, 2.5, 15, false, false, true, 2, 1, 6, true, false, 5, 4};
    rangeedge::Team team(2);
    const auto candidates = rangeedge::find_candidates(frame, options, team);
    std::vector<float> jump(height.size()), crease(height.size()), significance(height.size());
    std::vector<std::uint8_t> kind(height.size());
    rangeedge::combine(candidates, {rows * cols, jump.data(), crease.data(), kind.data(), significance.data()}, team);

    int edges = 0;
    for (int i = 0; i < rows * cols; ++i) edges += jump[i] > 0.25f;
    std::printf("%d pixels on edges, noise %.4f\n", edges, found.single.c0);
}
