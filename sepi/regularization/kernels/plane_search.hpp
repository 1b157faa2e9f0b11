// Search for the plane that most of some pixels lie on.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// How many pixels agree with each of planes (P, 3), less behind_penalty for each that lies behind it, out (P);
// positions (3, N) are 1, x and y of pixels, values (N) their disparities.
void support_of(Array<const double, 2> positions, Array<const double, 1> values, Array<const double, 2> planes, double tolerance, double behind_penalty,
                Array<double, 1> out);

}  // namespace sepi
