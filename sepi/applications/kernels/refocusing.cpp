// Pictures in focus everywhere, and pictures of the views between the views.
#include <cmath>

#include "kernels/arguments.hpp"
#include "kernels/parallel.hpp"
#include "kernels/sampling.hpp"

namespace sepi::refocusing {
namespace {

// Pixels of a box at most: views whose pictures of a point are farther apart show it more than once.
constexpr float WIDEST = 17;

// Over which a point moves while the camera moves through its cell, pixels.
struct Box {
    float height, width;

    Box(float off, Array<const float, 1> cell) : height(of(off * cell(0))), width(of(off * cell(1))) {}

    static float of(float length) { return std::min(WIDEST, std::max(1.0f, length)); }

    // Share of it that falls on a pixel this far away.
    double share(Index dy, Index dx) const {
        const auto part = [](float length, Index d) { return std::min(1.0, std::max(0.0, double(0.5f * length + 0.5f) - double(std::abs(d)))); };
        return part(height, dy) * part(width, dx) / double(height * width);
    }
};

// Add what a view (H, W, 1 or 3), v down and u across from the reference view, shows of each pixel that it sees: to sums
// (H, W, 1 or 3) weighted differences from the expected colour, centre, and to weights (H, W) the weights. Pixels whose
// disparity is NaN get nothing, nor those before which the view shows something nearer by more than the margin. A colour
// whose squared difference from the expected one, over the channels, is scale2 counts a quarter.
void add_view(Array<const float, 3> view, double v, double u, Array<const float, 2> disparity, Array<const float, 2> nearest, float margin,
              Array<const float, 3> centre, float scale2, Array<float, 3> sums, Array<float, 2> weights) {
    const Index H = view.shape[0], W = view.shape[1];
    const auto add = [&]<Index C>(std::integral_constant<Index, C>, Index y, Index x) {
        const float d = disparity(y, x);
        const auto place = place_within(y - d * v, x - d * u, H, W);
        if (!place) return;
        if (!all_about(*place, [&](Index i, Index j) { return nearest(i, j) <= d + margin; })) return;
        const auto down = cubic_weights(place->fy), across = cubic_weights(place->fx);
        const float *expected = centre.at(y, x);
        float found[C] = {}, z = 0;
        for (Index i = 0; i < 4; ++i) {
            float part[C] = {};
            for (Index j = 0; j < 4; ++j) {
                const float *pixel = view.at(clamped(place->row + i - 1, H), clamped(place->column + j - 1, W));
                // exactly 0 where all pixels are as expected
                for (Index c = 0; c < C; ++c) part[c] += across[j] * (pixel[c] - expected[c]);
            }
            for (Index c = 0; c < C; ++c) found[c] += down[i] * part[c];
        }
        for (Index c = 0; c < C; ++c) z += found[c] * found[c];
        const float ratio = scale2 / (scale2 + z), weight = ratio * ratio;
        for (Index c = 0; c < C; ++c) sums(y, x, c) += weight * found[c];
        weights(y, x) += weight;
    };
    parallel_for_pixels(H, W, [&](Index y, Index x) {
        view.shape[2] == 1 ? add(std::integral_constant<Index, 1>(), y, x) : add(std::integral_constant<Index, 3>(), y, x);
    });
}

// A view (C, H, W), sheared by the disparity focus, as the mean of all that could be taken in its cell of the aperture,
// so many view steps high and wide. While the camera moves through the cell, each point moves over a box: its
// disparity's distance from the focus, times the cell. What is nearer by more than the margin covers a pixel for the
// share of the cell in which it is before it. Surfaces (H, W): disparities of what the view shows, finite.
void fill_between(Array<const float, 3> sheared, Array<const float, 2> surfaces, float focus, Array<const float, 1> cell, float margin, Array<float, 3> out) {
    const Index C = sheared.shape[0], H = sheared.shape[1], W = sheared.shape[2];
    const auto box = [&](float disparity) { return Box(std::abs(disparity - focus), cell); };
    float farthest = 0;
    for (Index y = 0; y < H; ++y)
        for (Index x = 0; x < W; ++x) farthest = std::max(farthest, std::abs(surfaces(y, x) - focus));
    const Box largest(farthest, cell);
    const Index rows = Index(std::ceil(0.5f * largest.height - 0.5f)), columns = Index(std::ceil(0.5f * largest.width - 0.5f));
    parallel_for(0, H, [&](Index y) {
        // colours and shares of what is nearer, and of all else
        const Scratch<float, 2> sums(2, C + 1);
        float *near = sums.array().at(0), *rest = sums.array().at(1);
        for (Index x = 0; x < W; ++x) {
            std::fill_n(near, 2 * (C + 1), 0.0f);
            const float own = surfaces(y, x);
            const Box own_box = box(own);
            for (Index i = std::max<Index>(0, y - rows); i < std::min(H, y + rows + 1); ++i) {
                for (Index j = std::max<Index>(0, x - columns); j < std::min(W, x + columns + 1); ++j) {
                    const float other = surfaces(i, j);
                    // what is behind shows where the pixel's own surface moves away
                    const double share = (other < own - margin ? own_box : box(other)).share(i - y, j - x);
                    if (!(share > 0)) continue;
                    float *total = other > own + margin ? near : rest;
                    for (Index c = 0; c < C; ++c) total[c] = float(total[c] + share * sheared(c, i, j));
                    total[C] = float(total[C] + share);
                }
            }
            const float hidden = std::min(1.0f, near[C]);
            for (Index c = 0; c < C; ++c) {
                out(c, y, x) = (1 - hidden) * rest[c] / rest[C];
                if (near[C] > 0) out(c, y, x) += hidden * near[c] / near[C];
            }
        }
    });
}

const Submodule submodule("refocusing", [](nb::module_ &m) {
    m.attr("WIDEST") = WIDEST;
    m.def("add_view", &add_view, Unlocked(), "view"_a, "v"_a, "u"_a, "disparity"_a, "nearest"_a, "margin"_a, "centre"_a, "scale2"_a,
          "sums"_a, "weights"_a);
    m.def("fill_between", &fill_between, Unlocked(), "sheared"_a, "surfaces"_a, "focus"_a, "cell"_a, "margin"_a, "out"_a);
});

}  // namespace
}  // namespace sepi::refocusing
