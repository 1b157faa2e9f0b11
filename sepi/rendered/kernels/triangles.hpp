// Which triangles the rays of a view's pixels meet first, and what is painted where they end.
#pragma once

#include <tuple>

#include "kernels/array.hpp"

namespace sepi {

// Planes of triangles, and where on its pattern each is: the fields of sepi.rendered.surfaces.Planes, in their order.
struct Planes {
    Array<const double, 2> corner, normal;  // (M, 3)
    Array<const double, 2> uv;              // (M, 2), of the corner, in periods
    Array<const double, 3> gradient;        // (M, 2, 3), of uv

    auto fields() { return std::tie(corner, normal, uv, gradient); }
};

// What triangles are painted with: the fields of sepi.rendered.surfaces.Paint, in their order.
struct Paint {
    Array<const std::int64_t, 1> thing;   // (M)
    Array<const std::int64_t, 2> starts;  // (things, 3): first texel, height and width of the pattern
    Array<const float, 2> texels;         // (N, 3)

    auto fields() { return std::tie(thing, starts, texels); }
};

// Which of the triangles (M, 3, 3) the ray through the middle of each pixel meets first beyond near, into
// out (size, size), of zeros; the first triangle is nobody's. origin is where the camera is, rotation carries its
// directions (right, down, away) into the world, frame is its focal length in pixels and the row and column of its axis.
// No ray slips through where triangles meet in a side: both compute the same number for it.
void first_met(Array<const double, 3> corners, Array<const double, 1> origin, Array<const double, 2> rotation, Array<const double, 1> frame, double near,
               Array<std::int32_t, 2> out);

// Mean colour, out (N, 3), at the ends of fine by fine rays of each pixel on the plane of its triangle. pixels (N, 2);
// frame is where the camera is (right, down), the row and column that its axis meets, its focal length in pixels.
void painted(Array<const std::int32_t, 1> faces, Strided<const std::int64_t, 2> pixels, Array<const double, 1> frame, const Planes &planes, const Paint &paint,
             Index fine, Array<float, 2> out);

}  // namespace sepi
