// The maps of all views, made of those of some.
//
// A pixel of a map is a square of a surface: its middle has the pixel's disparity, each corner what the pixels that
// meet there, and belong together, agree on. Where they do not, the corner comes apart, each pixel going on by its own
// slope. Seen from another view, a square becomes four triangles round its middle; disparity is linear on each of them,
// since a plane in one view is a plane in all.
#pragma once

#include <tuple>

#include "kernels/array.hpp"

namespace sepi {

constexpr float EMPTY = -1e9f;          // disparity where no surface is seen: nothing is nearer
constexpr float TOLERANCE = 0.1f;       // disparities that differ by no more are of one surface, pixels per view step
constexpr double MOST_STRETCHED = 2;    // a surface that a view sees so many times larger is left to maps that saw it better
constexpr float LEAST_WEIGHT = 0.05f;   // vote of a map where its confidence is 0: beside depth steps all are small, and there they differ

// The maps that are carried: the fields of sepi.applications.all_views.Sources, in their order.
struct Sources {
    Array<const float, 3> disparity, confidence;  // (N, H, W)
    Array<const float, 4> bars;                   // (N or 0, H, W, 3)
    Array<const float, 4> corners;                // (N, H, W, 4)
    Array<const double, 2> baselines;             // (N, 2)

    auto fields() { return std::tie(disparity, confidence, bars, corners, baselines); }
};

// Disparity at the corners of each pixel of a map (H, W), clockwise from the top left, out (H, W, 4). Pixels that meet
// in a corner belong together where what they say of it differs by no more than the tolerance.
void corner_disparities(Array<const float, 2> disparity, Array<float, 3> out);

// The surfaces of a map as a view sees them that stands v down and u across from the map's: the nearest disparity
// (H, W), EMPTY where there is none, and the number of the map's pixel that is seen, or -1. What it sees stretched too
// much is left out.
void carry(Array<const float, 2> disparity, Array<const float, 3> corners, double v, double u, Array<float, 2> nearest, Array<std::int32_t, 2> origin);

// The maps (V, H, W) of views with baselines (V, 2), bars (V, H, W, 3) where the sources have them, and where no source
// shows anything and the background was extended.
void maps_of_views(const Sources &sources, Array<const double, 2> baselines, Array<float, 3> disparity, Array<float, 3> confidence, Array<float, 4> bars,
                   Array<bool, 3> extended);

}  // namespace sepi
