// The operations of the plane sweep, on a few numbers that stay in the first cache, at fixed places: what they cost where
// nothing else does.
#pragma once

#include "array.hpp"

namespace sepi {

// Samples, polynomials of their distance, and their robust residuals: so many passes over data (threads, 7, N), added to
// out (threads, N). N is a multiple of LANES.
void samples(Index passes, Array<const float, 3> data, Array<float, 2> out);

// Rows of a window, seven multiply-adds each.
void windows(Index passes, Array<const float, 3> data, Array<float, 2> out);

}  // namespace sepi
