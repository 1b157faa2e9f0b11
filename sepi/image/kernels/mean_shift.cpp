// Mean shift: modes of a distribution near points.
#include "kernels/kernel.hpp"

namespace sepi::mean_shift {

constexpr int ITERATIONS = 5;
// End of the search for a mode: number of iterations, or update relative to the bandwidth.
constexpr int MAX_ITERATIONS = 50;
constexpr double TOLERANCE = 1e-3;

// Colours and disparity of eight pixels.
using Pixels = std::array<Float8, 4>;

Pixels load_pixels(Array<const float, 3> planes, Index y, Index x) {
    return {load(planes.at(0, y, x)), load(planes.at(1, y, x)), load(planes.at(2, y, x)), load(planes.at(3, y, x))};
}

// Disparities of the modes of eight pixels, whose patches begin at (y, x).
Float8 modes_of(Array<const float, 3> planes, Index y, Index x, Index radius) {
    Pixels where = load_pixels(planes, y + radius, x + radius);
    for (int i = 0; i < ITERATIONS; ++i) {
        // sums of weights by the distance of each pixel from the current point
        Float8 total{};
        Pixels sums{};
        for (Index v = y; v <= y + 2 * radius; ++v) {
            for (Index u = x; u <= x + 2 * radius; ++u) {
                const Pixels there = load_pixels(planes, v, u);
                Float8 distance{};
                for (int c = 0; c < 4; ++c) distance = fma(there[c] - where[c], there[c] - where[c], distance);
                const Float8 weight = exp_of_negative(-distance);
                total += weight;
                for (int c = 0; c < 4; ++c) sums[c] = fma(weight, there[c], sums[c]);
            }
        }
        // the pixel itself starts with weight one, so the first total is not 0
        for (int c = 0; c < 4; ++c) where[c] = spread(1e-6f) <= total ? sums[c] / total : where[c];
    }
    return where[3];
}

// Disparity, times unit, of the mode of each pixel of the mask (H, W), into modes (H, W); others stay unchanged.
// planes (4, H + 2 radius, W + 2 radius + room): three colours and disparity in units of their bandwidths, with a margin
// of values like no others.
void patch_modes(Array<const float, 3> planes, Array<const bool, 2> mask, Index radius, float unit, Array<float, 2> modes) {
    const Index W = mask.shape[1];
    parallel_for(0, mask.shape[0], [&](Index y) {
        for (Index x = 0; x < W; x += LANES) {
            const bool *wanted = mask.at(y, x);
            const Index number = std::min<Index>(LANES, W - x);
            if (std::none_of(wanted, wanted + number, [](bool one) { return one; })) continue;
            const Float8 found = modes_of(planes, y, x, radius) * spread(unit);
            for (Index i = 0; i < number; ++i)
                if (wanted[i]) modes(y, x + i) = found[i];
        }
    });
}

// Move each of modes (N, D) to the mode of samples (N, D) that it belongs to.
void sample_modes(Array<const double, 2> samples, double bandwidth, Array<double, 2> modes) {
    const Index N = samples.shape[0], D = samples.shape[1];
    const double factor = -0.5 / (bandwidth * bandwidth);
    parallel_for(0, N, [&](Index n) {
        const Scratch<double, 1> sums(D);
        double *moved = sums.array().data, *mode = modes.at(n);
        for (int i = 0; i < MAX_ITERATIONS; ++i) {
            double total = 0, update = 0;
            std::fill_n(moved, D, 0.0);
            for (Index m = 0; m < N; ++m) {
                const double *sample = samples.at(m);
                double distance = 0;
                for (Index d = 0; d < D; ++d) distance += (sample[d] - mode[d]) * (sample[d] - mode[d]);
                const double weight = std::exp(factor * distance);
                total += weight;
                for (Index d = 0; d < D; ++d) moved[d] += weight * sample[d];
            }
            for (Index d = 0; d < D; ++d) {
                moved[d] /= total;
                update = std::max(update, std::abs(moved[d] - mode[d]));
                mode[d] = moved[d];
            }
            if (update < TOLERANCE * bandwidth) break;
        }
    });
}

const Submodule submodule("mean_shift", {{"patch_modes", &patch_modes}, {"sample_modes", &sample_modes}});

}  // namespace sepi::mean_shift
