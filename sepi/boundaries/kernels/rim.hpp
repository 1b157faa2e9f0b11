// The pixels beside depth steps, and the surfaces on both sides.
#pragma once

#include "rim_arrays.hpp"

namespace sepi {

// Surfaces on both sides of each depth step of a map (H, W), means over a window by nearness. A pixel lies beside a step
// where the disparities within radius pixels differ by step; elsewhere rim is left alone.
void rim_of(Array<const float, 2> disparity, Index radius, double step, const Rim &rim);

}  // namespace sepi
