// Points of a view in the other views, by the exact disparity: occlusion, and shared light. Maps of all views are
// (N, H, W), those of one view (H, W); baselines (N, 2), down and across, are from that view.
#include "kernels/kernel.hpp"

namespace sepi::reprojection {

// Calls body(other, x, place) where another view contains the point of a pixel of row y. View by view, since adjacent
// pixels stay adjacent in memory.
template <class Body>
void for_landings(Array<const float, 3> disparities, Array<const double, 2> baselines, Index view, Index y, const Body &body) {
    const Index H = disparities.shape[1], W = disparities.shape[2];
    for (Index other = 0; other < disparities.shape[0]; ++other) {
        if (other == view) continue;
        for (Index x = 0; x < W; ++x) {
            const double d = disparities(view, y, x);
            if (const auto place = place_within(double(y) - d * baselines(other, 0), double(x) - d * baselines(other, 1), H, W)) body(other, x, *place);
        }
    }
}

// Whether a view with the point in its picture does not see it, and whether another view sees it. A point is hidden if
// all pixels around its position in another view are nearer.
void seen_elsewhere(Array<const float, 3> disparities, Array<const double, 2> baselines, Index view, double same, Array<bool, 2> hidden, Array<bool, 2> seen) {
    const Index W = disparities.shape[2];
    parallel_for(0, disparities.shape[1], [&](Index y) {
        std::fill_n(hidden.at(y), W, false);
        std::fill_n(seen.at(y), W, false);
        for_landings(disparities, baselines, view, y, [&](Index other, Index x, const Place &at) {
            const double nearer = double(disparities(view, y, x)) + same;
            const bool behind = all_about(at, [&](Index i, Index j) { return double(disparities(other, i, j)) > nearer; });
            (behind ? hidden : seen)(y, x) = true;
        });
    });
}

// Mean light (H, W, 3) over all views with a whole pixel of the surface, for whole pixels of one view; its own elsewhere;
// and variance of the mean's sum over colours. light (N, H, W, 3); surface: thing of a whole pixel, -1 for none.
void gathered_light(Array<const float, 4> light, Array<const float, 3> disparities, Array<const std::int16_t, 3> surface, Array<const double, 2> baselines,
                    Index view, double bend, Array<float, 3> mean, Array<float, 2> variance) {
    const Index W = disparities.shape[2];
    parallel_for(0, disparities.shape[1], [&](Index y) {
        // for each pixel of the row: sums of the colours, squared sums of colours, and number of views
        const auto sums = zeros<double, 2>(W, 5);
        const auto add = [&](Index x, const auto &colour) {
            double *of_pixel = sums.array().at(x);
            float grey = 0;
            for (Index c = 0; c < 3; ++c) {
                const float part = colour(c);
                of_pixel[c] += double(part);
                grey += part;
            }
            of_pixel[3] += squared(double(grey));
            ++of_pixel[4];
        };
        for (Index x = 0; x < W; ++x) add(x, [&](Index c) { return light(view, y, x, c); });
        for_landings(disparities, baselines, view, y, [&](Index other, Index x, const Place &at) {
            const auto thing = surface(view, y, x);
            if (thing < 0 || !all_about(at, [&](Index i, Index j) { return surface(other, i, j) == thing; })) return;
            const float there = bilinear(at, [&](Index i, Index j) { return disparities(other, i, j); });
            if (double(std::abs(there - disparities(view, y, x))) > bend) return;
            add(x, [&](Index c) { return bilinear(at, [&](Index i, Index j) { return light(other, i, j, c); }); });
        });
        for (Index x = 0; x < W; ++x) {
            const double *total = sums.array().at(x), number = total[4];
            // not below 0 by rounding
            const double between = std::max(total[3] / number - squared((total[0] + total[1] + total[2]) / number), 0.0);
            variance(y, x) = number > 1 ? float(between / (number - 1)) : 0.0f;
            for (Index c = 0; c < 3; ++c) mean(y, x, c) = float(total[c] / number);
        }
    });
}

const Submodule submodule("reprojection", {{"seen_elsewhere", &seen_elsewhere}, {"gathered_light", &gathered_light}});

}  // namespace sepi::reprojection
