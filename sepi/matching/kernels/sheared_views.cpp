// Whole views, moved by fractions of a pixel.
#include "kernels/kernel.hpp"

namespace sepi::sheared_views {

// Samples of a line: offset in whole pixels, and weights of the pixels at -1, 0, 1 and 2 from there.
struct Shift {
    Index whole;
    std::array<float, 4> weights;

    Shift(double offset, bool cubic) : whole(Index(std::floor(offset))) {
        const double f = offset - double(whole);
        weights = cubic ? cubic_weights(f) : std::array{0.0f, float(1.0 - f), float(f), 0.0f};
    }

    float sum(float a, float b, float c, float d) const { return weights[0] * a + weights[1] * b + weights[2] * c + weights[3] * d; }
};

// out[n, c, y, x] = views[n, c, y + offsets[n, 0], x + offsets[n, 1]]; views and out (N, C, H, W), offsets (N, 2).
// Samples between pixels by cubic convolution, or bilinear; views repeat their border.
void shear(Array<const float, 4> views, Strided<const double, 2> offsets, bool cubic, Array<float, 4> out) {
    const Index C = views.shape[1], H = views.shape[2], W = views.shape[3];
    parallel_for(0, views.shape[0], [&](Index n) {
        const Shift down(offsets(n, 0), cubic), across(offsets(n, 1), cubic);
        // pixels of a row that samples use: one before the first, and two after the last
        const Index first = std::clamp<Index>(1 - across.whole, 0, W + 3), last = std::clamp<Index>(W + 1 - across.whole, first, W + 3);
        const Scratch<float, 1> between(W), around(W + 3);
        float *__restrict row = between.array().data, *__restrict pixel = around.array().data;
        for (Index c = 0; c < C; ++c) {
            for (Index y = 0; y < H; ++y) {
                const auto pixels = [&](Index k) { return views.at(n, c, clamped(y + down.whole + k, H)); };
                const float *above = pixels(-1), *here = pixels(0), *below = pixels(1), *beyond = pixels(2);
                for (Index x = 0; x < W; ++x) row[x] = down.sum(above[x], here[x], below[x], beyond[x]);
                std::fill_n(pixel, first, row[0]);
                std::fill(std::copy_n(row + first + across.whole - 1, last - first, pixel + first), pixel + W + 3, row[W - 1]);
                float *target = out.at(n, c, y);
                for (Index x = 0; x < W; ++x) target[x] = across.sum(pixel[x], pixel[x + 1], pixel[x + 2], pixel[x + 3]);
            }
        }
    });
}

const Submodule submodule("sheared_views", {{"shear", &shear}});

}  // namespace sepi::sheared_views
