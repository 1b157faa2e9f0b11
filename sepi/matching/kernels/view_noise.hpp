// Noise of the views: blocks of the reference view against blocks of others, at whole pixels.
#pragma once

#include "pixels.hpp"

namespace sepi {

// Width of a block, pixels.
constexpr Index BLOCK = 8;

// Least mean squared difference, in squared units of the colours, of each block of view (t0, s0) from what other views
// have at some whole pixels from it; infinite where no other view holds the block. Grey counts as three equal channels.
// moves (N, 4): row and column of a view in the grid, pixels down and across; least (H / BLOCK, W / BLOCK).
void least_differences(const Views &views, Index t0, Index s0, Array<const std::int64_t, 2> moves, Array<float, 2> least);

}  // namespace sepi
