// The weighted median of a map.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// As sepi.compared.weighted_median; values, weight and out (H, W), guide (H, W, 3).
void weighted_medians(Array<const float, 2> values, Array<const float, 3> guide, Index radius, double sigma, Array<const float, 2> weight,
                      Array<float, 2> out);

}  // namespace sepi
