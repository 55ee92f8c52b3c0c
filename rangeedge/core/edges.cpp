// SPDX-License-Identifier: Apache-2.0
#include "edges.hpp"

#include <algorithm>

#include "fit.hpp"
#include "line.hpp"
#include "parallel.hpp"
#include "scanline.hpp"

namespace rangeedge {
namespace {

constexpr double degrees = 57.295779513082320877;
constexpr double curved_significance = 4;  // of the quadratic term of a least-squares fit
enum Kind : std::uint8_t { jump_bit = 1, convex_bit = 2, concave_bit = 4, occluding_bit = 8, occluded_bit = 16 };

// What one thread needs to work through its lines.
template <class T>
struct Scratch {
    Line<T> line;
    std::vector<Segment> pending, segments;
    std::vector<Curve> curves;
};

// Where two curves meet, relative to the cut between samples `before` and `before + 1`.
struct Cut {
    int before, after;   // the samples on either side
    double abscissa;
    double sample;       // the same place, counted in samples
    bool meeting;        // the curves meet here: no jump
};

template <class T>
class LineDetector {
public:
    LineDetector(const RangeImage<T>& image, const Noise& noise, const Parameters& parameters, int direction)
        : image_(image), parameters_(parameters), reader_(image, noise, parameters), direction_(direction) {}

    void detect(const Path& path, Scratch<T>& s, std::vector<Candidate>& candidates) const {
        reader_.read(path, s.line);
        split(s);           // P 4.1
        fit(s);             // P 4.2, end
        for (std::size_t i = 0; i + 1 < s.segments.size(); ++i) {
            if (s.segments[i + 1].first - s.segments[i].last - 1 > parameters_.max_gap) continue;
            const Cut cut = place(s, i);                          // P 4.2, Fig. 5
            const Candidate candidate = measure(s, i, cut);       // P 4.2, Fig. 4
            if (candidate.kind) candidates.push_back(candidate);
        }
    }

private:
    void split(Scratch<T>& s) const {
        const Line<T>& line = s.line;
        const T* x = line.irregular ? line.x.data() : nullptr;
        const T* scale = line.scaled ? line.scale.data() : nullptr;
        s.segments.clear();
        for_each_run(line.y.data(), x, line.path.size, [&](int first, int last) {
            split_run(Run<T>{line.y.data(), x, scale, first, last}, static_cast<T>(line.tolerance), s.pending, s.segments);
        });
    }

    void fit(Scratch<T>& s) const {
        s.curves.clear();
        for (const Segment& segment : s.segments) s.curves.push_back(fit_segment(s.line, segment));
    }

    Curve fit_segment(const Line<T>& line, const Segment& segment) const {
        const int middle = segment.first + (segment.last - segment.first) / 2;
        Moments moments;
        moments.origin = line.abscissa(middle);
        moments.base = line.ordinate(middle);
        if (!parameters_.interpolate) {
            for (int k = segment.first; k <= segment.last; ++k) moments.add(line.abscissa(k), line.ordinate(k));
            return fit_least_squares(moments, sigma(line, middle), curved_significance);
        }
        int added = segment.first - 1;
        for (const int k : {segment.first, middle, segment.last}) {
            if (k > added) moments.add(line.abscissa(k), line.ordinate(k));
            added = k;
        }
        return fit_interpolating(moments);
    }

    double sigma(const Line<T>& line, int k) const {
        return reader_.sigma(line.ordinate(k), line.path.pixel(k, image_.cols));
    }

