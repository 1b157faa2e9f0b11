// Which triangles the rays of a view's pixels meet first.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Which of the triangles (M, 3, 3) the ray through the middle of each pixel meets first beyond near, into
// out (size, size), of zeros; the first triangle is nobody's. origin is where the camera is, rotation carries its
// directions (right, down, away) into the world, frame is its focal length in pixels and the row and column of its axis.
// No ray slips through where triangles meet in a side: both compute the same number for it.
void first_met(Array<const double, 3> corners, Array<const double, 1> origin, Array<const double, 2> rotation, Array<const double, 1> frame, double near,
               Array<std::int32_t, 2> out);

}  // namespace sepi
