// Base-detail decomposition: a bilateral filter whose result is taken away at once.
#pragma once

#include "pixels.hpp"

namespace sepi {

// Mean of the channels without its edge-preserving mean, in detail_unit, of rows from low on of the views that are
// present: views (T, S, H, W, 3), which unit makes span 0..1, out (T, S, n, W). Other views are left as they are.
// The window is a disc of pixels so far down and across, whose weights are nearness (radius + 1, radius + 1); of colours they
// fall off by 1 / (64 s^2), s being the sum of the RGB differences that is an edge.
void detail_of_views(const Views &views, float unit, Array<const bool, 2> present, Index low, Array<const float, 2> nearness, float falloff, float detail_unit,
                     Array<std::int16_t, 4> out);

}  // namespace sepi