    // The intersection of the two curves nearest the cut becomes the edge position if it is within reach and the
    // samples it passes over fit the curve to which they then belong.
    Cut place(const Scratch<T>& s, std::size_t i) const {
        const Line<T>& line = s.line;
        const Segment &left = s.segments[i], &right = s.segments[i + 1];
        const double xa = line.abscissa(left.last), xb = line.abscissa(right.first);
        const double middle = (xa + xb) / 2;
        const Cut split{left.last, right.first, middle, (left.last + right.first) / 2.0, false};
        double x = 0;
        if (!(parameters_.max_shift > 0) || !intersection(s.curves[i], s.curves[i + 1], middle, x)) return split;
        if (x >= xa && x <= xb)
            return {left.last, right.first, x, left.last + (right.first - left.last) * (x - xa) / (xb - xa), true};
        const bool leftward = x < xa;
        const Curve& other = s.curves[leftward ? i + 1 : i];
        const Segment& passed = leftward ? left : right;
        for (int k = leftward ? left.last : right.first; k >= passed.first && k <= passed.last; k += leftward ? -1 : 1) {
            if (std::abs(k - split.sample) > parameters_.max_shift + 0.5) return split;
            const double at = line.abscissa(k);
            if (leftward ? at < x : at > x) {  // between this sample and the one before it
                const int before = leftward ? k : k - 1;
                const double xc = line.abscissa(before), xd = line.abscissa(before + 1);
                const double sample = before + (x - xc) / (xd - xc);
                if (std::abs(sample - split.sample) > parameters_.max_shift) return split;
                return {before, before + 1, x, sample, true};
            }
            if (std::abs(line.ordinate(k) - other.value(at)) > tolerance(line, k)) return split;
        }
        return split;
    }

    double tolerance(const Line<T>& line, int k) const {
        return line.scaled ? 1 / static_cast<double>(line.scale[static_cast<std::size_t>(k)]) : line.tolerance;
    }

    static bool intersection(const Curve& f, const Curve& g, double near, double& x) {
        // The difference as a quadratic in t = x - near.
        const double c = f.value(near) - g.value(near), b = f.slope(near) - g.slope(near), a = f.c2 - g.c2;
        const double discriminant = b * b - 4 * a * c;
        if (!(discriminant >= 0)) return false;
        const double denominator = std::abs(b) + std::sqrt(discriminant);  // the root of smaller magnitude
        if (!(denominator > 0)) return false;
        x = near - (b < 0 ? -2 : 2) * c / denominator;
        return std::isfinite(x);
    }

    Candidate measure(const Scratch<T>& s, std::size_t i, const Cut& cut) const {
        const Line<T>& line = s.line;
        const Curve &f = s.curves[i], &g = s.curves[i + 1];
        double xf = cut.abscissa, xg = cut.abscissa;
        double yf = f.value(xf), yg = g.value(xg), vf = f.value_variance(xf), vg = g.value_variance(xg);
        if (parameters_.endpoint) {
            // Extrapolated from either end point by its own slope.
            xf = line.abscissa(cut.before), xg = line.abscissa(cut.after);
            yf = line.ordinate(cut.before) + f.slope(xf) * (cut.abscissa - xf);
            yg = line.ordinate(cut.after) + g.slope(xg) * (cut.abscissa - xg);
        }
        const double mf = f.slope(xf), mg = g.slope(xg);
        const auto tf = line.tangent(xf, parameters_.endpoint ? line.ordinate(cut.before) : yf, mf);
        const auto tg = line.tangent(xg, parameters_.endpoint ? line.ordinate(cut.after) : yg, mg);
        const double cross = tf.s * tg.r - tf.r * tg.s, dot = tf.s * tg.s + tf.r * tg.r;

        const double noise = std::max((sigma(line, cut.before) + sigma(line, cut.after)) / 2, tiny);
        const double turn_f = line.turn(tf, yf), turn_g = line.turn(tg, yg);
        const double slope_vf = f.slope_variance(xf), slope_vg = g.slope_variance(xg);
        double jump = cut.meeting ? 0 : std::abs(line.depth(yf) - line.depth(yg));
        double crease = std::abs(std::atan2(cross, dot)) * degrees;
        double jump_significance = std::abs(yf - yg) / (noise * std::sqrt(vf + vg));
        double crease_significance =
            crease / (degrees * noise * std::sqrt(turn_f * turn_f * slope_vf + turn_g * turn_g * slope_vg));
        if (!std::isfinite(jump) || !(jump_significance >= parameters_.min_significance)) jump = 0;
        if (!std::isfinite(crease) || !(crease_significance >= parameters_.min_significance)) crease = 0;
        if (!(jump > 0)) jump_significance = 0;
        if (!(crease > 0)) crease_significance = 0;

        Candidate c{};
        c.x = static_cast<float>(line.path.col + cut.sample * line.path.dcol);
        c.y = static_cast<float>(line.path.row + cut.sample * line.path.drow);
        c.jump = static_cast<float>(jump);
        c.crease = static_cast<float>(crease);
        c.significance = static_cast<float>(std::min(std::max(jump_significance, crease_significance), 1e30));
        if (jump > 0 && std::abs(yf - yg) > 2 * std::max(tolerance(line, cut.before), tolerance(line, cut.after)))
            c.kind |= static_cast<std::uint8_t>(jump_bit | (yf > yg ? occluding_bit : occluded_bit));
        if (crease > 0) c.kind |= cross > 0 ? convex_bit : concave_bit;
        c.direction = static_cast<std::uint8_t>(direction_);
        c.before = static_cast<std::int32_t>(line.path.pixel(cut.before, image_.cols));
        c.after = static_cast<std::int32_t>(line.path.pixel(cut.after, image_.cols));
        c.value_before = static_cast<float>(yf), c.value_after = static_cast<float>(yg);
        c.slope_before = static_cast<float>(mf / line.step), c.slope_after = static_cast<float>(mg / line.step);
        c.slope_variance_before = static_cast<float>(slope_vf / (line.step * line.step));
        c.slope_variance_after = static_cast<float>(slope_vg / (line.step * line.step));
        return c;
    }

