// Specks of a map.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Pixels of parts of a map (H, W) that are small: of most_pixels, or of most_of_hole with nothing but nearer pixels
// round them. Of one part are neighbours, of eight, that differ by difference at most.
void specks_of(Array<const float, 2> disparity, float difference, Index most_pixels, Index most_of_hole, Array<bool, 2> specks);

}  // namespace sepi
