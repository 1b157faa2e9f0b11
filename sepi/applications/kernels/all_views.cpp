// Maps of all views, made from maps of a few.
//
// A pixel of a map is a square of a surface. Its middle has the pixel's disparity; a corner has the disparity on which
// the pixels of one surface agree there. Pixels of different surfaces do not share a corner; each continues with its own
// slope. In another view, a square becomes four triangles round its middle. Disparity is linear on each triangle, since
// a plane in one view is a plane in all.
#include <cmath>
#include <vector>

#include "kernels/arguments.hpp"
#include "kernels/parallel.hpp"
#include "kernels/sampling.hpp"

namespace sepi::all_views {
namespace {

constexpr float EMPTY = -1e9f;          // disparity where no surface is seen: nothing is nearer
constexpr float TOLERANCE = 0.1f;       // disparities that differ by no more are of one surface, pixels per view step
constexpr double MOST_STRETCHED = 2;    // surfaces that a view sees larger than this factor are left to other maps
constexpr float LEAST_WEIGHT = 0.05f;   // vote of a map with confidence 0: where maps differ, beside depth steps, all confidences are low

// The maps that are carried: the fields of sepi.applications.all_views.Sources, in their order.
struct Sources {
    Array<const float, 3> disparity, confidence;  // (N, H, W)
    Array<const float, 4> bars;                   // (N or 0, H, W, 3)
    Array<const float, 4> corners;                // (N, H, W, 4)
    Array<const double, 2> baselines;             // (N, 2)

