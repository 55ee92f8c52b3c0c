// SPDX-License-Identifier: Apache-2.0
#include "chains/corners.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "base/angle.hpp"
#include "chains/line_sums.hpp"

namespace rangeedge {
namespace {

constexpr int least_arm = 6, arms[] = {least_arm, 12, 24, 48};  // positions on either side of a corner
constexpr int least_side_arm = 12;                              // in a side view, whose noise is alike over some pixels
constexpr int least_run = 4;                                    // positions that make a line
// Variance ratio of a smooth curve and two lines: to look closer, and of a corner between its neighbours.
constexpr double possible_gain = 8, least_gain = 20;
constexpr double most_alike_positions = 0.9, most_alike_depths = 0.97;  // correlation of neighbouring residuals
constexpr std::ptrdiff_t longest_arm = 96;                              // positions on either side

// The sum of squared residuals of a parabola over the chord.
double parabola_rss(const Point* p, int n) {
    const double cx = p[n - 1].x - p[0].x, cy = p[n - 1].y - p[0].y, length = std::hypot(cx, cy);
    if (!(length > 0)) return HUGE_VAL;
    double s[5] = {}, r[3] = {}, rr = 0;
    for (int k = 0; k < n; ++k) {
        const double dx = p[k].x - p[0].x, dy = p[k].y - p[0].y;
        const double t = 2 * (dx * cx + dy * cy) / (length * length) - 1, v = (dy * cx - dx * cy) / length;
        double power = 1;
        for (int i = 0; i < 5; ++i) {
            s[i] += power;
            if (i < 3) r[i] += power * v;
            power *= t;
        }
        rr += v * v;
    }
    // Orthogonal polynomials 1, t - m, t^2 - a t - b.
    const double m = s[1] / s[0];
    const double n1 = s[2] - m * s[1];
    if (!(n1 > 0)) return HUGE_VAL;
    const double a = (s[3] - m * s[2]) / n1, b = s[2] / s[0] - a * m;
    const double n2 = s[4] - a * s[3] - b * s[2], c2 = r[2] - a * r[1] - b * r[0], c1 = r[1] - m * r[0];
    return std::max(rr - r[0] * r[0] / s[0] - c1 * c1 / n1 - (n2 > 0 ? c2 * c2 / n2 : 0), 0.0);
}

// The sum of squared residuals of the circle x^2 + y^2 = a x + b y + c with the least sum of squared errors of that.
double circle_rss(const Point* p, int n) {
    double mx = 0, my = 0;
    for (int k = 0; k < n; ++k) mx += p[k].x / n, my += p[k].y / n;
    double xx = 0, xy = 0, yy = 0, xq = 0, yq = 0, q = 0;
    for (int k = 0; k < n; ++k) {
        const double x = p[k].x - mx, y = p[k].y - my, square = x * x + y * y;
        xx += x * x, xy += x * y, yy += y * y, xq += x * square, yq += y * square, q += square;
    }
    const double determinant = xx * yy - xy * xy;
    if (!(determinant > 1e-9 * (xx + yy) * (xx + yy))) return HUGE_VAL;
    const double cx = (yy * xq - xy * yq) / determinant / 2, cy = (xx * yq - xy * xq) / determinant / 2;
    const double radius = std::sqrt(q / n + cx * cx + cy * cy);
    double rss = 0;
    for (int k = 0; k < n; ++k) {
        const double x = p[k].x - mx - cx, y = p[k].y - my - cy, off = std::sqrt(x * x + y * y) - radius;
        rss += off * off;
    }
    return rss;
}

// The sum of squared residuals of the ordinates of a polynomial of third degree.
double cubic_rss(const Point* p, int n) {
    constexpr int terms = 4;
    const double middle = (p[0].x + p[n - 1].x) / 2, half = std::abs(p[n - 1].x - p[0].x) / 2;
    if (!(half > 0)) return HUGE_VAL;
    double moments[2 * terms - 1] = {}, products[terms] = {}, rest = 0;
    for (int k = 0; k < n; ++k) {
        const double t = (p[k].x - middle) / half, v = p[k].y - p[0].y;
        double power = 1;
        for (int i = 0; i < 2 * terms - 1; ++i, power *= t) {
            moments[i] += power;
            if (i < terms) products[i] += power * v;
        }
        rest += v * v;
    }
    // Cholesky factors; what each of them explains is taken off.
    double factor[terms][terms], explained[terms];
    for (int i = 0; i < terms; ++i) {
        for (int j = 0; j <= i; ++j) {
            double sum = moments[i + j];
            for (int k = 0; k < j; ++k) sum -= factor[i][k] * factor[j][k];
            if (i != j)
                factor[i][j] = sum / factor[j][j];
            else if (sum > 1e-12 * moments[2 * i])
                factor[i][i] = std::sqrt(sum);
            else
                return std::max(rest, 0.0);
        }
        explained[i] = products[i];
        for (int k = 0; k < i; ++k) explained[i] -= factor[i][k] * explained[k];
        explained[i] /= factor[i][i];
        rest -= explained[i] * explained[i];
    }
    return std::max(rest, 0.0);
}

// That of the smooth curve that fits better, a parabola or, where the points turn far, a circle; from the side a
// polynomial.
double smooth_rss(const Point* p, int n, View view) {
    return view == View::side ? cubic_rss(p, n) : std::min(parabola_rss(p, n), circle_rss(p, n));
}

struct TwoLines {
    double rss, turn;    // turn in degrees
    double correlation;  // of neighbouring residuals
};

// Straight lines through the points before number `split` and through those after it.
TwoLines two_lines(const Point* p, int n, int split, double most_alike) {
    PointSums before, after;
    for (int k = 0; k < split; ++k) before.add(p[k].x - p[split].x, p[k].y - p[split].y);
    for (int k = split + 1; k < n; ++k) after.add(p[k].x - p[split].x, p[k].y - p[split].y);
    const StraightLine a = before.line(p[split].x - p[0].x, p[split].y - p[0].y);
    const StraightLine b = after.line(p[n - 1].x - p[split].x, p[n - 1].y - p[split].y);
    const double turn = std::atan2(std::abs(a.dx * b.dy - a.dy * b.dx), a.dx * b.dx + a.dy * b.dy);
    double products = 0, last = 0;
    for (int k = 0; k < n; ++k) {
        const double off = (k < split ? a : b).off(p[k].x - p[split].x, p[k].y - p[split].y);
        if (k > 0 && k != split && k != split + 1) products += off * last;
        last = off;
    }
    const double rss = a.rss + b.rss;
    return {rss, turn * degrees_per_radian, rss > 0 ? std::min(std::max(products / rss, 0.0), most_alike) : 0};
}

// The positions along a piece, and the corners among them.
class Corners {
public:
    Corners(const Array<Point>& points, bool closed, double least_angle, View view)
        : points_(points), closed_(closed), least_angle_(least_angle), view_(view) {}

