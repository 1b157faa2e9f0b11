// Angular patches that an edge splits in two.
#include "kernels/kernel.hpp"

namespace sepi::occ {

// Colours of the halves of P patches in views sheared by a candidate, sheared (N, 3, H, W), relative to the reference
// view (3, H, W): means (P, 2, 3), and variances (P, 2), means over the channels.
// places (P, 3): row, column and number of the edge's orientation; halves (orientations, 2, N): views of the two halves,
// of which none is empty.
void moments_of_halves(Array<const float, 4> sheared, Array<const float, 3> reference, Strided<const std::int64_t, 2> places,
                       Array<const bool, 3> halves, Array<float, 3> means, Array<float, 2> variances) {
    parallel_for(0, places.shape[0], [&](Index p) {
        const Index y = places(p, 0), x = places(p, 1);
        for (Index half = 0; half < 2; ++half) {
            const bool *chosen = halves.at(places(p, 2), half);
            float count = 0, squares = 0, sums[3] = {};
            for (Index n = 0; n < sheared.shape[0]; ++n) {
                if (!chosen[n]) continue;
                ++count;
                for (Index c = 0; c < 3; ++c) {
                    const float difference = sheared(n, c, y, x) - reference(c, y, x);
                    sums[c] += difference;
                    squares += difference * difference;
                }
            }
            for (Index c = 0; c < 3; ++c) {
                means(p, half, c) = sums[c] / count;
                squares -= sums[c] * means(p, half, c);
            }
            variances(p, half) = std::max(0.0f, squares) / std::max(1.0f, count - 1) / 3;
        }
    });
}

const Submodule submodule("occ", {{"moments_of_halves", &moments_of_halves}});

}  // namespace sepi::occ
