// Whole views, moved by fractions of a pixel.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// out[n, c, y, x] = views[n, c, y + offsets[n, 0], x + offsets[n, 1]]; views and out (N, C, H, W), offsets (N, 2).
// Samples between pixels by cubic convolution, or bilinear; a view goes on as it ends.
void shear(Array<const float, 4> views, Strided<const double, 2> offsets, bool cubic, Array<float, 4> out);

}  // namespace sepi
