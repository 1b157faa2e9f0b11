// A map and its views as arguments; positions of a pixel in the views, and colours interpolated between their pixels.
#pragma once

#include "matching/kernels/seen_views.hpp"

namespace sepi {

// The views that are compared, with their z-buffers.
struct RimViews {
    std::variant<Array<const std::uint8_t, 4>, Array<const std::uint16_t, 4>, Array<const float, 4>> lines;  // (T, S, H, W C)
    Index channels;
    Array<const float, 1> units;  // (V,)
    SeenViews seen;

    bool fields(auto visit) { return visit(lines, channels, units, seen); }

    Index number() const { return units.shape[0]; }
};

// The surfaces of a map, and their colours in the reference view.
struct Sides {
    Array<const float, 2> disparity;  // (H, W)
    Strided<const float, 3> guide;    // (H, W, 3)
    Array<const bool, 2> clean;       // (H, W)
    Index clean_radius;

    bool fields(auto visit) { return visit(disparity, guide, clean, clean_radius); }

    std::array<float, 3> colour(Index y, Index x) const { return {guide(y, x, 0), guide(y, x, 1), guide(y, x, 2)}; }
};

struct ViewSamples {
    const RimViews &views;
    const Index H = std::visit([](const auto &lines) { return lines.shape[2]; }, views.lines);

    // Position of a pixel of disparity d in a view, if inside, before its last row and column.
    [[gnu::always_inline]] std::optional<Place> place_in(Index view, float d, Index y, Index x) const {
        const double down = double(y) - d * views.seen.baselines(view, 0), across = double(x) - d * views.seen.baselines(view, 1);
        const Index W = views.seen.nearest.shape[2];
        if (!place_within(down, across, H, W)) return std::nullopt;
        const Index row = std::min(Index(down), H - 2), column = std::min(Index(across), W - 2);
        return Place{row, column, down - double(row), across - double(column)};
    }

    // The same, if nothing occludes it.
    [[gnu::always_inline]] std::optional<Place> place_seen(Index view, float d, Index y, Index x) const {
        const auto place = place_in(view, d, y, x);
        if (!place) return place;
        const auto [row, column] = place->nearest(y, x);
        return views.seen.nearest(view, row - views.seen.low, column) <= d + views.seen.margin ? place : std::nullopt;
    }

    // Colour between pixels of a view, 0..1; grey counts as three equal channels. Cubic, since bilinear interpolation
    // lowers peaks that are two pixels wide.
    std::array<float, 3> sample(Index view, const Place &place) const {
        const Index t = views.seen.places(view, 0), s = views.seen.places(view, 1);
        auto colour = std::visit([&](const auto &lines) { return cubic_sample(lines[t][s], place); }, views.lines);
        for (auto &channel : colour) channel *= views.units(view);
        return colour;
    }

  private:
    template <class Colour>
    std::array<float, 3> cubic_sample(Array<const Colour, 2> picture, const Place &place) const {
        const Index C = views.channels, first = place.column - 1;
        const auto down = cubic_weights(place.fy), across = cubic_weights(place.fx);
        std::array<const Colour *, 4> rows;
        for (Index k = 0; k < 4; ++k) rows[k] = picture.at(clamped(place.row - 1 + k, H));
        std::array<float, 3> colour{};
        if (C == 3 && first >= 0 && 3 * (first + 4) <= picture.shape[1]) {
            const auto above_each_other = [&](Index i) {
                Float8 total = spread(down[0]) * load(rows[0] + i);
                for (Index k = 1; k < 4; ++k) total = fma(spread(down[k]), load(rows[k] + i), total);
                return total;
            };
            // four pixels side by side: the first eight numbers and the last eight cover all twelve
            const Float8 left = above_each_other(3 * first), right = above_each_other(3 * first + 4);
            const auto sum = across[0] * __builtin_shufflevector(left, left, 0, 1, 2, 2) + across[1] * __builtin_shufflevector(left, left, 3, 4, 5, 5) +
                             across[2] * __builtin_shufflevector(right, right, 2, 3, 4, 4) + across[3] * __builtin_shufflevector(right, right, 5, 6, 7, 7);
            for (Index c = 0; c < 3; ++c) colour[c] = sum[c];
        } else {
            for (Index j = 0; j < 4; ++j) {
                const Index i = C * clamped(first + j, picture.shape[1] / C);
                for (Index k = 0; k < 4; ++k)
                    for (Index c = 0; c < 3; ++c) colour[c] += across[j] * down[k] * float(rows[k][i + std::min(c, C - 1)]);
            }
        }
        return colour;
    }
};

}  // namespace sepi
