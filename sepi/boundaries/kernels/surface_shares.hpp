// How much of a pixel beside a depth step each view shows as the nearer of its two surfaces: by how bright views are,
// what is behind the nearer surface, and how badly each share explains what they show.
#pragma once

#include <array>
#include <tuple>
#include <variant>

#include "kernels/array.hpp"

namespace sepi {

// The views that are compared, and what hides what in them.
struct RimViews {
    std::variant<Array<const std::uint8_t, 4>, Array<const std::uint16_t, 4>, Array<const float, 4>> lines;  // (T, S, H, W C)
    Index channels;
    Array<const float, 1> units;            // (N,)
    Strided<const std::int64_t, 2> places;  // (N, 2)
    Strided<const double, 2> baselines;     // (N, 2)
    Array<const float, 4> nearest;          // (T, S, n, W)
    Index low;                              // first row of nearest
    float margin;

    auto fields() { return std::tie(lines, channels, units, places, baselines, nearest, low, margin); }

    Index number() const { return units.shape[0]; }
};

// The surfaces of a map, and what the reference view shows of them.
struct Sides {
    Array<const float, 2> disparity;  // (H, W)
    Strided<const float, 3> guide;    // (H, W, 3)
    Array<const bool, 2> clean;       // (H, W)
    Index clean_radius;

    auto fields() { return std::tie(disparity, guide, clean, clean_radius); }

    std::array<float, 3> colour(Index y, Index x) const { return {guide(y, x, 0), guide(y, x, 1), guide(y, x, 2)}; }
};

// The pixels beside a depth step, and the two surfaces that may be theirs; (H, W).
struct Rim {
    Array<float, 2> near, far;
    Array<bool, 2> inside, is_near;

    auto fields() { return std::tie(near, far, inside, is_near); }
};

constexpr Index FEWEST_VIEWS = 3;  // that see a piece of background, before its colour counts
constexpr float UNSEEN = -1;       // in place of the variance of a background that fewer see; negative

// How bright each view is beside the reference, and how badly it shows the same, over some clean pixels: the ratio of the
// sums of the colours, and the mean absolute difference of one channel, 0..1, that is left, NaN of views that show none
// of the pixels; (N,). Pixels that a view does not show are missing (T, S, H, W), none if that is (T, S, 0, 0).
void brightness_of_views(const RimViews &views, const Sides &sides, Array<const bool, 4> missing, Array<double, 1> brightness,
                         Array<double, 1> residual);

// Rows begin..end of the more distant surfaces where they are wanted (H, W), medians over the views that see them, and of
// disparity layer (H, W), also where a nearer one hides them. Into background (H, W, 4): colours, and the variance of the
// views' colours, mean of the channels, or UNSEEN.
void background_of(const RimViews &views, Array<const float, 2> layer, Array<const bool, 2> wanted, Index begin, Index end,
                   Array<float, 3> background);

constexpr Index FEWEST_SAMPLES = 8;  // views from which a share is told
constexpr Index FEWEST_ALONE = 3;    // views from which it is told whether a pixel moves with the more distant surface alone
constexpr Index SHARES = 12;         // that are tried, from 0 to 1; none is one half

// How badly each share of the nearer surface explains what the views show of the pixels (n,) of a rim: mean robust
// residuals, 0..1, of shares from 0 to 1, into costs (n, SHARES), and told (n,) set; both left alone where the views do
// not tell. Along the nearer surface's disparity each view shows the same share of that surface before another piece of
// background (H, W, 4), which is that of background_of. A view counts half at the squared residual scale2, to which
// the squared difference of both surfaces' colours adds, times contrast2: errors of samples grow with it.
void costs_of_shares(const RimViews &views, const Rim &rim, Array<const float, 3> background, const Sides &sides, double scale2, double contrast2,
                     Array<const std::int64_t, 1> pixels, Array<float, 2> costs, Array<bool, 1> told);

}  // namespace sepi
