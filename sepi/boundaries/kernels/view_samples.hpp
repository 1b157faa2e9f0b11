// Where views show a pixel of some disparity, and the colours between their pixels.
#pragma once

#include "kernels/lanes.hpp"
#include "kernels/sampling.hpp"
#include "surface_shares.hpp"

namespace sepi {

// Where a pixel of disparity d lies in a view, if that is amid its pixels.
template <class Colour>
[[gnu::always_inline]] inline std::optional<Place> place_in(const RimViews<Colour> &views, Index view, float d, Index y, Index x) {
    const double down = double(y) - d * views.baselines(view, 0), across = double(x) - d * views.baselines(view, 1);
    return place_amid(down, across, views.lines.shape[2], views.nearest.shape[3]);
}

// The same, if nothing hides it.
template <class Colour>
[[gnu::always_inline]] inline std::optional<Place> place_seen(const RimViews<Colour> &views, Index view, float d, Index y, Index x) {
    const auto place = place_in(views, view, d, y, x);
    if (!place) return place;
    const auto [row, column] = place->nearest();
    return views.nearest(views.places(view, 0), views.places(view, 1), row - views.low, column) <= d + views.margin ? place : std::nullopt;
}

// Colour between pixels of a view, 0..1; grey counts as three equal channels. Cubic, since a bilinear sample takes from
// the peak of what is two pixels wide.
template <class Colour>
std::array<float, 3> sample(const RimViews<Colour> &views, Index view, const Place &place) {
    const auto picture = views.lines[views.places(view, 0)][views.places(view, 1)];
    const Index C = views.channels, H = picture.shape[0], first = place.column - 1;
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
        // four pixels side by side, of which the first eight numbers and the last eight make up all twelve
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
    for (auto &channel : colour) channel *= views.units(view);
    return colour;
}

}  // namespace sepi
