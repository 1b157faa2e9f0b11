#include "sheared_views.hpp"

#include <cmath>

#include "kernels/parallel.hpp"
#include "kernels/sampling.hpp"

namespace sepi {
namespace {

// Where the samples of a line lie: whole pixels on, and the weights of the pixels at -1, 0, 1 and 2 from there.
struct Shift {
    Index whole;
    std::array<float, 4> weights;

    Shift(double offset, bool cubic) : whole(Index(std::floor(offset))) {
        const double f = offset - double(whole);
        weights = cubic ? cubic_weights(f) : std::array{0.0f, float(1.0 - f), float(f), 0.0f};
    }

    float sum(float a, float b, float c, float d) const { return weights[0] * a + weights[1] * b + weights[2] * c + weights[3] * d; }
};

// A row, at the same fraction of a pixel everywhere.
void shift_row(const float *row, Index W, const Shift &shift, float *__restrict out) {
    // samples whose four pixels are in the row
    const Index begin = std::clamp<Index>(1 - shift.whole, 0, W), end = std::max(begin, std::min(W, W - 2 - shift.whole));
    const auto near_ends = [&](Index first, Index last) {
        for (Index x = first; x < last; ++x) {
            const auto pixel = [&](Index k) { return row[clamped(x + shift.whole + k, W)]; };
            out[x] = shift.sum(pixel(-1), pixel(0), pixel(1), pixel(2));
        }
    };
    near_ends(0, begin);
    const float *from = row + shift.whole;
    for (Index x = begin; x < end; ++x) out[x] = shift.sum(from[x - 1], from[x], from[x + 1], from[x + 2]);
    near_ends(end, W);
}

}  // namespace

void shear(Array<const float, 4> views, Strided<const double, 2> offsets, bool cubic, Array<float, 4> out) {
    const Index C = views.shape[1], H = views.shape[2], W = views.shape[3];
    parallel_for(0, views.shape[0], [&](Index n) {
        const Shift down(offsets(n, 0), cubic), across(offsets(n, 1), cubic);
        const Scratch<float, 1> between(W);
        float *__restrict row = between.array().data;
        for (Index c = 0; c < C; ++c) {
            for (Index y = 0; y < H; ++y) {
                const auto pixels = [&](Index k) { return views.at(n, c, clamped(y + down.whole + k, H)); };
                const float *above = pixels(-1), *here = pixels(0), *below = pixels(1), *beyond = pixels(2);
                for (Index x = 0; x < W; ++x) row[x] = down.sum(above[x], here[x], below[x], beyond[x]);
                shift_row(row, W, across, out.at(n, c, y));
            }
        }
    });
}

}  // namespace sepi
