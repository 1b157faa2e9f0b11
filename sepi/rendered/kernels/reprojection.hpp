// What the views of a scene see of each other's points, by the exact disparity, and the light that they share. Maps of all
// views are (N, H, W), those of one view (H, W); baselines (N, 2), down and across, are those from that view.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Whether some view that has the point in its picture does not see it, and whether some other view sees it. Where all
// pixels of another view about the place where a point lands are nearer, it is hidden.
void seen_elsewhere(Array<const float, 3> disparities, Array<const double, 2> baselines, Index view, double same, Array<bool, 2> hidden, Array<bool, 2> seen);

// Mean light (H, W, 3) of all views that show the surface whole, for whole pixels of one view; its own elsewhere; and the
// variance of that mean, of all colours' sum. light (N, H, W, 3); surface is which thing pixels show whole, -1 for none.
void gathered_light(Array<const float, 4> light, Array<const float, 3> disparities, Array<const std::int16_t, 3> surface, Array<const double, 2> baselines,
                    Index view, double bend, Array<float, 3> mean, Array<float, 2> variance);

}  // namespace sepi
