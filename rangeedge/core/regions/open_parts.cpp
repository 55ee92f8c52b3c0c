// SPDX-License-Identifier: Apache-2.0
#include "regions/open_parts.hpp"

#include <algorithm>
#include <cstddef>
#include <map>

#include "base/watch.hpp"

namespace rangeedge {
namespace {

constexpr int line_width = 2;  // pixels around that belong to the same part, unless that is a line

}  // namespace

OpenParts::OpenParts(const SurfaceImage& image, const std::int32_t* regions) : image_(image) {
    part_.resize(image.size(), 0);
    marked_.resize(image.size(), 0);
    Pixels front;
    for (int row = 0; row < image.rows(); ++row) {
        Watch::checkpoint();
        for (int col = 0; col < image.cols(); ++col) {
            const int p = image.index(row, col);
            if (!image.open(p)) continue;
            part_[p] = regions[std::ptrdiff_t{row} * image.cols() + col];
            if (part_[p]) front.push_back(p);
        }
    }
    spread(std::move(front));
    number();
}

// To open pixels of no part, a pixel at a time.
void OpenParts::spread(Pixels front) {
    Pixels next;
    Checkpoints checkpoints;
    for (; !front.empty(); front.swap(next), next.clear())
        for (const int p : front) {
            checkpoints.pass();
            for (const int step : image_.neighbours())
                if (image_.open(p + step) && !part_[p + step]) part_[p + step] = part_[p], next.push_back(p + step);
        }
}

// Connected pixels of one number get a number of their own, in raster order.
void OpenParts::number() {
    Array<int> before;
    before.swap(part_);
    part_.assign(before.size(), 0);
    pixels_.assign(1, {});
    Checkpoints checkpoints;
    for (int row = 0; row < image_.rows(); ++row) {
        Watch::checkpoint();
        for (int first = image_.index(row, 0), end = first + image_.cols(), start = first; start < end; ++start) {
            if (!before[start] || part_[start]) continue;
            pixels_.emplace_back(1, start);
            Pixels& pixels = pixels_.back();
            const int number = static_cast<int>(pixels_.size()) - 1;
            part_[start] = number;
            for (std::size_t i = 0; i < pixels.size(); ++i) {
                checkpoints.pass();
                for (const int step : image_.neighbours()) {
                    const int q = pixels[i] + step;
                    if (before[q] != before[start] || part_[q]) continue;
                    part_[q] = number, pixels.push_back(q);
                }
            }
        }
    }
    count_ = static_cast<int>(pixels_.size()) - 1;
}

// Whether not all pixels around one belong to its part.
bool OpenParts::thin(int p) const {
    for (int row = -line_width; row <= line_width; ++row)
        for (int col = -line_width; col <= line_width; ++col) {
            const int q = p + row * image_.stride() + col;
            if (q < 0 || q >= image_.size() || part_[q] != part_[p]) return true;
        }
    return false;
}

void OpenParts::absorb_slivers(int min_area) {
    for (bool changed = true; changed;) {
        changed = false;
        number();
        Array<int> to(count_ + 1, 0);
        Checkpoints checkpoints;
        const auto is_thin = [&](int p) {
            checkpoints.pass();
            return thin(p);
        };
        std::vector<std::map<int, int>> contacts(static_cast<std::size_t>(count_) + 1);
        for (int i = 1; i <= count_; ++i) {
            const Pixels& own = pixels_[static_cast<std::size_t>(i)];
            const bool small = static_cast<int>(own.size()) < min_area;
            if (!small && !std::all_of(own.begin(), own.end(), is_thin)) continue;
            for (const int p : own) {
                checkpoints.pass();
                for (const int step : image_.neighbours())
                    if (part_[p + step] && part_[p + step] != i)
                        ++contacts[static_cast<std::size_t>(i)][part_[p + step]];
            }
            int most = 0;
            for (const auto& [other, count] : contacts[static_cast<std::size_t>(i)]) {
                // Of two slivers the smaller falls to the other.
                const auto size = [&](int k) { return std::make_pair(pixels_[static_cast<std::size_t>(k)].size(), k); };
                if (count > most && size(other) > size(i)) most = count, to[i] = other;
            }
            changed = changed || to[i];
        }
        for (int i = 1; i <= count_; ++i) {
            int end = i;
            while (to[end]) end = to[end];
            if (end != i)
                for (const int p : pixels_[static_cast<std::size_t>(i)]) part_[p] = end;
        }
    }
}

void OpenParts::trim_spurs() {
    Checkpoints checkpoints;
    const auto around = [&](int p, auto&& visit) {
        checkpoints.pass();
        for (int row = -line_width; row <= line_width; ++row)
            for (int col = -line_width; col <= line_width; ++col) {
                const int q = p + row * image_.stride() + col;
                if (q >= 0 && q < image_.size()) visit(q);
            }
    };
    // What no pixel of another part is near, and what is near that.
    Pixels beside, inside, rest;
    for (const OpenBorder& border : borders()) beside.insert(beside.end(), border.pixels.begin(), border.pixels.end());
    for (const int p : beside)
        around(p, [&](int q) {
            if (part_[q] && !marked_[q]) marked_[q] = 1, rest.push_back(q);
        });
    const std::size_t near = rest.size();
    for (const int p : rest) {
        bool own = true;
        around(p, [&](int q) { own = own && (!part_[q] || part_[q] == part_[p]); });
        if (own) inside.push_back(p);
    }
    for (std::size_t i = 0; i < near; ++i)
        around(rest[i], [&](int q) {
            if (part_[q] && part_[q] == part_[rest[i]] && !marked_[q]) inside.push_back(q);
        });
    for (const int p : inside)
        around(p, [&](int q) {
            if (part_[q] == part_[p] && marked_[q] == 1) marked_[q] = 2;
        });
    Pixels front;
    for (const int p : rest) {
        if (marked_[p] == 1)
            part_[p] = 0;
        else
            front.push_back(p);
        marked_[p] = 0;
    }
    spread(std::move(front));
    number();
}

std::vector<OpenBorder> OpenParts::borders() const {
    std::map<std::pair<int, int>, Pixels> found;
    for (int row = 0; row < image_.rows(); ++row) {
        Watch::checkpoint();
        for (int p = image_.index(row, 0), end = p + image_.cols(); p < end; ++p)
            for (const int step : image_.neighbours()) {
                const int a = part_[p], b = part_[p + step];
                if (!a || !b || a == b) continue;
                Pixels& pixels = found[{std::min(a, b), std::max(a, b)}];
                if (pixels.empty() || pixels.back() != p) pixels.push_back(p);
            }
    }
    std::vector<OpenBorder> result;
    for (auto& [pair, pixels] : found) result.push_back({pair.first, pair.second, std::move(pixels)});
    return result;
}

std::vector<std::pair<int, int>> OpenParts::near(const OpenBorder& border, int reach) {
    std::vector<std::pair<int, int>> found;
    // Pixels that have gone to a third part since are not theirs.
    for (const int p : border.pixels)
        if (part_[p] == border.first || part_[p] == border.second) marked_[p] = 1, found.emplace_back(p, 0);
    for (std::size_t i = 0; i < found.size(); ++i) {
        const auto [p, distance] = found[i];
        if (distance == reach) break;
        for (const int step : image_.neighbours()) {
            const int q = p + step;
            if (marked_[q] || (part_[q] != border.first && part_[q] != border.second)) continue;
            marked_[q] = 1, found.emplace_back(q, distance + 1);
        }
    }
    for (const auto& [p, distance] : found) marked_[p] = 0;
    return found;
}

std::vector<Pixels> OpenParts::lines(const OpenBorder& border) {
    const auto is_other = [&](int p, int q) {
        return part_[q] != part_[p] && (part_[q] == border.first || part_[q] == border.second);
    };
    Pixels line;
    for (const int p : border.pixels)
        if (is_other(p, p + 1) || is_other(p, p + image_.stride())) marked_[p] = 1, line.push_back(p);
    std::vector<Pixels> lines;
    for (const int start : line) {
        if (!marked_[start]) continue;
        marked_[start] = 0;
        Pixels pixels{start};
        for (std::size_t i = 0; i < pixels.size(); ++i)
            for (int row = -1; row <= 1; ++row)
                for (int col = -1; col <= 1; ++col) {
                    const int q = pixels[i] + row * image_.stride() + col;
                    if (marked_[q]) marked_[q] = 0, pixels.push_back(q);
                }
        lines.push_back(std::move(pixels));
    }
    return lines;
}

}  // namespace rangeedge
