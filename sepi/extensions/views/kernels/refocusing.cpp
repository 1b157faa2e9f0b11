// Pictures in focus everywhere, and refocused pictures with views interpolated between the views.
#include "kernels/kernel.hpp"

namespace sepi::refocusing {

// Largest box in pixels; views farther apart show a point more than once.
constexpr float WIDEST = 17;

// Range of a point's movement while the camera moves through its cell, pixels.
struct Box {
    float height, width;

    Box(float off, Array<const float, 1> cell) : height(of(off * cell(0))), width(of(off * cell(1))) {}

    static float of(float length) { return std::min(WIDEST, std::max(1.0f, length)); }

    // Share of the range on a pixel at this distance.
    double share(Index dy, Index dx) const {
        const auto part = [](float length, Index d) { return std::min(1.0, std::max(0.0, double(0.5f * length + 0.5f) - double(std::abs(d)))); };
        return part(height, dy) * part(width, dx) / double(height * width);
    }
};

// Add the samples of a view (H, W, 1 or 3), at v down and u across from the reference view, for each pixel that it sees:
// weighted differences from the expected colour, centre, to sums (H, W, 1 or 3), and weights to weights (H, W). Pixels
// with disparity NaN, or occluded in the view by more than the margin, get nothing. A colour whose squared difference
// from the expected one, over the channels, is scale2 counts a quarter.
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
                // exactly 0 if all pixels are as expected
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

// Mean of all views in a cell of the aperture, from the cell's view (C, H, W) sheared by the disparity focus; the cell
// is measured in view steps. While the camera moves through the cell, each point moves over a box of the size of the
// cell times its disparity relative to the focus. Surfaces nearer by more than the margin cover a pixel for a share of
// the cell. surfaces (H, W): finite disparities of the view.
void fill_between(Array<const float, 3> sheared, Array<const float, 2> surfaces, float focus, Array<const float, 1> cell, float margin, Array<float, 3> out) {
    const Index C = sheared.shape[0], H = sheared.shape[1], W = sheared.shape[2];
    const auto box = [&](float disparity) { return Box(std::abs(disparity - focus), cell); };
    float farthest = 0;
    for (Index y = 0; y < H; ++y)
        for (Index x = 0; x < W; ++x) farthest = std::max(farthest, std::abs(surfaces(y, x) - focus));
    const Box largest(farthest, cell);
    const Index rows = Index(std::ceil(0.5f * largest.height - 0.5f)), columns = Index(std::ceil(0.5f * largest.width - 0.5f));
    parallel_for(0, H, [&](Index y) {
        // colours and shares of nearer surfaces, and of the others
        const Scratch<float, 2> sums(2, C + 1);
        float *near = sums.array().at(0), *rest = sums.array().at(1);
        for (Index x = 0; x < W; ++x) {
            std::fill_n(near, 2 * (C + 1), 0.0f);
            const float own = surfaces(y, x);
            const Box own_box = box(own);
            for (Index i = std::max<Index>(0, y - rows); i < std::min(H, y + rows + 1); ++i) {
                for (Index j = std::max<Index>(0, x - columns); j < std::min(W, x + columns + 1); ++j) {
                    const float other = surfaces(i, j);
                    // the background shows where the pixel's own surface moves away
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

const Submodule submodule("refocusing", {{"WIDEST", WIDEST}, {"add_view", &add_view}, {"fill_between", &fill_between}});

}  // namespace sepi::refocusing