    static constexpr double tiny = 1e-300;

    RangeImage<T> image_;
    Parameters parameters_;
    LineReader<T> reader_;
    int direction_;
};

}  // namespace

template <class T>
std::vector<Candidate> detect(const RangeImage<T>& image, const Noise& noise, const Parameters& parameters) {
    std::vector<Candidate> all;
    const int threads = std::max(1, parameters.threads);
    std::vector<Scratch<T>> scratch(static_cast<std::size_t>(threads));
    std::vector<std::vector<Candidate>> found(static_cast<std::size_t>(threads));
    for (int direction = 1; direction <= 8; direction *= 2) {
        if (!(parameters.directions & direction)) continue;
        const LineDetector<T> detector(image, noise, parameters, direction);
        for (auto& part : found) part.clear();
        parallel_for(line_count(direction, image.rows, image.cols), threads, [&](int begin, int end, int thread) {
            const auto t = static_cast<std::size_t>(thread);
            for (int i = begin; i < end; ++i)
                detector.detect(line_path(direction, i, image.rows, image.cols), scratch[t], found[t]);
        });
        for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
    }
    return all;
}

void combine_maximum(const std::vector<Candidate>& candidates, std::int64_t size, float* jump, float* crease,
                     std::uint8_t* kind, float* significance) {
    std::fill(jump, jump + size, 0.0f);
    std::fill(crease, crease + size, 0.0f);
    std::fill(kind, kind + size, std::uint8_t{0});
    std::fill(significance, significance + size, 0.0f);
    for (const Candidate& c : candidates) {
        const auto creases = static_cast<std::uint8_t>(c.kind & (convex_bit | concave_bit));
        for (const std::int32_t p : {c.before, c.after}) {
            const bool nearer = ((c.kind & occluding_bit) != 0) == (p == c.before);
            const auto jumps = static_cast<std::uint8_t>(!(c.kind & jump_bit) ? 0 : nearer ? jump_bit | occluding_bit : jump_bit | occluded_bit);
            if (c.crease > crease[p]) {
                crease[p] = c.crease;
                kind[p] = static_cast<std::uint8_t>((kind[p] & ~(convex_bit | concave_bit)) | creases);
            }
            jump[p] = std::max(jump[p], c.jump);
            kind[p] = static_cast<std::uint8_t>(kind[p] | jumps);
            significance[p] = std::max(significance[p], c.significance);
        }
    }
}

template std::vector<Candidate> detect(const RangeImage<float>&, const Noise&, const Parameters&);
template std::vector<Candidate> detect(const RangeImage<double>&, const Noise&, const Parameters&);

}  // namespace rangeedge
