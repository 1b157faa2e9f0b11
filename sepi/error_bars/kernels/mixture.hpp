// Distribution of a pixel's error.
#pragma once

#include <tuple>

#include "kernels/array.hpp"

namespace sepi {

// Mean absolute deviation of the other surface's disparity: as part of its distance, and the least, pixels per view step.
constexpr double RIM_WIDTH = 0.2, LEAST_RIM = 0.01;

// Parameters of each pixel's error, (H, W).
struct ErrorMixture {
    Array<const float, 2> scale, outlier_scale, outlier, rim, above, below;

    auto fields() { return std::tie(scale, outlier_scale, outlier, rim, above, below); }
};

// Standard deviation, distances of the lower and of the upper bound, each with probability tail beyond it, and
// probability of an error up to close: out (4, H, W).
void describe(const ErrorMixture &mixture, double tail, double close, Array<float, 3> out);

}  // namespace sepi
