// Tree-reweighted message passing, on one thread: each pixel waits for the one before it.
//
// messages (4, H, W, K) is what comes to a pixel from its neighbour at the left, above, at the right, below;
// costs (H, W, K) are those of its labels, across and down (H, W) the weights of the edges to the next pixels.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// One pass forth, to the right and down, and one back.
void pass_messages(Array<const float, 3> costs, Array<const float, 2> across, Array<const float, 2> down, float truncation, Array<float, 4> messages);

// A label for each pixel in turn, given those of the pixels before it and what those after it say.
void decode(Array<const float, 3> costs, Array<const float, 2> across, Array<const float, 2> down, float truncation, Array<const float, 4> messages,
            Array<std::int64_t, 2> labels);

}  // namespace sepi
