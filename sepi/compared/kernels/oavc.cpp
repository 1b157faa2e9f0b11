#include "oavc.hpp"

#include <limits>
#include <vector>

#include "angular_patches.hpp"
#include "kernels/parallel.hpp"

namespace sepi {
namespace {

// Calls body(n, x, deviation) with the mean difference of the channels of each view that has a vote.
template <class Body>
void for_deviations(Array<const float, 4> sheared, Index reference, Index y, const Body &body) {
    for_differences(sheared, sheared[reference], reference, y, [=](Index n, Index x, float red, float green, float blue) {
        body(n, x, (std::abs(red) + std::abs(green) + std::abs(blue)) * float(1.0 / 3));
    });
}

}  // namespace

void lower_thresholds(Array<const float, 4> sheared, Index reference, Index needed, Array<float, 2> thresholds) {
    const Index N = sheared.shape[0], W = sheared.shape[3];
    parallel_for(0, sheared.shape[2], [&](Index y) {
        const auto all = Scratch<float, 2>(N, W).filled(std::numeric_limits<float>::infinity());
        const auto agreeing = zeros<std::int32_t, 1>(W);
        std::vector<float> patch(N);
        float *threshold = thresholds.at(y), *deviations = all.array().data;
        std::int32_t *number = agreeing.array().data;
        for_deviations(sheared, reference, y, [=](Index n, Index x, float deviation) {
            deviations[n * W + x] = deviation;
            number[x] += deviation < threshold[x];
        });
        for (Index x = 0; x < W; ++x) {
            // few pixels: the thresholds soon are as low as most candidates leave them
            if (number[x] < needed) continue;
            for (Index n = 0; n < N; ++n) patch[n] = all.array()(n, x);
            std::nth_element(patch.begin(), patch.begin() + needed - 1, patch.end());
            threshold[x] = patch[needed - 1];
        }
    });
}

void vote_costs(Array<const float, 4> sheared, Index reference, Array<const float, 2> thresholds, Array<float, 2> out) {
    const Index W = sheared.shape[3];
    parallel_for(0, sheared.shape[2], [&](Index y) {
        const auto rows = zeros<float, 2>(2, W);
        float *votes = rows.array().at(0), *total = rows.array().at(1);
        const float *threshold = thresholds.at(y);
        for_deviations(sheared, reference, y, [=](Index, Index x, float deviation) {
            const bool agrees = deviation <= threshold[x];
            votes[x] += agrees ? 1.0f : 0.0f;
            total[x] += agrees ? deviation : 0.0f;
        });
        for (Index x = 0; x < W; ++x) {
            const float mean = total[x] / (std::max(votes[x], 1.0f) * threshold[x]);
            out(y, x) = 1 - (votes[x] - mean) / float(sheared.shape[0] - 1);
        }
    });
}

}  // namespace sepi
