// How much of a pixel beside a depth step each view shows as the nearer of its two surfaces.
#pragma once

#include "rim_arrays.hpp"

namespace sepi {

constexpr Index FEWEST_SAMPLES = 8;  // views from which a share is told
constexpr Index FEWEST_ALONE = 3;    // views from which it is told whether a pixel moves with the more distant surface alone
constexpr Index SHARES = 12;         // that are tried, from 0 to 1; none is one half

// How badly each share of the nearer surface explains what the views show of the pixels (n,) of a rim: mean robust
// residuals, 0..1, of shares from 0 to 1, into costs (n, SHARES), and told (n,) set; both left alone where the views do
// not tell. Along the nearer surface's disparity each view shows the same share of that surface before another piece of
// background (H, W, 4), which is that of background_of. A view counts half at the squared residual scale2, to which
// the squared difference of both surfaces' colours adds, times contrast2: errors of samples grow with it.
template <class Colour>
void costs_of_shares(const RimViews<Colour> &views, const Rim &rim, Array<const float, 3> background, const Sides &sides, double scale2, double contrast2,
                     Array<const std::int64_t, 1> pixels, Array<float, 2> costs, Array<bool, 1> told);

}  // namespace sepi
