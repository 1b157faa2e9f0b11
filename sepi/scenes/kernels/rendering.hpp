// Exact rendering of the built-in scenes: planar surfaces, and what rays meet of them.
#pragma once

#include <tuple>

#include "kernels/array.hpp"

namespace sepi {

// Texels that follow those of each row of a texture, as it goes on periodically: as many as a sample reaches.
constexpr Index BEYOND = 3;

// Surfaces, as they are in a view: the fields of sepi.scenes.rendering.Drawing, in their order.
struct Drawing {
    Array<const double, 2> edges;                    // (E, 4): x0, y0, x1, y1
    Array<const std::int64_t, 1> first_edge;         // (P + 1)
    Array<const double, 2> planes;                   // (P, 3): disparity at 0, along x, along y
    Array<const float, 2> texels;                    // (N, 4)
    Array<const std::int64_t, 1> first_texel, side;  // (P)

    auto fields() { return std::tie(edges, first_edge, planes, texels, first_texel, side); }
};

// Disparity and index of the nearest surface at the centre of each pixel, (H, W); -1 for none.
void nearest(const Drawing &drawing, Array<double, 2> disparity, Array<std::int64_t, 2> owner);

// Mean of the textures under all samples of each pixel in the view of baseline (v, u); picture (size, size, 3).
void shade(const Drawing &drawing, double v, double u, Index samples, Array<float, 3> picture);

// Mark the pixels (H, W) whose point is hidden in the view of baseline (v, u), as which surfaces, and boxes (P, 4) round
// them, are given.
void hide(const Drawing &drawing, Array<const double, 2> boxes, Array<const double, 2> disparity, double v, double u, Array<bool, 2> hidden);

// What rays (N, 3) from origin (3) meet first: depths (N) in lengths of the ray, infinite for nothing, and colours (N, 3) of
// the textures there, black for nothing. Surface p lies where normals (P, 3) times a point are 1; edges and boxes are in
// pixels of the view from the world's origin, whose (focal length, x, y) are pinhole.
void cast(const Drawing &drawing, Array<const double, 2> boxes, Array<const double, 2> normals, Array<const double, 1> origin, Array<const double, 2> rays,
          Array<const double, 1> pinhole, Array<double, 1> depth, Array<double, 2> colours);

}  // namespace sepi
