// Semi-global smoothing of a cost volume, after averaging over pixels of one's own colour. Smoothed are volumes of the
// shape (H, W, K'): candidates lie side by side, as many as fill vectors, and those too many are out of reach.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Paths from row to row that a thread follows together: their costs lie side by side, and fit in its cache.
constexpr Index PATHS_AT_ONCE = 32;

// Mean over a window with weights exp(-|colour difference|^2 / (2 variance)); cost (K, H, W), guide (3, H, W), out (H, W, K').
void aggregate(Array<const float, 3> cost, Array<const float, 3> guide, Index radius, float variance, Array<float, 3> out);

// Sum of the smoothed costs along eight paths, into out; cost and out (H, W, K'), guide (3, H, W). All paths of a direction go through
// band rows before any goes on, so that costs and sums come from memory once for the paths down and once for those up.
void semi_global(Array<const float, 3> cost, Array<const float, 3> guide, float small, float large, float weakening, Index band, Array<float, 3> out);

// Winner of each pixel, refined by a parabola, and by how much the averaged cost of other minima exceeds its own:
// negative where another minimum is lower before smoothing, 0 where there is no other. Candidates closer than same to
// the winner belong to its minimum; smoothed and averaged (H, W, K'), disparities (K).
void choose(Array<const float, 3> smoothed, Array<const float, 3> averaged, Array<const float, 1> disparities, float same, Array<float, 2> disparity,
            Array<float, 2> margin);

}  // namespace sepi
