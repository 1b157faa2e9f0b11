// The vote cost: what views, sheared by a candidate (N, 3, H, W), differ from the reference view, the number of which
// among them is reference, and which has no vote.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Lower each threshold (H, W) to that by which so many views as needed, 1..N - 1, agree with the reference view.
void lower_thresholds(Array<const float, 4> sheared, Index reference, Index needed, Array<float, 2> thresholds);

// What the candidate costs each pixel, 1 - (V - M) / (N - 1) of sepi.compared.oavc; positive thresholds, out (H, W).
void vote_costs(Array<const float, 4> sheared, Index reference, Array<const float, 2> thresholds, Array<float, 2> out);

}  // namespace sepi
