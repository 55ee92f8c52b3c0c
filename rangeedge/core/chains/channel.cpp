// SPDX-License-Identifier: Apache-2.0
#include "chains/channel.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace rangeedge {
namespace {

constexpr int rounds = 3;
constexpr double farthest = 3;  // root mean squares that a sample may lie off to be used in the next round
constexpr double part_deviations = 4;
constexpr double least_share = 0.5;          // of the samples of a part, that lie on the line
constexpr std::ptrdiff_t least_series = 10;  // parts, of whose order one can tell anything
constexpr double least_roughness = 0.5;      // of residuals in no order: 2, von Neumann's ratio
constexpr int part_samples = 24, most_parts = 24;

// One pass of least squares over the samples not farther than `most` off the last fit.
AffineFit weighted_fit(const Array<ChannelSample>& samples, const AffineFit& last, double most, double& rms) {
    double w = 0, t = 0, v = 0;
    const auto used = [&](const ChannelSample& s) { return std::abs(s.value - last.at(s.position)) <= most; };
    for (const ChannelSample& s : samples)
        if (used(s)) w += s.weight, t += s.weight * s.position, v += s.weight * s.value;
    if (!(w > 0)) return last;
    AffineFit fit{t / w, v / w, 0, false};
    double tt = 0, tv = 0, vv = 0;
    for (const ChannelSample& s : samples) {
        if (!used(s)) continue;
        const double dt = s.position - fit.centre, dv = s.value - fit.value;
        tt += s.weight * dt * dt, tv += s.weight * dt * dv, vv += s.weight * dv * dv;
    }
    if (tt > 0) fit.slope = tv / tt;
    rms = std::sqrt(std::max(vv - fit.slope * tv, 0.0) / w);
    return fit;
}

// Whether the mean residual of every part is as small as the scatter in the parts lets one expect, or if the noise goes
// beyond parts, at least no bend: the residuals of neighbouring parts are hardly more alike than those of others.
bool all_parts_fit(const Array<ChannelSample>& samples, const AffineFit& fit, double most, double allowed) {
    const std::ptrdiff_t n = samples.size();
    const std::ptrdiff_t parts = std::min<std::ptrdiff_t>(std::max<std::ptrdiff_t>(n / part_samples, 2), most_parts);
    Array<double> means(parts, 0), weights(parts, 0);
    double within = 0, total = 0;
    for (std::ptrdiff_t i = 0; i < parts; ++i) {
        double w = 0, r = 0, rr = 0, whole = 0;
        for (std::ptrdiff_t k = n * i / parts; k < n * (i + 1) / parts; ++k) {
            const ChannelSample& s = samples[k];
            const double residual = s.value - fit.at(s.position);
            whole += s.weight;
            if (std::abs(residual) > most) continue;
            w += s.weight, r += s.weight * residual, rr += s.weight * residual * residual;
        }
        if (!(w > least_share * whole)) return false;
        means[i] = r / w, weights[i] = w;
        within += rr - r * r / w, total += w;
    }
    const double mean_weight = total / static_cast<double>(n), variance = std::max(within, 0.0) / total;
    bool small = true;
    double squares = 0, differences = 0;
    for (std::ptrdiff_t i = 0; i < parts; ++i) {
        small &= std::abs(means[i]) <= allowed + part_deviations * std::sqrt(variance * mean_weight / weights[i]);
        squares += means[i] * means[i];
        if (i > 0) differences += (means[i] - means[i - 1]) * (means[i] - means[i - 1]);
    }
    return small || (parts >= least_series && differences > least_roughness * squares);
}

// The value at 0 of the parabola with these moments of t^0..t^4 and of v t^0..t^2, a line or constant where too few.
double parabola_at(double x, const double s[5], const double r[3], int places) {
    if (!(s[0] > 0)) return std::numeric_limits<double>::quiet_NaN();
    const double m = s[1] / s[0], n1 = s[2] - m * s[1];
    double value = r[0] / s[0];
    if (places < 2 || !(n1 > 0)) return value;
    value += (r[1] - m * r[0]) / n1 * (x - m);
    const double a = (s[3] - m * s[2]) / n1, b = s[2] / s[0] - a * m, n2 = s[4] - a * s[3] - b * s[2];
    if (places < 5 || !(n2 > 0)) return value;
    return value + (r[2] - a * r[1] - b * r[0]) / n2 * (x * x - a * x - b);
}

}  // namespace

AffineFit fit_affine(const Array<ChannelSample>& samples, double allowed) {
    double rms = 0, most = HUGE_VAL;
    AffineFit fit{};
    for (int round = 0; round < rounds; ++round) {
        fit = weighted_fit(samples, fit, most, rms);
        most = std::max(farthest * rms, allowed);
    }
    fit.fits = all_parts_fit(samples, fit, most, allowed);
    return fit;
}

void smooth_parabolas(const Array<ChannelSample>& samples, std::ptrdiff_t places, bool closed, int reach,
                      Array<double>& values) {
    // A closed chain goes on beyond its ends.
    const std::ptrdiff_t beyond = closed ? reach : 0, size = places + 2 * beyond;
    Array<double> weights(size, 0), sums(size, 0);
    for (const ChannelSample& s : samples) {
        weights[s.place + beyond] += s.weight, sums[s.place + beyond] += s.weight * s.value;
    }
    for (std::ptrdiff_t k = 0; k < beyond; ++k) {
        const std::ptrdiff_t last = beyond + (places - 1 - k % places), first = beyond + k % places;
        weights[beyond - 1 - k] = weights[last], sums[beyond - 1 - k] = sums[last];
        weights[beyond + places + k] = weights[first], sums[beyond + places + k] = sums[first];
    }
    Array<std::int32_t> known(size + 1, 0);  // places before each of which something is known
    for (std::ptrdiff_t k = 0; k < size; ++k) known[k + 1] = known[k] + (weights[k] > 0);
    values.assign(places, 0);
    double reference = 0;  // differences from which keep their digits
    for (std::ptrdiff_t k = 0; k < places; ++k) {
        const std::ptrdiff_t centre = k + beyond;
        const std::ptrdiff_t first = std::max<std::ptrdiff_t>(std::min(centre - reach, size - 1 - 2 * reach), 0);
        const std::ptrdiff_t last = std::min<std::ptrdiff_t>(first + 2 * reach, size - 1);
        if (weights[centre] > 0) reference = sums[centre] / weights[centre];
        double s[5] = {}, r[3] = {};
        for (std::ptrdiff_t j = first; j <= last; ++j) {
            const double t = static_cast<double>(j - centre), w = weights[j], v = sums[j] - reference * w;
            const double wt = w * t, wtt = wt * t;
            s[0] += w, s[1] += wt, s[2] += wtt, s[3] += wtt * t, s[4] += wtt * (t * t);
            r[0] += v, r[1] += v * t, r[2] += v * (t * t);
        }
        values[k] = reference + parabola_at(0, s, r, known[last + 1] - known[first]);
    }
}

}  // namespace rangeedge
