// A disparity map warped to another view.
//
// A pixel of a map is a square of a surface. Its middle has the pixel's disparity; a corner has the disparity on which
// the pixels of one surface agree there. Pixels of different surfaces do not share a corner; each continues with its own
// slope. In another view, a square becomes four triangles round its middle. Disparity is linear on each triangle, since
// a plane in one view is a plane in all.
#pragma once

#include "kernels/kernel.hpp"

namespace sepi::carried_map {

constexpr float EMPTY = -1e9f;          // disparity where no surface is seen: nothing is nearer
constexpr float TOLERANCE = 0.1f;       // disparities that differ by no more are of one surface, pixels per view step
constexpr double MOST_STRETCHED = 2;    // surfaces that a view sees larger than this factor are left to other maps
constexpr double TOUCHING = -1e-3;  // share of a triangle by which a pixel may miss it, to leave no cracks between neighbours
constexpr double EDGE_ON = 1e-3;    // share of its own area below which a triangle is seen edge-on, or from behind

// From the middle of a pixel to its corners, clockwise from the top left.
constexpr struct {
    double down, across;
} CORNERS[] = {{-0.5, -0.5}, {-0.5, 0.5}, {0.5, 0.5}, {0.5, -0.5}};

// Slope at pixel i of n, by the neighbour of closer disparity, since the other may lie across a step.
inline float slope(const float *here, Index stride, Index i, Index n) {
    const float back = i > 0 ? here[0] - here[-stride] : 0, ahead = i < n - 1 ? here[stride] - here[0] : 0;
    if (i == 0 || i == n - 1) return i == 0 ? ahead : back;
    return std::abs(back) <= std::abs(ahead) ? back : ahead;
}

struct Point {
    double y, x, disparity;
};

// Draw a triangle of a pixel, clockwise in its own view, into a view's maps.
inline void draw_triangle(Point a, Point b, Point c, std::int32_t pixel, Array<float, 2> nearest, Array<std::int32_t, 2> origin) {
    const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    // in its own view the triangle is a quarter of a pixel
    if (!(0.5 * EDGE_ON < area && area <= 0.5 * MOST_STRETCHED)) return;
    // pixels along an axis of n that the triangle may touch, mostly one or none
    const auto touched = [](double p, double q, double r, Index n) {
        const auto [least, most] = std::minmax({p, q, r});
        return std::pair(std::max(0.0, std::ceil(least - 1e-3)), std::min(double(n - 1), std::floor(most + 1e-3)));
    };
    const auto [top, bottom] = touched(a.y, b.y, c.y, nearest.shape[0]);
    const auto [left, right] = touched(a.x, b.x, c.x, nearest.shape[1]);
    for (double y = top; y <= bottom; ++y) {
        for (double x = left; x <= right; ++x) {
            const double of_b = ((x - a.x) * (c.y - a.y) - (y - a.y) * (c.x - a.x)) / area;
            const double of_c = ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) / area;
            if (of_b < TOUCHING || of_c < TOUCHING || of_b + of_c > 1 - TOUCHING) continue;
            const float d = float(a.disparity + of_b * (b.disparity - a.disparity) + of_c * (c.disparity - a.disparity));
            float &shown = nearest(Index(y), Index(x));
            if (d > shown) shown = d, origin(Index(y), Index(x)) = pixel;
        }
    }
}

// Surfaces of a map in a view at v down and u across from the map's view: nearest disparity (H, W), EMPTY where there is
// none, and number of the map's pixel, or -1. Surfaces that are stretched too much are left out.
inline void carry(Array<const float, 2> disparity, Array<const float, 3> corners, double v, double u, Array<float, 2> nearest,
           Array<std::int32_t, 2> origin) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    for (Index y = 0; y < H; ++y) {
        std::fill_n(nearest.at(y), W, EMPTY);
        std::fill_n(origin.at(y), W, -1);
    }
    const auto seen = [&](double y, double x, double d) { return Point{y - d * v, x - d * u, d}; };
    for (Index y = 0; y < H; ++y) {
        for (Index x = 0; x < W; ++x) {
            const Point middle = seen(double(y), double(x), disparity(y, x));
            if (middle.y < -1 || middle.y > H || middle.x < -1 || middle.x > W) continue;
            const auto at = [&](Index corner) { return seen(y + CORNERS[corner].down, x + CORNERS[corner].across, corners(y, x, corner)); };
            Point before = at(3);
            for (Index corner = 0; corner < 4; ++corner) {
                const Point here = at(corner);
                draw_triangle(middle, before, here, std::int32_t(y * W + x), nearest, origin);
                before = here;
            }
        }
    }
}

}  // namespace sepi::carried_map