    bool fields(auto visit) { return visit(disparity, confidence, bars, corners, baselines); }
};

constexpr double TOUCHING = -1e-3;  // share of a triangle by which a pixel may miss it, to leave no cracks between neighbours
constexpr double EDGE_ON = 1e-3;    // share of its own area below which a triangle is seen edge-on, or from behind
constexpr float FARTHER = 1e9f;     // above all disparities

// From the middle of a pixel to its corners, clockwise from the top left.
constexpr struct {
    double down, across;
} CORNERS[] = {{-0.5, -0.5}, {-0.5, 0.5}, {0.5, 0.5}, {0.5, -0.5}};

// Slope at pixel i of n, by the neighbour of closer disparity, since the other may lie across a step.
float slope(const float *here, Index stride, Index i, Index n) {
    const float back = i > 0 ? here[0] - here[-stride] : 0, ahead = i < n - 1 ? here[stride] - here[0] : 0;
    if (i == 0 || i == n - 1) return i == 0 ? ahead : back;
    return std::abs(back) <= std::abs(ahead) ? back : ahead;
}

struct Point {
    double y, x, disparity;
};

// Draw a triangle of a pixel, clockwise in its own view, into a view's maps.
void draw_triangle(Point a, Point b, Point c, std::int32_t pixel, Array<float, 2> nearest, Array<std::int32_t, 2> origin) {
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
void carry(Array<const float, 2> disparity, Array<const float, 3> corners, double v, double u, Array<float, 2> nearest,
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

// Maps warped to a view at v down and u across from the reference view, and their fusion.
struct Fusion {
    const Sources &sources;
    const double v, u;

    // A map's disparity at a pixel of the view.
    struct Shown {
        float disparity, confidence, weight;
        const float *bars;
    };

    const Index N = sources.disparity.shape[0], H = sources.disparity.shape[1], W = sources.disparity.shape[2];
    const Scratch<float, 3> nearest{N, H, W};
    const Scratch<std::int32_t, 3> origin{N, H, W};
    std::vector<Shown> maps = std::vector<Shown>(N);
    std::vector<float> closeness = std::vector<float>(N);

    double down(Index n) const { return v - sources.baselines(n, 0); }
    double across(Index n) const { return u - sources.baselines(n, 1); }

    // EMPTY where none shows anything.
    void fuse(Array<float, 2> disparity, Array<float, 2> confidence, Array<float, 3> bars) {
        for (Index n = 0; n < N; ++n) {
            closeness[n] = float(1 / (1 + std::hypot(down(n), across(n))));
            carry(sources.disparity[n], sources.corners[n], down(n), across(n), nearest.array()[n], origin.array()[n]);
        }
        for (Index y = 0; y < H; ++y) {
            for (Index x = 0; x < W; ++x) {
                for (Index n = 0; n < N; ++n) maps[n] = shown(n, y, x);
                const float best = best_disparity(y, x);
                // mean of the maps that agree with the best
                float total = 0, belief = 0, weight = 0, sums[3] = {};
                for (const Shown &map : maps) {
                    if (!(map.disparity > EMPTY) || std::abs(map.disparity - best) > TOLERANCE) continue;
                    total += map.weight * (map.disparity - best);
                    belief += map.weight * map.confidence;
                    weight += map.weight;
                    // errors of one light field's maps are correlated, so the mean is no surer than each map
                    for (Index k = 0; map.bars && k < 3; ++k) sums[k] += map.weight * map.bars[k];
                }
                disparity(y, x) = weight > 0 ? best + total / weight : EMPTY;
                confidence(y, x) = weight > 0 ? belief / weight : 0;
                for (Index k = 0; sources.bars.shape[0] > 0 && k < 3; ++k) bars(y, x, k) = weight > 0 ? sums[k] / weight : 0;
            }
        }
    }

    Shown shown(Index n, Index y, Index x) const {
        const std::int32_t pixel = origin.array()(n, y, x);
        const Index row = pixel / std::int32_t(W), column = pixel % std::int32_t(W);
        const float believed = pixel >= 0 ? sources.confidence(n, row, column) : 0;
        const float *bars = pixel >= 0 && sources.bars.shape[0] > 0 ? sources.bars.at(n, row, column) : nullptr;
        return {nearest.array()(n, y, x), believed, closeness[n] * (LEAST_WEIGHT + believed), bars};
    }

    // The disparity with most votes, if maps differ.
    float best_disparity(Index y, Index x) const {
        float low = FARTHER, high = EMPTY, most = -FARTHER;
        for (const Shown &map : maps)
            if (map.disparity > EMPTY) low = std::min(low, map.disparity), high = std::max(high, map.disparity);
        if (!(high > low + TOLERANCE)) return high;
        float best = high;
        for (const Shown &map : maps) {
            if (!(map.disparity > EMPTY)) continue;
            if (const float found = score(y, x, map.disparity); found > most) best = map.disparity, most = found;
        }
        return best;
    }

    // Sum of the weights of maps that show a surface, minus those of maps that see through it.
    float score(Index y, Index x, float d) const {
        float sum = 0;
        for (Index n = 0; n < N; ++n) {
            if (std::abs(maps[n].disparity - d) <= TOLERANCE) {
                sum += maps[n].weight;
            } else if (maps[n].disparity < d) {
                // it shows the background where it would show the surface
                const auto place = place_within(y + d * down(n), x + d * across(n), H, W);
                const auto is_behind = [&](Index i, Index j) { return sources.disparity(n, i, j) < d - TOLERANCE; };
                if (place && all_about(*place, is_behind)) sum -= maps[n].weight;
            }
        }
        return sum;
    }
};

// Fill EMPTY pixels with the farther of the two surfaces beside them along the view's baseline, along which gaps open.
void extend_background(double v, double u, Array<float, 2> disparity, Array<bool, 2> extended) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const double longest = std::max(std::abs(v), std::abs(u));
    const double down = longest > 0 ? v / longest : 0, across = longest > 0 ? u / longest : 1;
    for (Index y = 0; y < H; ++y)
        for (Index x = 0; x < W; ++x) extended(y, x) = !(disparity(y, x) > EMPTY);
    // the first known disparity in a direction from a pixel, or FARTHER; halves are rounded away from the pixel
    const auto first_along = [&](Index y, Index x, double dy, double dx) {
        for (Index steps = 1;; ++steps) {
            const Index row = y + Index(std::round(steps * dy)), column = x + Index(std::round(steps * dx));
            if (row < 0 || column < 0 || row >= H || column >= W) return FARTHER;
            if (!extended(row, column)) return disparity(row, column);
        }
    };
    for (Index y = 0; y < H; ++y) {
        for (Index x = 0; x < W; ++x) {
            if (!extended(y, x)) continue;
            const auto both = [&](double dy, double dx) { return std::min(first_along(y, x, dy, dx), first_along(y, x, -dy, -dx)); };
            // across the baseline only if there is none along it
            float found = both(down, across);
            if (found == FARTHER) found = both(across, -down);
            disparity(y, x) = found < FARTHER ? found : 0;
        }
    }
}

// Disparity at the corners of each pixel of a map (H, W), clockwise from the top left, out (H, W, 4). Pixels that meet
// in a corner belong to one surface if their disparities there differ by at most the tolerance.
void corner_disparities(Array<const float, 2> disparity, Array<float, 3> out) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const Scratch<float, 3> slopes(2, H, W);
    const auto said = [&](Index y, Index x, auto down, auto across) {
        return disparity(y, x) + slopes.array()(0, y, x) * down + slopes.array()(1, y, x) * across;
    };
    parallel_for_pixels(H, W, [&](Index y, Index x) {
        slopes.array()(0, y, x) = slope(disparity.at(y, x), disparity.strides[0], y, H);
        slopes.array()(1, y, x) = slope(disparity.at(y, x), 1, x, W);
    });
    parallel_for_pixels(H, W, [&](Index y, Index x) {
        for (Index corner = 0; corner < 4; ++corner) {
            const auto [down, across] = CORNERS[corner];
            const double mine = said(y, x, down, across);
            float total = 0, count = 0;
            // in the order of rows, so that all pixels at a corner get the same sum
            for (const Index i : {y + (down > 0) - 1, y + (down > 0)}) {
                for (const Index j : {x + (across > 0) - 1, x + (across > 0)}) {
                    if (i < 0 || j < 0 || i >= H || j >= W) continue;
                    const float value = said(i, j, float(y - i) + float(down), float(x - j) + float(across));
                    if (std::abs(value - mine) <= TOLERANCE) total += value, ++count;
                }
            }
            out(y, x, corner) = count > 0 ? total / count : float(mine);
        }
    });
}

// Maps (V, H, W) of views with baselines (V, 2), bars (V, H, W, 3) if the sources have them, and mask of pixels that no
// source shows, filled with the background.
void maps_of_views(const Sources &sources, Array<const double, 2> baselines, Array<float, 3> disparity, Array<float, 3> confidence, Array<float, 4> bars,
                   Array<bool, 3> extended) {
    parallel_for(0, baselines.shape[0], [&](Index view) {
        const double v = baselines(view, 0), u = baselines(view, 1);
        Fusion{sources, v, u}.fuse(disparity[view], confidence[view], bars[view]);
        // gaps lie along the baseline from the reference view, whose map covers most of the view
        extend_background(v, u, disparity[view], extended[view]);
    });
}

const Submodule submodule("all_views", [](nb::module_ &m) {
    m.attr("EMPTY") = EMPTY;
    m.attr("TOLERANCE") = TOLERANCE;
    m.def("corner_disparities", &corner_disparities, Unlocked(), "disparity"_a, "out"_a);
    m.def("carry", &carry, Unlocked(), "disparity"_a, "corners"_a, "v"_a, "u"_a, "nearest"_a, "origin"_a);
    m.def("maps_of_views", &maps_of_views, Unlocked(), "sources"_a, "baselines"_a, "disparity"_a, "confidence"_a, "bars"_a, "extended"_a);
});

}  // namespace
}  // namespace sepi::all_views
