// Distribution of a pixel's error.
#include <cmath>
#include <numbers>

#include "kernels/arguments.hpp"
#include "kernels/parallel.hpp"

namespace sepi::mixture {
namespace {

// Mean absolute deviation of the other surface's disparity: as part of its distance, and the least, pixels per view step.
constexpr double RIM_WIDTH = 0.2, LEAST_RIM = 0.01;

// Parameters of each pixel's error, (H, W).
struct ErrorMixture {
    Array<const float, 2> scale, outlier_scale, outlier, rim, above, below;

    bool fields(auto visit) { return visit(scale, outlier_scale, outlier, rim, above, below); }
};

constexpr int EVALUATIONS = 40;
constexpr double FARTHEST = 1e12;   // no bound is farther away, pixels
constexpr double PRECISION = 1e-3;  // of the bounds, relative; of the probability beyond them, too

// A probability, and how fast it falls.
struct Share {
    double beyond, density;
};

// Share of a Laplace distribution about 0 that lies above x.
Share laplace_above(double x, double width) {
    const double half = 0.5 * std::exp(-std::abs(x) / width);
    return {x > 0 ? half : 1 - half, half / width};
}

// Error of one pixel in one direction.
struct PixelError {
    float scale, outlier_scale, outlier, rim, above, below;
    double own = 1.0 - outlier - rim;
    // Part of the probability of the other surface that the nearer one has: the farther away, the likelier.
    double share = (above * above + 1e-6) / (above * above + below * below + 2e-6);
    double wide = RIM_WIDTH * above + LEAST_RIM, deep = RIM_WIDTH * below + LEAST_RIM;

    // Probability that the true disparity is more than x >= 0 above the map's.
    Share beyond(double x) const {
        const double core = own * 0.5 * std::exp(-x / scale), outliers = outlier * 0.5 * std::exp(-x / outlier_scale);
        const Share there = laplace_above(x - above, wide), opposite = laplace_above(x + below, deep);
        return {
            core + outliers + rim * (share * there.beyond + (1 - share) * opposite.beyond),
            core / scale + outliers / outlier_scale + rim * (share * there.density + (1 - share) * opposite.density),
        };
    }

    // Distance above the map beyond which the truth lies with probability tail: Newton's method for the logarithm, nearly
    // a line, from where the heavier part alone would have its bound; halving what is left where it leads astray.
    double bound(double tail) const {
        if (beyond(0).beyond <= tail) return 0;
        double x = scale * std::log(std::max(own * 0.5 / tail, 1.1));
        x = std::max(x, outlier_scale * std::log(std::max(outlier * 0.5 / tail, 1e-9)));
        double low = 0, high = FARTHEST;
        for (int i = 0; i < EVALUATIONS; ++i) {
            const Share here = beyond(x);
            const double f = std::log(here.beyond / tail);
            if (std::abs(f) < PRECISION) break;
            (f > 0 ? low : high) = x;
            if (high - low <= PRECISION * high) break;
            x += f * here.beyond / here.density;
            if (!(low < x && x < high)) x = high == FARTHEST ? 2 * low : 0.5 * (low + high);
        }
        return x;
    }

    // Expected absolute error.
    double expected() const {
        const double other = share * (above + wide * std::exp(-above / wide)) + (1 - share) * (below + deep * std::exp(-below / deep));
        return own * scale + outlier * outlier_scale + rim * other;
    }
};

// Standard deviation, distances of the lower and of the upper bound, each with probability tail beyond it, and
// probability of an error up to close: out (4, H, W).
void describe(const ErrorMixture &mixture, double tail, double close, Array<float, 3> out) {
    // standard deviation of a normal distribution, over its mean absolute value
    const double normal = std::sqrt(std::numbers::pi / 2);
    parallel_for_pixels(out.shape[1], out.shape[2], [&](Index y, Index x) {
        const auto with_other = [&](float above, float below) {
            return PixelError{mixture.scale(y, x), mixture.outlier_scale(y, x), mixture.outlier(y, x), mixture.rim(y, x), above, below};
        };
        const float above = mixture.above(y, x), below = mixture.below(y, x);
        const PixelError upwards = with_other(above, below), downwards = with_other(below, above);
        out(0, y, x) = float(normal * upwards.expected());
        out(1, y, x) = float(downwards.bound(tail));
        out(2, y, x) = float(upwards.bound(tail));
        out(3, y, x) = float(std::max(0.0, 1 - upwards.beyond(close).beyond - downwards.beyond(close).beyond));
    });
}

const Submodule submodule("mixture", [](nb::module_ &m) {
    m.attr("RIM_WIDTH") = RIM_WIDTH;
    m.attr("LEAST_RIM") = LEAST_RIM;
    m.def("describe", &describe, Unlocked(), "mixture"_a, "tail"_a, "close"_a, "out"_a);
});

}  // namespace
}  // namespace sepi::mixture
