// The edges beside depth steps.
#include <limits>

#include "kernels/arguments.hpp"
#include "kernels/parallel.hpp"

namespace sepi::edge_lines {
namespace {

// From one share that has a cost to the next that an edge may leave.
constexpr Index STEPS = 3;

// Edges through a patch of three by three pixels: the fields of sepi.boundaries.edge_lines.Edges, in their order.
struct Edges {
    Array<const std::uint8_t, 2> shares;  // (M, 9), in steps
    Array<const bool, 1> is_near;         // (M,)
    Array<const float, 1> costs;          // (M,)
    Array<const float, 1> weights;        // (9,)

    bool fields(auto visit) { return visit(shares, is_near, costs, weights); }
};

constexpr Index PATCH = 9;       // pixels of a patch, row after row
constexpr float MOST = 0.2f;     // cost of a neighbour that an edge does not fit
constexpr float OUTSIDE = 0.3f;  // cost of a pixel away from all steps that is the other surface's
constexpr Index AT_ONCE = 64;    // pixels that a thread does at a stretch

// By how much the best edge that leaves a pixel to the farther surface costs less than the best that does not, into
// evidence (n,), for pixels (n,) of the map (H, W). Between their surfaces lies middle (H, W). Shares of the nearer one
// have costs (n, K), from 0 to 1, the best of each 0; number (H, W) is a pixel's row of them, or -1: it lies beside no
// step, and stays on its side.
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

const Submodule submodule("edge_lines", [](nb::module_ &m) {
    m.def("evidence_of_lines", &evidence_of_lines, Unlocked(), "disparity"_a, "middle"_a, "number"_a, "costs"_a, "edges"_a, "pixels"_a,
          "evidence"_a);
    m.attr("STEPS") = STEPS;
});

}  // namespace
}  // namespace sepi::edge_lines