    // Numbers of the points at corners, ascending.
    Array<std::ptrdiff_t> find() {
        for (const int arm : arms)
            if (view_ == View::image || arm >= least_side_arm) look(arm);
        std::sort(found_.begin(), found_.end());
        confirm();
        complete();
        return found_;
    }

private:
    std::ptrdiff_t size() const { return points_.size(); }
    // Around a closed chain, once.
    const Point& at(std::ptrdiff_t i) const { return points_[i < 0 ? i + size() : i < size() ? i : i - size()]; }

    int run() const { return view_ == View::side ? least_side_arm : least_run; }
    double most_alike() const { return view_ == View::side ? most_alike_depths : most_alike_positions; }

    // By how much two lines are better than a smooth curve; 0 where they turn too little.
    double gain(const TwoLines& lines, int n) const {
        if (lines.turn < least_angle_) return 0;
        constexpr double rounding = 1e-4;  // squared pixels a point, so that positions without noise have some
        const double independent = (1 - lines.correlation) / (1 + lines.correlation);  // share of the points
        const double scatter = (lines.rss + rounding * n) / (n - 4) / independent;
        return (smooth_rss(window_.data(), n, view_) - lines.rss) / scatter;
    }

    // That of the i-th corner, from the one before to the one after, between which it is moved to the best place.
    double confirmed_gain(std::ptrdiff_t i) {
        const std::ptrdiff_t count = found_.size(), corner = found_[i];
        // Those so close that they are hardly apart are no witnesses.
        std::ptrdiff_t first = closed_ ? corner - size() : 0, last = closed_ ? corner + size() : size() - 1;
        for (std::ptrdiff_t k = 1; k < count; ++k) {
            const std::ptrdiff_t before = i >= k ? found_[i - k] : closed_ ? found_[i - k + count] - size() : 0;
            const std::ptrdiff_t after = i + k < count ? found_[i + k]
                                         : closed_     ? found_[i + k - count] + size()
                                                       : size() - 1;
            if (corner - before > least_run) first = std::max(first, before);
            if (after - corner > least_run) last = std::min(last, after);
        }
        first = std::max(first, corner - longest_arm), last = std::min(last, corner + longest_arm);
        window_.clear();
        for (std::ptrdiff_t k = first; k <= last; ++k) window_.push_back(at(k));
        const int split = best_split();
        if (split < 0) return 0;
        found_[i] = (first + split + size()) % size();
        const int n = static_cast<int>(window_.size());
        return gain(two_lines(window_.data(), n, split, most_alike()), n);
    }

    // Where two lines through the points of the window leave the least; -1 where they are too few.
    int best_split() {
        const int n = static_cast<int>(window_.size());
        sums_.assign(n + 1, {});
        for (int k = 0; k < n; ++k) {
            sums_[k + 1] = sums_[k];
            sums_[k + 1].add(window_[k].x - window_[0].x, window_[k].y - window_[0].y);
        }
        int best = -1;
        double least = HUGE_VAL;
        for (int split = run(); split < n - run(); ++split) {
            const double rss = sums_[split].rss() + sums_[n].without(sums_[split + 1]).rss();
            if (rss < least) least = rss, best = split;
        }
        return best;
    }

