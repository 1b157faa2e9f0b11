// The constrained angular entropy and the constrained adaptive defocus.
#include "kernels/kernel.hpp"

namespace sepi::cae {

constexpr Index LEVELS = 256;  // bins of the histograms, over colours in 0..1
constexpr Index PATCH = 5;     // width of a sub-patch in pixels; the neighbourhood has three by three of them

// Bin of a colour; values beyond 0..1 by resampling go to the first and last bins.
inline std::int16_t level_of(float colour) { return std::int16_t(std::clamp(double(colour) * (LEVELS - 1) + 0.5, 0.0, LEVELS - 1.0)); }

// In double precision, since libraries differ in the last bit of single precision.
inline float logarithm(float x) { return float(std::log(double(x))); }

// Entropy of the weighted histogram of an angular patch (N) of bins; leaves histogram at zero.
float entropy(const std::int16_t *patch, Index N, Index own, Array<const float, 1> weights, float *histogram) {
    float total = 0, mixed = 0;
    const Index reach = weights.shape[0] - 1;
    for (Index n = 0; n < N; ++n) {
        const Index distance = std::abs(patch[n] - own);
        if (distance > reach) continue;
        histogram[patch[n]] += weights(distance);
        total += weights(distance);
    }
    // no view resembles the pixel: entropy of a patch in which all views differ
    if (total <= 0) return logarithm(float(N));
    for (Index level = std::max<Index>(0, own - reach); level <= std::min(own + reach, LEVELS - 1); ++level) {
        float &weight = histogram[level];
        if (weight > 0) mixed += weight * logarithm(weight);
        weight = 0;
    }
    return logarithm(total) - mixed / total;
}

// Entropy of each channel's angular patch, with views weighted by the difference of their level from the reference view's.
// sheared (N, 3, H, W), own (3, H, W) the reference view, weights[d] at a difference of d levels, 0 beyond; out (3, H, W).
void constrained_entropies(Array<const float, 4> sheared, Array<const float, 3> own, Array<const float, 1> weights, Array<float, 3> out) {
    const Index N = sheared.shape[0], C = sheared.shape[1], H = sheared.shape[2], W = sheared.shape[3];
    parallel_for(0, H, [&](Index y) {
        const Scratch<std::int16_t, 2> patches(W, N);
        const auto histogram = zeros<float, 1>(LEVELS);
        for (Index c = 0; c < C; ++c) {
            for (Index n = 0; n < N; ++n) {
                const float *row = sheared.at(n, c, y);
                for (Index x = 0; x < W; ++x) *patches.array().at(x, n) = level_of(row[x]);
            }
            for (Index x = 0; x < W; ++x) out(c, y, x) = entropy(patches.array().at(x), N, level_of(own(c, y, x)), weights, histogram.array().data);
        }
    });
}

// Least weighted mean response of the sub-patches round a pixel, plus the penalty on their colours.
// response (H, W, K), guide (H, W, 3), out (H, W, K). Pictures repeat their border.
void constrained_least_patch(Array<const float, 3> response, Array<const float, 3> guide, float sigma, float constraint, Array<float, 3> out) {
    const Index H = response.shape[0], W = response.shape[1], K = response.shape[2], reach = 3 * PATCH / 2;
    const float scale = float(-1 / (6.0 * double(sigma) * double(sigma)));
    parallel_for(0, H, [&](Index y) {
        const Scratch<float, 1> totals(K);
        float *__restrict total = totals.array().data;
        for (Index x = 0; x < W; ++x) {
            float *__restrict least = out.at(y, x);
            std::fill_n(least, K, INFINITE);
            for (Index part = 0; part < 9; ++part) {
                const Index top = y - reach + part / 3 * PATCH, left = x - reach + part % 3 * PATCH;
                float weights = 0;
                std::fill_n(total, K, 0.0f);
                for (Index n = 0; n < PATCH * PATCH; ++n) {
                    const Index i = clamped(top + n / PATCH, H), j = clamped(left + n % PATCH, W);
                    // a patch without similar pixels still has a mean
                    const float weight = exp_of_negative(std::max(squared_distance(guide.at(i, j), guide.at(y, x)) * scale, -9.0f));
                    const float *costs = response.at(i, j);
                    for (Index k = 0; k < K; ++k) total[k] += weight * costs[k];
                    weights += weight;
                }
                const double added = double(constraint) * (1 - double(weights) / (PATCH * PATCH));
                for (Index k = 0; k < K; ++k) least[k] = std::min(least[k], float(double(total[k] / weights) + added));
            }
        }
    });
}

const Submodule submodule("cae", {{"LEVELS", LEVELS}, {"PATCH", PATCH}, {"constrained_entropies", &constrained_entropies},
                                  {"constrained_least_patch", &constrained_least_patch}});

}  // namespace sepi::cae
