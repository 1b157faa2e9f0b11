#include "oavc.hpp"

#include <cmath>
#include <limits>

#include "kernels/parallel.hpp"

namespace sepi {
namespace {

// Row y of a view.
struct Row {
    const float *red, *green, *blue;

    Row(Array<const float, 4> sheared, Index n, Index y) : red(sheared.at(n, 0, y)), green(sheared.at(n, 1, y)), blue(sheared.at(n, 2, y)) {}

    // Mean difference of the channels from another one at a pixel.
    float deviation(const Row &from, Index x) const {
        return (std::abs(red[x] - from.red[x]) + std::abs(green[x] - from.green[x]) + std::abs(blue[x] - from.blue[x])) * float(1.0 / 3);
    }
};

}  // namespace

void lower_thresholds(Array<const float, 4> sheared, Index reference, Index needed, Array<float, 2> thresholds) {
    const Index N = sheared.shape[0], H = sheared.shape[2], W = sheared.shape[3];
    parallel_for(0, H, [&](Index y) {
        const Scratch<float, 2> deviations(N, W);
        const Scratch<float, 1> patch(N);
        const auto agreeing = zeros<std::int32_t, 1>(W);
        std::int32_t *__restrict number = agreeing.array().data;
        float *__restrict threshold = thresholds.at(y);
        const Row own(sheared, reference, y);
        for (Index n = 0; n < N; ++n) {
            const Row row(sheared, n, y);
            float *__restrict deviation = deviations.array().at(n);
            if (n == reference) {
                std::fill_n(deviation, W, std::numeric_limits<float>::infinity());
                continue;
            }
            for (Index x = 0; x < W; ++x) {
                deviation[x] = row.deviation(own, x);
                number[x] += deviation[x] < threshold[x];
            }
        }
        for (Index x = 0; x < W; ++x) {
            // few pixels: the thresholds soon are as low as most candidates leave them
            if (number[x] < needed) continue;
            float *first = patch.array().data;
            for (Index n = 0; n < N; ++n) first[n] = deviations.array()(n, x);
            std::nth_element(first, first + needed - 1, first + N);
            threshold[x] = first[needed - 1];
        }
    });
}

void vote_costs(Array<const float, 4> sheared, Index reference, Array<const float, 2> thresholds, Array<float, 2> out) {
    const Index N = sheared.shape[0], H = sheared.shape[2], W = sheared.shape[3];
    parallel_for(0, H, [&](Index y) {
        const auto rows = zeros<float, 2>(2, W);
        float *__restrict votes = rows.array().at(0), *__restrict total = rows.array().at(1);
        const float *threshold = thresholds.at(y);
        const Row own(sheared, reference, y);
        for (Index n = 0; n < N; ++n) {
            if (n == reference) continue;
            const Row row(sheared, n, y);
            for (Index x = 0; x < W; ++x) {
                const float deviation = row.deviation(own, x);
                const bool agrees = deviation <= threshold[x];
                votes[x] += agrees ? 1.0f : 0.0f;
                total[x] += agrees ? deviation : 0.0f;
            }
        }
        float *__restrict cost = out.at(y);
        for (Index x = 0; x < W; ++x) {
            const float mean = total[x] / (std::max(votes[x], 1.0f) * threshold[x]);
            cost[x] = 1 - (votes[x] - mean) / float(N - 1);
        }
    });
}

}  // namespace sepi
