// Pictures in focus everywhere, and pictures of the views between the views.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Pixels of a box at most: views whose pictures of a point are farther apart show it more than once.
constexpr float WIDEST = 17;

// Add what a view (H, W, 1 or 3), v down and u across from the reference view, shows of each pixel that it sees: to sums
// (H, W, 1 or 3) weighted differences from the expected colour, centre, and to weights (H, W) the weights. Pixels whose
// disparity is NaN get nothing, nor those before which the view shows something nearer by more than the margin. A colour
// whose squared difference from the expected one, over the channels, is scale2 counts a quarter.
void add_view(Array<const float, 3> view, double v, double u, Array<const float, 2> disparity, Array<const float, 2> nearest, float margin,
              Array<const float, 3> centre, float scale2, Array<float, 3> sums, Array<float, 2> weights);

// A view (C, H, W), sheared by the disparity focus, as the mean of all that could be taken in its cell of the aperture,
// so many view steps high and wide. While the camera moves through the cell, each point moves over a box: its
// disparity's distance from the focus, times the cell. What is nearer by more than the margin covers a pixel for the
// share of the cell in which it is before it. Surfaces (H, W): disparities of what the view shows, finite.
void fill_between(Array<const float, 3> sheared, Array<const float, 2> surfaces, float focus, Array<const float, 1> cell, float margin, Array<float, 3> out);

}  // namespace sepi
