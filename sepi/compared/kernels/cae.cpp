#include "cae.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "kernels/exponential.hpp"
#include "kernels/parallel.hpp"
#include "kernels/sampling.hpp"

namespace sepi {
namespace {

// Bin of a colour; what resampling overshoots goes to the last ones.
inline std::int16_t level_of(float colour) { return std::int16_t(std::clamp(double(colour) * (LEVELS - 1) + 0.5, 0.0, LEVELS - 1.0)); }

// Libraries differ in the last bit of single precision, and hardly ever in what a double is rounded to.
inline float logarithm(float x) { return float(std::log(double(x))); }

// Entropy of the weighted histogram of an angular patch (N) of bins; leaves histogram at zero.
float entropy(const std::int16_t *patch, Index N, Index own, Array<const float, 1> weights, float *histogram) {
    float total = 0, mixed = 0;
    std::array<std::uint64_t, LEVELS / 64> filled{};  // a bit for each bin
    for (Index n = 0; n < N; ++n) {
        const Index level = patch[n], distance = std::abs(level - own);
        if (distance >= weights.shape[0]) continue;
        histogram[level] += weights(distance);
        total += weights(distance);
        filled[level / 64] |= std::uint64_t(1) << level % 64;
    }
    // no view is anything like the pixel: as bad as a patch in which all differ
    if (total <= 0) return logarithm(float(N));
    for (Index i = 0; i < LEVELS / 64; ++i) {
        for (std::uint64_t bits = filled[i]; bits; bits &= bits - 1) {
            float &weight = histogram[64 * i + std::countr_zero(bits)];
            if (weight > 0) mixed += weight * logarithm(weight);
            weight = 0;
        }
    }
    return logarithm(total) - mixed / total;
}

// The pixels of a sub-patch: what each of K candidates costs there, and weights.
struct Patch {
    std::array<const float *, PATCH * PATCH> costs;
    std::array<float, PATCH * PATCH> weights;

    // Weights by how near colours are to the centre's.
    Patch(Array<const float, 3> response, Array<const float, 3> guide, Index top, Index left, const float *centre, float scale) {
        for (Index n = 0; n < PATCH * PATCH; ++n) {
            const Index y = clamped(top + n / PATCH, response.shape[0]), x = clamped(left + n % PATCH, response.shape[1]);
            const float *colour = guide.at(y, x);
            costs[n] = response.at(y, x);
            const float r = colour[0] - centre[0], g = colour[1] - centre[1], b = colour[2] - centre[2];
            weights[n] = r * r + g * g + b * b;
        }
        // a patch of nothing alike still has a mean
        for (float &weight : weights) weight = exp_of_negative(std::max(weight * scale, -9.0f));
    }

    // Weighted sums of the costs, of so many candidates at a time; some of them twice where their number is no multiple.
    template <Index BLOCK>
    void add_up(Index K, float *__restrict out) const {
        for (Index begin = 0; begin < K; begin += BLOCK) {
            const Index first = std::min(begin, K - BLOCK);
            std::array<float, BLOCK> sums{};
            for (Index n = 0; n < PATCH * PATCH; ++n)
                for (Index k = 0; k < BLOCK; ++k) sums[k] += weights[n] * costs[n][first + k];
            std::copy_n(sums.data(), BLOCK, out + first);
        }
    }
};

}  // namespace

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

void constrained_least_patch(Array<const float, 3> response, Array<const float, 3> guide, float sigma, float constraint, Array<float, 3> out) {
    const Index H = response.shape[0], W = response.shape[1], K = response.shape[2], reach = 3 * PATCH / 2;
    const float scale = float(-1 / (6.0 * double(sigma) * double(sigma)));
    parallel_for(0, H, [&](Index y) {
        const Scratch<float, 1> totals(K);
        float *__restrict total = totals.array().data;
        for (Index x = 0; x < W; ++x) {
            float *__restrict least = out.at(y, x);
            std::fill_n(least, K, std::numeric_limits<float>::infinity());
            for (Index part = 0; part < 9; ++part) {
                const Index top = y - reach + part / 3 * PATCH, left = x - reach + part % 3 * PATCH;
                const Patch patch(response, guide, top, left, guide.at(y, x), scale);
                K >= 32 ? patch.add_up<32>(K, total) : K >= 8 ? patch.add_up<8>(K, total) : patch.add_up<1>(K, total);
                const float weights = std::accumulate(patch.weights.begin(), patch.weights.end(), 0.0f);
                const double added = double(constraint) * (1 - double(weights) / (PATCH * PATCH));
                for (Index k = 0; k < K; ++k) least[k] = std::min(least[k], float(double(total[k] / weights) + added));
            }
        }
    });
}

}  // namespace sepi
