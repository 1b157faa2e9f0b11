#include "edge_lines.hpp"

#include <limits>

#include "kernels/parallel.hpp"

namespace sepi {
namespace {

constexpr Index PATCH = 9;       // pixels of a patch, row after row
constexpr float MOST = 0.2f;     // cost of a neighbour that an edge does not fit
constexpr float OUTSIDE = 0.3f;  // cost of a pixel away from all steps that is the other surface's
constexpr Index AT_ONCE = 64;    // pixels that a thread does at a stretch

}  // namespace

void evidence_of_lines(Array<const float, 2> disparity, Array<const float, 2> middle, Array<const std::int64_t, 2> number, Array<const float, 2> costs,
                       const Edges &edges, Array<const std::int64_t, 1> pixels, Array<float, 1> evidence) {
    const Index H = disparity.shape[0], W = disparity.shape[1], K = costs.shape[1], finest = STEPS * (K - 1);
    // what each share costs in a pixel of the patch about (y, x)
    const auto fill = [&](Index y, Index x, Index p, float *table) {
        const Index row = y + p / 3 - 1, column = x + p % 3 - 1;
        if (row < 0 || column < 0 || row >= H || column >= W) {
            std::fill_n(table, finest + 1, 0.0f);
        } else if (const Index n = number(row, column); n < 0) {
            const float cost = edges.weights(p) * OUTSIDE;
            const bool nearer = disparity(row, column) > middle(y, x);
            for (Index k = 0; k <= finest; ++k) table[k] = cost * (nearer ? 1 - float(k) / float(finest) : float(k) / float(finest));
        } else {
            // an edge may bend, or end, beside the pixel that is asked about
            const float weight = edges.weights(p), most = p == PATCH / 2 ? std::numeric_limits<float>::infinity() : MOST, *own = costs.at(n);
            for (Index k = 0; k < K - 1; ++k)
                for (Index step = 0; step <= STEPS; ++step)
                    table[STEPS * k + step] = weight * std::min(own[k] + float(step) / float(STEPS) * (own[k + 1] - own[k]), most);
        }
    };
    parallel_for_blocks(0, costs.shape[0], AT_ONCE, [&](Index i) {
        float table[PATCH][1 << 8];  // for any number of steps
        for (Index p = 0; p < PATCH; ++p) fill(pixels(i) / W, pixels(i) % W, p, table[p]);
        float near = std::numeric_limits<float>::infinity(), far = near;
        for (Index m = 0; m < edges.costs.shape[0]; ++m) {
            const std::uint8_t *shares = edges.shares.at(m);
            float total = edges.costs(m);
            for (Index p = 0; p < PATCH; ++p) total += table[p][shares[p]];
            float &least = edges.is_near(m) ? near : far;
            least = std::min(least, total);
        }
        evidence(i) = near - far;
    });
}

}  // namespace sepi
