// Mean shift: climbing from points to the modes of the distribution round them.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Disparity, times unit, of the mode that each pixel of the mask (H, W) belongs to, in modes (H, W); others stay.
// planes (4, H + 2 radius, W + 2 radius + room), with a margin of what is like nothing, are three colours and disparity
// in units of their bandwidths.
void patch_modes(Array<const float, 3> planes, Array<const bool, 2> mask, Index radius, float unit, Array<float, 2> modes);

// Move each of modes (N, D) to the mode of samples (N, D) that it belongs to.
void sample_modes(Array<const double, 2> samples, double bandwidth, Array<double, 2> modes);

}  // namespace sepi
