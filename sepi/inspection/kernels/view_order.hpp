// What the check of the views' order looks at.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// How badly points (P, 2) of the reference view (H, W), more than radius pixels from its border, match the other views
// (V, H, W) under layouts whose baselines are offsets (L, V, 2), at disparities candidates (K).
// cost (P, L): lowest mean over the views of r^2 / (r^2 + s^2), 0..1, where s^2 is a part of the patch's own variation;
// 1 where no candidate keeps half of the views in sight. disparity (P, L): the candidate of the lowest.
void layout_costs(Array<const float, 2> reference, Array<const float, 3> views, Array<const float, 3> offsets, Array<const float, 1> candidates,
                  Array<const std::int64_t, 2> points, Index radius, Array<float, 2> cost, Array<float, 2> disparity);

// Mean squared difference (H, W) of each pixel's window and where it should be seen in a view, baseline (2) view steps
// down and across; infinite where it is not asked for, and where the window leaves either picture.
void residuals(Array<const float, 2> reference, Array<const float, 2> view, Array<const float, 1> baseline, Array<const float, 2> disparity,
               Array<const bool, 2> asked, Index radius, Array<float, 2> out);

}  // namespace sepi
