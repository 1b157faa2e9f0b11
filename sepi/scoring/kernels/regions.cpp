// Regions for evaluation.
#include "kernels/kernel.hpp"

namespace sepi::regions {

constexpr double HALF_PIXEL = 0.501;  // slightly more than a half, so that rounding of float32 disparities decides no tie
constexpr double STRETCH = 2;         // largest distance in a view of neighbouring pixels of one surface, pixels

// Whether the view of baseline (v, u) does not see the pixel (y, x).
bool hidden_in(Array<const double, 2> ground_truth, Index y, Index x, double v, double u, double nearest) {
    const Index H = ground_truth.shape[0], W = ground_truth.shape[1];
    const double own = ground_truth(y, x);
    // also for unknown disparities
    if (!place_within(double(y) - own * v, double(x) - own * u, H, W)) return false;
    const double steps_per_disparity = std::max(std::abs(v), std::abs(u));
    double before = 0;
    // the sight line rises by one pixel along the longer axis per step; no surface is above the nearest
    for (Index step = 1; step <= Index((nearest - own) * steps_per_disparity + HALF_PIXEL); ++step) {
        const auto row = Index(std::floor(double(y) + double(step) * v / steps_per_disparity + 0.5));
        const auto column = Index(std::floor(double(x) + double(step) * u / steps_per_disparity + 0.5));
        if (row < 0 || row >= H || column < 0 || column >= W) return false;
        // pixels by which the surface here lands beyond this pixel
        const double beyond = (ground_truth(row, column) - own) * steps_per_disparity - double(step);
        const bool crossed = step > 1 && before * beyond < 0 && std::abs(before - beyond) <= STRETCH;
        if (std::abs(beyond) <= HALF_PIXEL || crossed) return true;
        before = beyond;
    }
    return false;
}

// Pixels (H, W) that at least one of the views at baselines (N, 2) does not see, by the disparities of the ground truth,
// -inf where unknown, of which none is above nearest.
void occluded(Array<const double, 2> ground_truth, Array<const double, 2> baselines, double nearest, Array<bool, 2> out) {
    parallel_for_pixels(out.shape[0], out.shape[1], [&](Index y, Index x) {
        out(y, x) = false;
        for (Index n = 0; n < baselines.shape[0] && !out(y, x); ++n) out(y, x) = hidden_in(ground_truth, y, x, baselines(n, 0), baselines(n, 1), nearest);
    });
}

const Submodule submodule("regions", {{"occluded", &occluded}});

}  // namespace sepi::regions
