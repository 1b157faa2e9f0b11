// Sums over windows that hold one surface.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Sums of gradient and curvature (H, W) over those pixels of a window of 2 radius + 1 that are of the surface of its
// middle, into sums (2, H, W).
//
// Differences of disparity (H, W) over width, and of colours (3, H, W) over colour_width, make a pixel count less and
// less, from half of it on; one of the same disparity counts least whatever its colour. Colours (3, 0, 0) are not asked.
void sums_of_surface(Array<const float, 2> gradient, Array<const float, 2> curvature, Array<const float, 2> disparity, Array<const float, 3> colours,
                     Index radius, float width, float colour_width, float least, Array<float, 3> sums);

}  // namespace sepi
