// The plane sweep of the range estimate.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Match the reference view (H, W) with other views (V, H, W), at offsets (V, 2) view steps down and across, at each of
// the candidates (N), disparities that rise evenly, by differences up to the truncation, averaged over a window of
// radius pixels to each side.
// out (4, H, W): lowest cost; lowest outside the valley round it, or infinite; mean cost; the candidate of the lowest,
// refined by a parabola. Candidates at which fewer than half of the views see a pixel of the window are left out; the
// lowest is infinite where that leaves none, or where it is at an end of the candidates and may go on falling beyond.
void coarse_sweep(Array<const float, 2> reference, Array<const float, 3> views, Array<const float, 2> offsets, Array<const float, 1> candidates,
                  float truncation, Index radius, Array<float, 3> out);

}  // namespace sepi
