// Base-detail decomposition: a bilateral filter whose result is taken away at once.
#pragma once

#include <tuple>

#include "pixels.hpp"

namespace sepi {

// Window of the bilateral filter, a disc: its radius, 1 / (64 s^2) for s the sum of the RGB differences that is an edge,
// colours in 0..1, and the weights of pixels so far down and across, (radius + 1, radius + 1).
struct BilateralWindow {
    Index radius;
    float falloff;
    Array<const float, 2> nearness;

    auto fields() { return std::tie(radius, falloff, nearness); }
};

// Mean of the channels without its edge-preserving mean, in detail_unit, of rows from low on of the views that are
// present: views (T, S, H, W, 3), which unit makes span 0..1, out (T, S, n, W). Other views are left as they are.
void detail_of_views(const Views &views, float unit, Array<const bool, 2> present, Index low, const BilateralWindow &window, float detail_unit,
                     Array<std::int16_t, 4> out);

}  // namespace sepi
