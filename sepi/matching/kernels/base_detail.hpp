// Base-detail decomposition: a bilateral filter whose result is taken away at once.
#pragma once

#include <tuple>

#include "kernels/array.hpp"

namespace sepi {

// Window of the bilateral filter: a disc, and standard deviations of the weights: of the sum of the RGB differences,
// colours in 0..1, and in pixels.
struct BilateralWindow {
    Index radius;
    double edge, width;

    auto fields() { return std::tie(radius, edge, width); }
};

// Mean of the channels without its edge-preserving mean, in detail_unit, of rows from low on of the views that are
// present: colours (T, S, H, W, 3), which unit makes span 0..1, out (T, S, n, W). Other views are left as they are.
template <class Colour>
void detail_of_views(Strided<const Colour, 5> colours, float unit, Array<const bool, 2> present, Index low, BilateralWindow window, float detail_unit,
                     Array<std::int16_t, 4> out);

}  // namespace sepi
