// The Gauss-Newton refinement: sums over the views that see a pixel, of rows begin..end.
#pragma once

#include <tuple>

#include "kernels/array.hpp"

namespace sepi {

// Pixels of a row that are done together: all that is known of them stays in the first cache.
constexpr Index AT_ONCE = 128;

// What an iteration needs of the views: the fields of sepi.matching.spline_views.SplineViews, in their order.
struct SplineViews {
    Array<const std::int16_t, 5> splines;    // (T, S, n + 2 SPLINE_MARGIN, W + 2 SPLINE_MARGIN, 4)
    float unit;                              // what they are multiplied with
    Index low;                               // the row after the margin
    Array<const float, 3> reference;         // (H, W, 4)
    Strided<const std::int64_t, 2> places;   // (N, 2), of the views that are compared, in the grid
    Array<const float, 2> baselines;         // (N, 2), theirs, down and across
    Array<const float, 1> scales2, shares;   // of colours and of detail

    auto fields() { return std::tie(splines, unit, low, reference, places, baselines, scales2, shares); }
};

// Where views are hidden: the fields of sepi.matching.aligned_views.Seeing.
struct Seeing {
    Array<const float, 4> nearest;  // (T, S, n, W), rows from the splines' low on
    float occlusion_margin;

    auto fields() { return std::tie(nearest, occlusion_margin); }
};

// Mean of the views and its derivatives along y and x, (H, W, 4).
struct MeanView {
    Array<const float, 3> mean, down, across;

    auto fields() { return std::tie(mean, down, across); }
};

// Mean of the views that see each pixel, those unlike the reference view counting less, into out (H, W, 4).
void mean_of_views(const SplineViews &views, const Seeing &seeing, Array<const float, 2> disparity, Index begin, Index end, Array<float, 3> out);

// Sums of each pixel, into out (2 or 14, H, W): gradient and curvature, whose ratio is the update towards less cost. And what
// else the views say, if it is asked: the same by the views to the left, to the right, above and below alone, misfit,
// agreement, detail's agreement and number of views.
void equations_of_views(const SplineViews &views, const Seeing &seeing, Array<const float, 2> disparity, const MeanView &image, Index begin, Index end,
                        Array<float, 3> out);

}  // namespace sepi
