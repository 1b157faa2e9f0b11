// What views show beside the nearer surface: how bright they are, and what is behind it.
#pragma once

#include "rim_arrays.hpp"

namespace sepi {

constexpr Index FEWEST_VIEWS = 3;  // that see a piece of background, before its colour counts
constexpr float UNSEEN = -1;       // in place of the variance of a background that fewer see; negative

// How bright each view is beside the reference, and how badly it shows the same, over some clean pixels: the ratio of the
// sums of the colours, and the mean absolute difference of one channel, 0..1, that is left, NaN of views that show none
// of the pixels; (N,). Pixels that a view does not show are missing (T, S, H, W), none if that is (T, S, 0, 0).
template <class Colour>
void brightness_of_views(const RimViews<Colour> &views, const Sides &sides, Array<const bool, 4> missing, Array<double, 1> brightness,
                         Array<double, 1> residual);

// Rows begin..end of the more distant surfaces where they are wanted (H, W), medians over the views that see them, and of
// disparity layer (H, W), also where a nearer one hides them. Into background (H, W, 4): colours, and the variance of the
// views' colours, mean of the channels, or UNSEEN.
template <class Colour>
void background_of(const RimViews<Colour> &views, Array<const float, 2> layer, Array<const bool, 2> wanted, Index begin, Index end,
                   Array<float, 3> background);

}  // namespace sepi