    // Takes back corner after corner, the least first, while the lines between the others tell of none there.
    void confirm() {
        Array<double> gains(found_.size(), 0);
        for (std::ptrdiff_t i = 0; i < found_.size(); ++i) gains[i] = confirmed_gain(i);
        while (!found_.empty()) {
            const std::ptrdiff_t weakest = std::min_element(gains.begin(), gains.end()) - gains.begin();
            if (gains[weakest] >= least_gain) break;
            std::copy(gains.begin() + weakest + 1, gains.end(), gains.begin() + weakest);
            std::copy(found_.begin() + weakest + 1, found_.end(), found_.begin() + weakest);
            const std::ptrdiff_t count = found_.size() - 1;
            gains.resize(count), found_.resize(count);
            if (!count) break;
            const std::ptrdiff_t before = (weakest + count - 1) % count, after = weakest % count;
            gains[before] = confirmed_gain(before);
            if (after != before) gains[after] = confirmed_gain(after);
        }
        std::sort(found_.begin(), found_.end());  // of a closed chain one may have moved past its first point
    }

    // Adds corners between those found and the ends, of which a longer stretch tells than what `look` has looked at.
    void complete() {
        Array<std::ptrdiff_t> ends;
        if (!closed_) ends.push_back(0);
        for (const std::ptrdiff_t corner : found_) ends.push_back(corner);
        if (!closed_) ends.push_back(size() - 1);
        for (std::ptrdiff_t i = 0; i + 1 < ends.size(); ++i) complete(ends[i], ends[i + 1]);
        std::sort(found_.begin(), found_.end());
    }

    void complete(std::ptrdiff_t first, std::ptrdiff_t last) {
        if (view_ == View::side && last - first > 2 * longest_arm) return;  // depths around a curve turn, too
        window_.clear();
        for (std::ptrdiff_t k = first; k <= last; ++k) window_.push_back(at(k));
        const int split = best_split(), n = static_cast<int>(window_.size());
        if (split < 0 || gain(two_lines(window_.data(), n, split, most_alike()), n) < least_gain) return;
        found_.push_back(first + split);
        complete(first, first + split), complete(first + split, last);
    }

    // Places before and after one, on an open chain fewer at its ends.
    int before(std::ptrdiff_t i, int arm) const {
        return closed_ ? arm : static_cast<int>(std::min<std::ptrdiff_t>(arm, i));
    }
    int after(std::ptrdiff_t i, int arm) const {
        return closed_ ? arm : static_cast<int>(std::min<std::ptrdiff_t>(arm, size() - 1 - i));
    }

    // 1 less the cosine of the angle by which chords turn.
    double chord_turn(std::ptrdiff_t i, int arm) const {
        const Point &a = at(i - before(i, arm)), &b = at(i), &c = at(i + after(i, arm));
        const double ux = b.x - a.x, uy = b.y - a.y, vx = c.x - b.x, vy = c.y - b.y;
        const double squares = (ux * ux + uy * uy) * (vx * vx + vy * vy);
        return squares > 0 ? 1 - (ux * vx + uy * vy) / std::sqrt(squares) : 0;
    }

    void look(int arm) {
        const std::ptrdiff_t first = closed_ ? 0 : least_arm, end = closed_ ? size() : size() - least_arm;
        if (end <= first || size() < 2 * arm + 2) return;
        const double least = 1 - std::cos(least_angle_ / 2 / degrees_per_radian);
        turns_.assign(size(), 0);
        for (std::ptrdiff_t i = first; i < end; ++i) turns_[i] = chord_turn(i, arm);
        for (std::ptrdiff_t i = first; i < end; ++i) {
            if (turns_[i] < least) continue;
            bool largest = true;
            for (int k = 1; largest && k <= arm / 2; ++k) {
                const std::ptrdiff_t left = (i - k + size()) % size(), right = (i + k) % size();
                largest &= turns_[left] < turns_[i] && turns_[right] <= turns_[i];
            }
            if (largest) test(i, arm);
        }
    }

    void test(std::ptrdiff_t i, int arm) {
        const int left = before(i, arm), right = after(i, arm), n = left + right + 1;
        window_.clear();
        for (int k = -left; k <= right; ++k) window_.push_back(at(i + k));
        const int best = best_split();
        if (best < 0) return;
        const TwoLines lines = two_lines(window_.data(), n, best, most_alike());
        if (gain(lines, n) < possible_gain) return;
        const std::ptrdiff_t corner = (i + best - left + size()) % size();
        for (const std::ptrdiff_t other : found_) {
            const std::ptrdiff_t distance = std::abs(other - corner);
            if (std::min(distance, closed_ ? size() - distance : distance) <= arm / 2 + 1) return;
        }
        found_.push_back(corner);
    }

    const Array<Point>& points_;
    bool closed_;
    double least_angle_;
    View view_;
    Array<double> turns_;
    Array<Point> window_;
    Array<PointSums> sums_;
    Array<std::ptrdiff_t> found_;
};

}  // namespace

Array<std::ptrdiff_t> find_corners(const Array<Point>& points, bool closed, double least_angle, View view) {
    return Corners(points, closed, least_angle, view).find();
}

}  // namespace rangeedge
