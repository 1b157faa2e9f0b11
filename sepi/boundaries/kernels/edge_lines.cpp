// The edges beside depth steps.
#include "kernels/kernel.hpp"

namespace sepi::edge_lines {

// Steps between shares that have costs, in shares that an edge may leave.
constexpr Index STEPS = 3;

constexpr Index PATCH = 9;       // pixels of a patch, row after row
constexpr float MOST = 0.2f;     // largest cost of a neighbour that an edge does not fit
constexpr float OUTSIDE = 0.3f;  // cost of the other surface at a pixel away from all steps
constexpr Index AT_ONCE = 64;    // pixels of a turn of a thread

// Difference of cost between the best edges that give a pixel to the nearer and to the farther surface, into evidence
// (n,), for pixels (n,) of the map (H, W). middle (H, W) lies between the surfaces. costs (n, K) are those of shares of
// the nearer surface from 0 to 1, the best 0; number (H, W) is a pixel's row of them, or -1 for a pixel beside no step,
// which stays on its side. edges (M, 9) through a patch of three by three pixels, as shares in steps, have costs of their own
// (M,) and are known to give the middle to the nearer surface or not (M,); weights (9,) are of the patch's pixels.
void evidence_of_lines(Array<const float, 2> disparity, Array<const float, 2> middle, Array<const std::int64_t, 2> number, Array<const float, 2> costs,
                       Array<const std::uint8_t, 2> edges, Array<const bool, 1> is_near, Array<const float, 1> own_costs, Array<const float, 1> weights,
                       Array<const std::int64_t, 1> pixels, Array<float, 1> evidence) {
    const Index H = disparity.shape[0], W = disparity.shape[1], K = costs.shape[1], finest = STEPS * (K - 1);
    // cost of each share in a pixel of the patch about (y, x)
    const auto fill = [&](Index y, Index x, Index p, float *table) {
        const Index row = y + p / 3 - 1, column = x + p % 3 - 1;
        if (row < 0 || column < 0 || row >= H || column >= W) {
            std::fill_n(table, finest + 1, 0.0f);
        } else if (const Index n = number(row, column); n < 0) {
            const float cost = weights(p) * OUTSIDE;
            const bool nearer = disparity(row, column) > middle(y, x);
            for (Index k = 0; k <= finest; ++k) table[k] = cost * (nearer ? 1 - float(k) / float(finest) : float(k) / float(finest));
        } else {
            // an edge may bend or end beside the pixel in the middle
            const float weight = weights(p), most = p == PATCH / 2 ? INFINITE : MOST, *own = costs.at(n);
            for (Index k = 0; k < K - 1; ++k)
                for (Index step = 0; step <= STEPS; ++step)
                    table[STEPS * k + step] = weight * std::min(own[k] + float(step) / float(STEPS) * (own[k + 1] - own[k]), most);
        }
    };
    parallel_for_blocks(0, costs.shape[0], AT_ONCE, [&](Index i) {
        float table[PATCH][1 << 8];  // for any number of steps
        for (Index p = 0; p < PATCH; ++p) fill(pixels(i) / W, pixels(i) % W, p, table[p]);
        float near = INFINITE, far = near;
        for (Index m = 0; m < edges.shape[0]; ++m) {
            const std::uint8_t *shares = edges.at(m);
            float total = own_costs(m);
            for (Index p = 0; p < PATCH; ++p) total += table[p][shares[p]];
            float &least = is_near(m) ? near : far;
            least = std::min(least, total);
        }
        evidence(i) = near - far;
    });
}

const Submodule submodule("edge_lines", {{"evidence_of_lines", &evidence_of_lines}, {"STEPS", STEPS}});

}  // namespace sepi::edge_lines
