// The fast method with one-bit features.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Share of the pairs of views whose bits differ, at every step-th row and column; 1 is as many different pairs as there
// can be, and where there is no pair. Views that show a pixel beyond their border take no part.
// details (N, H, W), whose signs are the bits; offsets (K, N, 2), down and across from a reference pixel to its sample,
// for each candidate, in pixels; out (K, ceil(H / step), ceil(W / step)).
void pair_costs(Array<const float, 3> details, Array<const double, 3> offsets, Index step, Array<float, 3> out);

// Interpolate the costs of candidate k to all pixels, and keep what each pixel's least cost needs. Candidates come in
// rising order from 0 on. slopes (h, w, 3) and constants (h, w): costs as a linear function of the guide's colours, at
// every step-th row and column; guide (H, W, 3); labels (H, W), candidate of least cost so far; kept (H, W, 5), least
// cost so far, cost of the candidate before it, of that after it, of candidate k - 1, and the sum.
void keep_least(Index k, Array<const float, 3> slopes, Array<const float, 2> constants, Array<const float, 3> guide, Index step, Array<std::int64_t, 2> labels,
                Array<float, 3> kept);

// For each pixel, the value of least absolute differences to its datum and to its neighbours as they are, all (H, W).
// Neighbours are up to radius times gap pixels away, every gap-th one; table: weight of one by the squared difference
// of colours, an entry for each per_entry, 0 beyond. A window's weights add up to less than 2^31.
void median_pass(Array<const std::int32_t, 2> current, Array<const std::int32_t, 2> data, Array<const std::int32_t, 2> data_weights,
                 Array<const float, 3> guide, Index radius, Index gap, Array<const std::int32_t, 1> table, double per_entry, Array<std::int32_t, 2> out);

}  // namespace sepi
