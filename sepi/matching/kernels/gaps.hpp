// What is seen through gaps: farther surfaces of a like colour, and how well both depths fit.
#pragma once

#include "pixels.hpp"

namespace sepi {

// Disparity (H, W) of the closest farther pixel of a like colour, straight or at 45 degrees from each, its own if none;
// of two that are as close the farther. lowest (H, W) is the least within reach pixels across and down; farther is more
// than least_step away, and colours (H, W, 3) are alike below a squared distance2.
void farther_alike(Array<const float, 2> disparity, Array<const float, 2> lowest, Strided<const float, 3> colours, Index reach, float least_step,
                   float distance2, Array<float, 2> farther);

// Squared residuals at two depths of the pixels of rows begin..end, in views (T, S, H, W, 3), which unit makes span 0..1, from
// the reference view (H, W, 3) in 0..1: added to sums (3, H, W) are those at the farther depth, at the other one, and of how
// many views they are. Asked is where nothing hides the farther depth; where both are equal nothing is compared.
void compare_depths(const Views &views, float unit, Array<const float, 2> disparity, Array<const float, 2> farther, Strided<const float, 3> reference,
                    const AskedViews &asked, Index begin, Index end, Array<float, 3> sums);

}  // namespace sepi
