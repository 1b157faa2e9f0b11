// The photo-consistency of angular patches.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Mean over the other views of the truncated colour difference from the reference view, the number of which among them
// is reference: the mean of the channels, in parts of the truncation, 0..1. sheared (N, 3, H, W), out (H, W).
void mean_truncated_differences(Array<const float, 4> sheared, Index reference, double truncation, Array<float, 2> out);

}  // namespace sepi
