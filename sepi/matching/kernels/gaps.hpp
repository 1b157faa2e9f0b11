// What is seen through gaps: farther surfaces of a like colour, and how well both depths fit.
#pragma once

#include <tuple>

#include "pixels.hpp"

namespace sepi {

// Disparity (H, W) of the closest farther pixel of a like colour, straight or at 45 degrees from each, its own if none;
// of two that are as close the farther. lowest (H, W) is the least within reach pixels across and down; farther is more
// than least_step away, and colours (H, W, 3) are alike below a squared distance2.
void farther_alike(Array<const float, 2> disparity, Array<const float, 2> lowest, Strided<const float, 3> colours, Index reach, float least_step,
                   float distance2, Array<float, 2> farther);

// What compare_depths() compares: maps (H, W), and colours of the reference view (H, W, 3), in 0..1. Where farther equals
// disparity nothing is compared.
struct TwoDepths {
    Array<const float, 2> disparity, farther;
    Strided<const float, 3> reference;

    auto fields() { return std::tie(disparity, farther, reference); }
};

// The views that are asked, others (T, S), how far from the reference view (T, S, 2) they are, and their z-buffers
// (T, S, n, W) of the map farther, rows from low on. An occluder is nearer by more than margin.
struct AskedViews {
    Array<const bool, 2> others;
    Strided<const double, 3> baselines;
    Array<const float, 4> nearest;
    Index low;
    float margin;

    auto fields() { return std::tie(others, baselines, nearest, low, margin); }
};

// Squared residuals of rows begin..end of views (T, S, H, W, 3), which unit makes span 0..1, where nothing hides the farther
// depth: added to sums (3, H, W) are those at the farther depth, at the other one, and of how many views they are.
void compare_depths(const Views &views, float unit, const TwoDepths &depths, const AskedViews &asked, Index begin, Index end, Array<float, 3> sums);

}  // namespace sepi
