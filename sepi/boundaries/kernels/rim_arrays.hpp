// Arrays that the decision beside depth steps works on, in named groups: the fields of sepi.boundaries.arrays and rim.
#pragma once

#include <array>
#include <tuple>

#include "kernels/array.hpp"

namespace sepi {

// The views that are compared, and what hides what in them.
template <class Colour>
struct RimViews {
    Array<const Colour, 4> lines;  // (T, S, H, W C)
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

}  // namespace sepi
