// Costs of angular patches, whole ones and those that an edge splits in two: of the views sheared by a candidate,
// sheared (N, 3, H, W), and of the reference view (3, H, W). Means over the channels, of squared colours.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Variance of each angular patch plus the squared difference of its mean from the reference view; out (H, W).
void whole_patch_costs(Array<const float, 4> sheared, Array<const float, 3> reference, Array<float, 2> out);

// Costs of P patches that an edge splits in two halves.
// places (P, 3): row, column and number of the edge's orientation; halves (orientations, 2, N): views of the two halves,
// of which none is empty; beside (P, 2, 3): mean colours on the two sides of the edge in the reference view; tolerance:
// by how much the halves may fit these colours worse than they would if they changed places.
// costs (P): variance and defocus of the half of the smaller variance, infinite where the colours are reversed;
// cues (P, 3): variances of the two halves, absolute difference of their means.
void split_patch_costs(Array<const float, 4> sheared, Array<const float, 3> reference, Strided<const std::int64_t, 2> places, Array<const bool, 3> halves,
                       Array<const float, 3> beside, float tolerance, Array<float, 1> costs, Array<float, 2> cues);

}  // namespace sepi
