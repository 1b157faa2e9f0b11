// Angular patches that an edge splits in two.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// What the halves of P patches show of views sheared by a candidate, sheared (N, 3, H, W), counted from the colours of
// the reference view (3, H, W): means (P, 2, 3), and variances (P, 2), means over the channels.
// places (P, 3): row, column and number of the edge's orientation; halves (orientations, 2, N): views of the two halves,
// of which none is empty.
void moments_of_halves(Array<const float, 4> sheared, Array<const float, 3> reference, Strided<const std::int64_t, 2> places,
                       Array<const bool, 3> halves, Array<float, 3> means, Array<float, 2> variances);

}  // namespace sepi
