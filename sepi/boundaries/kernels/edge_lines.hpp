// The edges beside depth steps.
#pragma once

#include <tuple>

#include "kernels/array.hpp"

namespace sepi {

// From one share that has a cost to the next that an edge may leave.
constexpr Index STEPS = 3;

// Edges through a patch of three by three pixels: the fields of sepi.boundaries.edge_lines.Edges, in their order.
struct Edges {
    Array<const std::uint8_t, 2> shares;  // (M, 9), in steps
    Array<const bool, 1> is_near;         // (M,)
    Array<const float, 1> costs;          // (M,)
    Array<const float, 1> weights;        // (9,)

    auto fields() { return std::tie(shares, is_near, costs, weights); }
};

// By how much the best edge that leaves a pixel to the farther surface costs less than the best that does not, into
// evidence (n,), for pixels (n,) of the map (H, W). Between their surfaces lies middle (H, W). Shares of the nearer one
// have costs (n, K), from 0 to 1, the best of each 0; number (H, W) is a pixel's row of them, or -1: it lies beside no
// step, and stays on its side.
void evidence_of_lines(Array<const float, 2> disparity, Array<const float, 2> middle, Array<const std::int64_t, 2> number, Array<const float, 2> costs,
                       const Edges &edges, Array<const std::int64_t, 1> pixels, Array<float, 1> evidence);

}  // namespace sepi
