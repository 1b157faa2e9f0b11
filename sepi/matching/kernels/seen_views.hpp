// Views that are compared with the reference view, and what hides its pixels in them.
#pragma once

#include "kernels/kernel.hpp"

namespace sepi {

// The fields of sepi.matching.nearest_surfaces.SeenViews, in their order.
struct SeenViews {
    Strided<const std::int64_t, 2> places;  // (V, 2), row and column in the grid
    Strided<const double, 2> baselines;     // (V, 2), down and across
    Array<const float, 3> nearest;          // (V, n, W), z-buffers, rows from low on
    Index low;
    float margin;  // an occluder is nearer by more

    bool fields(auto visit) { return visit(places, baselines, nearest, low, margin); }

    Index number() const { return nearest.shape[0]; }
};

}  // namespace sepi
