#include "edge_lines.hpp"

#include <limits>

#include "kernels/parallel.hpp"

namespace sepi {
namespace {

constexpr Index PATCH = 9;         // pixels of a patch, row after row
constexpr float MOST = 0.2f;       // cost of a neighbour that an edge does not fit
constexpr float OUTSIDE = 0.3f;    // cost of a pixel away from all steps that is the other surface's
constexpr Index AT_ONCE = 64;      // pixels that a thread does at a stretch

}  // namespace

void evidence_of_lines(Array<const float, 2> disparity, Array<const float, 2> middle, Array<const std::int64_t, 2> number, Array<const float, 2> costs,
                       const Edges &edges, Array<const std::int64_t, 1> pixels, Array<float, 1> evidence) {
    const Index H = disparity.shape[0], W = disparity.shape[1], count = costs.shape[0], K = costs.shape[1], finest = STEPS * (K - 1);
    // what a share costs in a pixel of the patch about (y, x)
    const auto fill = [&](Index y, Index x, Index p, float *table) {
        const Index row = y + p / 3 - 1, column = x + p % 3 - 1;
        if (row < 0 || column < 0 || row >= H || column >= W) {
            std::fill_n(table, finest + 1, 0.0f);
            return;
        }
        const Index n = number(row, column);
        const bool nearer = disparity(row, column) > middle(y, x);
        for (Index k = 0; k <= finest; ++k) {
            if (n < 0) {
                const float share = float(k) / float(finest);
                table[k] = edges.weights(p) * OUTSIDE * (nearer ? 1 - share : share);
            } else {
                const Index low = std::min(k / STEPS, K - 2);
                const float part = float(k - STEPS * low) / float(STEPS);
                const float cost = costs(n, low) + part * (costs(n, low + 1) - costs(n, low));
                // an edge may bend, or end, beside the pixel that is asked about
                table[k] = edges.weights(p) * (p == PATCH / 2 ? cost : std::min(cost, MOST));
            }
        }
    };
    parallel_for(0, (count + AT_ONCE - 1) / AT_ONCE, [&](Index task) {
        const Scratch<float, 2> scratch(PATCH, finest + 1);
        const auto table = scratch.array();
        for (Index i = task * AT_ONCE; i < std::min(count, (task + 1) * AT_ONCE); ++i) {
            for (Index p = 0; p < PATCH; ++p) fill(pixels(i) / W, pixels(i) % W, p, table.at(p));
            constexpr float NONE = std::numeric_limits<float>::infinity();
            float near = NONE, far = NONE;
            for (Index m = 0; m < edges.costs.shape[0]; ++m) {
                float total = edges.costs(m);
                for (Index p = 0; p < PATCH; ++p) total += table(p, edges.shares(m, p));
                float &least = edges.is_near(m) ? near : far;
                least = std::min(least, total);
            }
            evidence(i) = near - far;
        }
    });
}

}  // namespace sepi
