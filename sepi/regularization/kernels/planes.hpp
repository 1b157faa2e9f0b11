// Planes of superpixels. labels (H W) say whose a pixel is, design (H W, 3) is each plane parameter's value there.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Weighted least squares of each superpixel's data, in the order of the pixels, added to left (N, 3, 3) and
// right (N, 3) of zeros; weight and disparity (H W).
void add_normal_equations(Array<const std::int64_t, 1> labels, Array<const double, 2> design, Array<const float, 1> weight, Array<const float, 1> disparity,
                          Array<double, 3> left, Array<double, 2> right);

// Disparity of every pixel by the plane of its superpixel, out (H W); planes (N, 3).
void values_of_planes(Array<const std::int64_t, 1> labels, Array<const double, 2> design, Array<const double, 2> planes, Array<float, 1> out);

}  // namespace sepi
