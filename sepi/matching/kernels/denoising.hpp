// Denoising: the detail of each view, kept as far as it exceeds the noise.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Views (T, S, H, W, C) without what noise alone explains, of those that are present, into out. full is the value of
// white; variances (N,) are the noise of one channel at levels (N,), brightnesses that rise; detail is kept as far as its
// energy exceeds least (H, W) times that of this noise. Whole numbers are rounded and cut off at black and white.
template <class Colour>
void denoise_views(Array<const Colour, 5> views, Array<const bool, 2> present, float full, Strided<const float, 1> levels, Strided<const float, 1> variances,
                   Array<const float, 2> least, Array<Colour, 5> out);

}  // namespace sepi
