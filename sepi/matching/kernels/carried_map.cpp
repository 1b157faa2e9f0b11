// A disparity map warped to another view, in Python.
#include "carried_map.hpp"

namespace sepi::carried_map {

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

const Submodule submodule("carried_map", {
    {"EMPTY", EMPTY},
    {"TOLERANCE", TOLERANCE},
    {"corner_disparities", &corner_disparities},
    {"carry", &carry},
});

}  // namespace sepi::carried_map
