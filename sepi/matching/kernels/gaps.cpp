// Surfaces seen through gaps: farther surfaces of a similar colour, and residuals at both depths.
#include "pixels.hpp"

namespace sepi::gaps {

// Squared residual of a bilinear sample of a view (H, W, 3) from reference (3,), in units of its expectation by noise,
// which interpolation averages.
float squared_residual(const auto &view, float unit, const Place &at, Array<const float, 1> reference) {
    float total = 0;
    for (Index c = 0; c < 3; ++c) total += float(squared(bilinear(at, [&](Index i, Index j) { return float(view(i, j, c)); }) * unit - reference(c)));
    const auto averaged = [](double f) { return float(f * f + (1 - f) * (1 - f)); };
    return total / (1 + averaged(at.fx) * averaged(at.fy));
}

// Number of steps, up to most, from i that stay in a line of n.
Index steps_within(Index i, Index direction, Index n, Index most) { return std::min(most, direction < 0 ? i : direction > 0 ? n - 1 - i : most); }

// Disparity (H, W) of the closest farther pixel of a similar colour, along rows, columns and diagonals from each pixel;
// its own if there is none; of two equally close ones the farther. lowest (H, W) is the least disparity within reach
// pixels across and down. Farther means by more than least_step; colours (H, W, 3) are similar below distance2, squared.
void farther_alike(Array<const float, 2> disparity, Array<const float, 2> lowest, Array<const float, 3> colours, Index reach,
                   float least_step, float distance2, Array<float, 2> farther) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    parallel_for_pixels(H, W, [&](Index y, Index x) {
        const float own = disparity(y, x), limit = own - least_step, *here = colours.at(y, x);
        farther(y, x) = own;
        if (lowest(y, x) >= limit) return;
        Index closest = reach;
        for (Index dy = -1; dy <= 1; ++dy) {
            for (Index dx = -1; dx <= 1; ++dx) {
                if (dy == 0 && dx == 0) continue;
                const Index end = steps_within(y, dy, H, steps_within(x, dx, W, closest));
                for (Index step = 1; step <= end; ++step) {
                    const float there = disparity(y + step * dy, x + step * dx);
                    if (there >= limit || squared_distance(here, colours.at(y + step * dy, x + step * dx)) >= distance2) continue;
                    farther(y, x) = step == closest ? std::min(there, farther(y, x)) : there;
                    closest = step;
                    break;
                }
            }
        }
    });
}

// Squared residuals at two depths of the pixels of rows begin..end, in views (T, S, H, W, 3), times unit in 0..1, from
// the reference view (H, W, 3) in 0..1. Adds to sums (3, H, W) the residuals at the farther depth, at the other one, and
// the number of views. asked: views in which nothing hides the farther depth. Pixels with equal depths are left out. The
// residual of one view has an upper limit.
void compare_depths(const Views &views, float unit, Array<const float, 2> disparity, Array<const float, 2> farther, Strided<const float,
                    3> reference, const SeenViews &asked, float most, Index begin, Index end, Array<float, 3> sums) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const auto add_view = [&](const auto &view, Index n, Index y, const std::vector<Index> &columns) {
        const auto nearest = asked.nearest[n];
        const double down = asked.baselines(n, 0), across = asked.baselines(n, 1);
        for (const Index x : columns) {
            const float d = disparity(y, x), f = farther(y, x);
            const auto there = place_within(double(y) - f * down, double(x) - f * across, H, W);
            const auto own = place_within(double(y) - d * down, double(x) - d * across, H, W);
            if (!there || !own || !all_about(*there, [&](Index i, Index j) { return nearest(i - asked.low, j) <= f + asked.margin; })) continue;
            sums(0, y, x) += std::min(squared_residual(view, unit, *there, reference[y][x]), most);
            sums(1, y, x) += std::min(squared_residual(view, unit, *own, reference[y][x]), most);
            ++sums(2, y, x);
        }
    };
    parallel_for(begin, end, [&](Index y) {
        std::vector<Index> columns;
        for (Index x = 0; x < W; ++x)
            if (disparity(y, x) != farther(y, x)) columns.push_back(x);
        for (Index n = 0; n < asked.number(); ++n)
            std::visit([&](const auto &some) { add_view(some[asked.places(n, 0)][asked.places(n, 1)], n, y, columns); }, views);
    });
}

const Submodule submodule("gaps", {{"farther_alike", &farther_alike}, {"compare_depths", &compare_depths}});

}  // namespace sepi::gaps
