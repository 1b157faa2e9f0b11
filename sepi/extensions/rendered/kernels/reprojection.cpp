// Points of a view in the other views, by the exact disparity: occlusion, and shared light. Maps of all views are
// (N, H, W), those of one view (H, W); baselines (N, 2), down and across, are from that view.
#include "kernels/kernel.hpp"

namespace sepi::reprojection {

// Calls body(other, place) where another view contains the point of a pixel.
template <class Body>
void for_landings(Array<const float, 3> disparities, Array<const double, 2> baselines, Index view, Index y, Index x, const Body &body) {
    const double d = disparities(view, y, x);
    for (Index other = 0; other < disparities.shape[0]; ++other) {
        if (other == view) continue;
        const auto place = place_within(double(y) - d * baselines(other, 0), double(x) - d * baselines(other, 1), disparities.shape[1], disparities.shape[2]);
        if (place) body(other, *place);
    }
}

// Whether a view with the point in its picture does not see it, and whether another view sees it. A point is hidden if
// all pixels around its position in another view are nearer.
void seen_elsewhere(Array<const float, 3> disparities, Array<const double, 2> baselines, Index view, double same, Array<bool, 2> hidden, Array<bool, 2> seen) {
    parallel_for_pixels(disparities.shape[1], disparities.shape[2], [&](Index y, Index x) {
        hidden(y, x) = seen(y, x) = false;
        const double nearer = double(disparities(view, y, x)) + same;
        for_landings(disparities, baselines, view, y, x, [&](Index other, const Place &at) {
            const bool behind = all_about(at, [&](Index i, Index j) { return double(disparities(other, i, j)) > nearer; });
            (behind ? hidden : seen)(y, x) = true;
        });
    });
}

// Mean light (H, W, 3) over all views with a whole pixel of the surface, for whole pixels of one view; its own elsewhere;
// and variance of the mean's sum over colours. light (N, H, W, 3); surface: thing of a whole pixel, -1 for none.
void gathered_light(Array<const float, 4> light, Array<const float, 3> disparities, Array<const std::int16_t, 3> surface, Array<const double, 2> baselines,
                    Index view, double bend, Array<float, 3> mean, Array<float, 2> variance) {
    parallel_for_pixels(disparities.shape[1], disparities.shape[2], [&](Index y, Index x) {
        double total[3] = {}, squares = 0, number = 0;
        const auto add = [&](const auto &colour) {
            float grey = 0;
            for (Index c = 0; c < 3; ++c) {
                const float part = colour(c);
                total[c] += double(part);
                grey += part;
            }
            squares += squared(double(grey));
            ++number;
        };
        add([&](Index c) { return light(view, y, x, c); });
        const auto thing = surface(view, y, x);
        for_landings(disparities, baselines, view, y, x, [&](Index other, const Place &at) {
            if (thing < 0 || !all_about(at, [&](Index i, Index j) { return surface(other, i, j) == thing; })) return;
            const float there = bilinear(at, [&](Index i, Index j) { return disparities(other, i, j); });
            if (double(std::abs(there - disparities(view, y, x))) > bend) return;
            add([&](Index c) { return bilinear(at, [&](Index i, Index j) { return light(other, i, j, c); }); });
        });
        // not below 0 by rounding
        const double between = std::max(squares / number - squared((total[0] + total[1] + total[2]) / number), 0.0);
        variance(y, x) = number > 1 ? float(between / (number - 1)) : 0.0f;
        for (Index c = 0; c < 3; ++c) mean(y, x, c) = float(total[c] / number);
    });
}

const Submodule submodule("reprojection", {{"seen_elsewhere", &seen_elsewhere}, {"gathered_light", &gathered_light}});

}  // namespace sepi::reprojection
