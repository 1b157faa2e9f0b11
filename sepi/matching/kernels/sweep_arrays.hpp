// Arrays that plane sweeps work on, in named groups: the fields of sepi.matching.sweep_arrays, in their order.
#pragma once

#include "kernels/kernel.hpp"

namespace sepi {

// The views that are compared.
struct ViewStack {
    std::variant<Array<const std::uint8_t, 5>, Array<const std::uint16_t, 5>, Array<const float, 5>> colours;  // (T, S, 3, H, W + LANES)
    Index t0, s0;
    Array<const std::int64_t, 2> groups;  // (T, S); -1 leaves a view out
    Array<const bool, 2> subsets;         // (N, G)
    float scale2;
    Array<const std::int64_t, 4> shown;  // (T, S, H or 0, 2)

    bool fields(auto visit) { return visit(colours, t0, s0, groups, subsets, scale2, shown); }
};

// Candidate disparities, and the positions of a reference pixel's samples in each view.
struct Candidates {
    Array<const float, 1> disparities;   // (K,)
    Array<const std::int64_t, 3> down;   // (T, S, K)
    Array<const float, 3> fy;            // (T, S, K)
    Array<const std::int64_t, 3> across;  // (T, S, K)
    Array<const float, 3> fx;            // (T, S, K)
    Array<const float, 2> sy, sx;        // (T, S)
    double reach;

    bool fields(auto visit) { return visit(disparities, down, fy, across, fx, sy, sx, reach); }
};

// Aggregation window, 2 radius + 1 pixels wide, with weights by colour.
struct Window {
    Array<const float, 3> guide;  // (3, H, W)
    Index radius;
    Array<const float, 2> variance;  // (H, W)

    bool fields(auto visit) { return visit(guide, radius, variance); }
};

// Expected costs of noise.
struct ExpectedCosts {
    Array<const float, 3> moments;   // (2, N, K')
    Array<const float, 3> weights;   // (2, H, W)
    Array<const float, 2> anywhere;  // (H, W)

    bool fields(auto visit) { return visit(moments, weights, anywhere); }
};

// Row above the samples of a row, and their distance below it.
inline std::pair<Index, float> upper_row(Index y, Index down, float fy, Index height) {
    // the last row has none below, so the row above it is used
    if (y + down == height - 1 && fy == 0) return {height - 2, 1.0f};
    return {y + down, fy};
}

}  // namespace sepi
