// Regions for evaluation.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Pixels (H, W) that at least one of the views at baselines (N, 2) does not see, by the disparities of the ground truth,
// -inf where unknown, of which none is above nearest.
void occluded(Array<const double, 2> ground_truth, Array<const double, 2> baselines, double nearest, Array<bool, 2> out);

}  // namespace sepi
