// The evidence by colour mixture.
#include "kernels/kernel.hpp"

namespace sepi::colour_mixture {

constexpr double WIDTH = 1;            // of the window's weights, pixels
constexpr double APART = 0.019;        // squared distance of a colour from all mixtures at which it counts 1/e, in units of their variance
constexpr double RAMP = 0.07;          // distance of the share below the threshold at which the evidence is full
constexpr double LEAST_WEIGHT = 0.05;  // least weight of the clean pixels of each side; an adjacent pixel has 1

// Weighted sums over the clean pixels of one side.
struct Side {
    double weight = 0, colour[3] = {}, colour2 = 0;
};

// Evidence that the nearer surface fills little of a pixel, 0..1, into out (H, W) if above 0; guide (H, W, 3). farthest and
// nearest (H, W) are the least and the largest disparity of each pixel and its eight neighbours.
void mixture_evidence(Array<const float, 2> disparity, Array<const float, 2> farthest, Array<const float, 2> nearest, Strided<const float, 3> guide, double discontinuity, Index radius,
                      double contrast, double threshold, double least_variance, Array<float, 2> out) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    std::vector<double> weights;  // by squared distance
    for (Index distance2 = 0; distance2 <= 2 * radius * radius; ++distance2) weights.push_back(std::exp(double(-distance2) / (2 * WIDTH * WIDTH)));

    parallel_for_pixels(H, W, [&](Index y, Index x) {
        const float lowest = farthest(y, x), highest = nearest(y, x);
        const double middle = double(lowest + highest) / 2;
        if (highest - lowest < discontinuity || disparity(y, x) <= middle) return;
        Side sides[2];
        for_window(y, x, radius, H, W, [&](Index row, Index column) {
            const float d = disparity(row, column);
            const bool clean = farthest(row, column) > middle || nearest(row, column) <= middle;
            // other surfaces than the two do not count
            if (!clean || d > highest + discontinuity || d < lowest - discontinuity) return;
            const double weight = weights[(row - y) * (row - y) + (column - x) * (column - x)];
            Side &side = sides[d > middle];
            side.weight += weight;
            for (Index c = 0; c < 3; ++c) {
                const float colour = guide(row, column, c);
                side.colour[c] += weight * colour;
                side.colour2 += weight * (colour * colour);
            }
        });
        const auto &[far, near] = sides;
        if (far.weight < LEAST_WEIGHT || near.weight < LEAST_WEIGHT) return;
        double distance = 0, projection = 0, apart = 0, variance = least_variance;
        for (const Side &side : sides) variance += side.colour2 / side.weight;
        for (Index c = 0; c < 3; ++c) {
            const double of_far = far.colour[c] / far.weight, of_near = near.colour[c] / near.weight, own = guide(y, x, c) - of_far;
            distance += squared(of_near - of_far);
            projection += own * (of_near - of_far);
            apart += squared(own);
            variance -= of_far * of_far + of_near * of_near;
        }
        // distance of the colour from both: a surface darker towards its edge is no mixture
        distance = std::max(distance, 1e-12);
        apart -= squared(std::max(projection, 0.0)) / distance;
        const double little = std::clamp((threshold - projection / distance) / RAMP, 0.0, 1.0);
        out(y, x) = float(little * distance / (distance + contrast * variance) * std::exp(-apart / (APART * variance)));
    });
}

const Submodule submodule("colour_mixture", {{"mixture_evidence", &mixture_evidence}});

}  // namespace sepi::colour_mixture
