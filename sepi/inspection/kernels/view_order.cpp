// Matching for the check of the views' order.
#include "kernels/kernel.hpp"

namespace sepi::view_order {

constexpr float HALF = 0.25f;  // difference of two patches that counts one half, as a share of the patch's own variation

// Square part of a picture, which begins at (y, x).
Array<const float, 2> patch_at(Array<const float, 2> picture, Index y, Index x, Index side) {
    return {picture.at(y, x), {side, side}, {picture.strides[0], 1}};
}

// Position of a patch of the reference view in another view, if the whole patch lies inside.
std::optional<Place> patch_within(Array<const float, 2> view, Index y, Index x, float d, float down, float across, Index side) {
    const Index H = view.shape[0] - side, W = view.shape[1] - side;
    const auto place = place_within(double(y) - double(d * down), double(x) - double(d * across), H + 1, W + 1);
    // and the next row and column, for interpolation
    return place && place->row < H && place->column < W ? place : std::nullopt;
}

// Sum of the squared differences of a patch and the samples of a view that begin at a place.
float squares_of(Array<const float, 2> patch, Array<const float, 2> view, const Place &place) {
    const auto [a, b, c, d] = bilinear_weights(float(place.fy), float(place.fx));
    float total = 0;
    for (Index i = 0; i < patch.shape[0]; ++i) {
        const float *own = patch.at(i), *above = view.at(place.row + i, place.column), *below = view.at(place.row + i + 1, place.column);
        for (Index j = 0; j < patch.shape[1]; ++j) {
            const float r = a * above[j] + b * above[j + 1] + c * below[j] + d * below[j + 1] - own[j];
            total += r * r;
        }
    }
    return total;
}

// Matching costs of points (P, 2) of the reference view (H, W), more than radius pixels from its border, with the other
// views (V, H, W) under layouts with baselines offsets (L, V, 2), at disparities candidates (K).
// cost (P, L): lowest mean over the views of r^2 / (r^2 + s^2), 0..1, where s^2 is a part of the patch's own variation;
// 1 where no candidate keeps half of the views in sight. disparity (P, L): the candidate of the lowest.
void layout_costs(Array<const float, 2> reference, Array<const float, 3> views, Array<const float, 3> offsets, Array<const float, 1> candidates,
                  Array<const std::int64_t, 2> points, Index radius, Array<float, 2> cost, Array<float, 2> disparity) {
    const Index L = offsets.shape[0], V = offsets.shape[1], side = 2 * radius + 1;
    parallel_for(0, points.shape[0], [&](Index p) {
        const Index y = points(p, 0) - radius, x = points(p, 1) - radius;
        const auto patch = patch_at(reference, y, x, side);
        float squares = 0;
        for (Index i = 0; i < side; ++i)
            for (Index j = 0; j < side; ++j) squares += patch(i, j) * patch(i, j);
        // above 0, as a divisor
        const float variation = HALF * squares + 1e-12f;
        for (Index n = 0; n < L; ++n) {
            float least = 1, best = 0;
            // from the middle outwards, since most points move little, and a good match ends the other sums early
            for (Index i = 0; i < candidates.shape[0]; ++i) {
                const Index k = candidates.shape[0] / 2 + (i % 2 ? -(i + 1) / 2 : i / 2);
                float total = 0;
                Index seen = 0;
                for (Index v = 0; v < V; ++v) {
                    const auto place = patch_within(reference, y, x, candidates(k), offsets(n, v, 0), offsets(n, v, 1), side);
                    if (!place) continue;
                    const float found = squares_of(patch, views[v], *place);
                    total += found / (found + variation);
                    ++seen;
                    // the mean stays above the lowest for any result of the remaining views
                    if (total >= least * double(seen + V - 1 - v)) break;
                }
                if (2 * seen >= V && total < least * double(seen)) {
                    least = total / float(seen);
                    best = candidates(k);
                }
            }
            cost(p, n) = least;
            disparity(p, n) = best;
        }
    });
}

// Mean squared difference (H, W) between each pixel's window and its position in a view at baseline (2) view steps down
// and across; infinite where not wanted, and where the window leaves either picture.
void residuals(Array<const float, 2> reference, Array<const float, 2> view, Array<const float, 1> baseline, Array<const float, 2> disparity,
               Array<const bool, 2> asked, Index radius, Array<float, 2> out) {
    const Index H = reference.shape[0], W = reference.shape[1], side = 2 * radius + 1;
    parallel_for(0, H, [&](Index row) {
        std::fill_n(out.at(row), W, INFINITE);
        const Index y = row - radius;
        if (y < 0 || y > H - side) return;
        for (Index x = 0; x <= W - side; ++x) {
            if (!asked(row, x + radius)) continue;
            const auto place = patch_within(view, y, x, disparity(row, x + radius), baseline(0), baseline(1), side);
            if (place) out(row, x + radius) = squares_of(patch_at(reference, y, x, side), view, *place) / float(side * side);
        }
    });
}

const Submodule submodule("view_order", {{"layout_costs", &layout_costs}, {"residuals", &residuals}});

}  // namespace sepi::view_order
