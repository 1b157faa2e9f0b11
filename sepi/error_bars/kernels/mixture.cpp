// Distribution of a pixel's error.
#include "kernels/kernel.hpp"

namespace sepi::mixture {
// Clang vectorises the search for the bounds less well if other sources might call it
namespace {

// Mean absolute error about the other surface's disparity: as a share of its distance, and least, pixels per view step.
constexpr double RIM_WIDTH = 0.2, LEAST_RIM = 0.01;

// Parameters of each pixel's error, (H, W).
struct ErrorMixture {
    Array<const float, 2> scale, outlier_scale, outlier, rim, above, below;

    bool fields(auto visit) { return visit(scale, outlier_scale, outlier, rim, above, below); }
};

constexpr int EVALUATIONS = 60;
constexpr double FARTHEST = 1e12;   // largest distance of a bound, pixels
constexpr double PRECISION = 1e-3;  // relative precision of the bounds, and of the probability beyond them
constexpr Index AT_ONCE = 32;       // pixels computed together, so that loops vectorise

// A probability, and its negative derivative.
struct Share {
    double beyond, density;
};

// Share of a Laplace distribution about 0 that lies above x.
[[gnu::always_inline]] inline Share laplace_above(double x, double width) {
    const double half = 0.5 * double(exp_of_negative(float(-std::abs(x) / width)));
    return {x > 0 ? half : 1 - half, half / width};
}

// Errors of at most AT_ONCE pixels in one direction.
struct PixelErrors {
    const Index number;
    const float *scale, *outlier_scale, *outlier, *rim, *above, *below;

    // Error about the map.
    double own(Index i) const { return 1.0 - outlier[i] - rim[i]; }
    // Share of rim's probability in this direction: the larger distance is more likely.
    double share(Index i) const { return (above[i] * above[i] + 1e-6) / (above[i] * above[i] + below[i] * below[i] + 2e-6); }
    static double width(double distance) { return RIM_WIDTH * distance + LEAST_RIM; }

    // Probability that the true disparity is more than x >= 0 above the map's.
    [[gnu::always_inline]] Share beyond(Index i, double x) const {
        const Share core = laplace_above(x, scale[i]), outliers = laplace_above(x, outlier_scale[i]);
        const Share there = laplace_above(x - above[i], width(above[i])), opposite = laplace_above(x + below[i], width(below[i]));
        const double nearer = rim[i] * share(i), farther = rim[i] - nearer;
        return {
            own(i) * core.beyond + outlier[i] * outliers.beyond + nearer * there.beyond + farther * opposite.beyond,
            own(i) * core.density + outlier[i] * outliers.density + nearer * there.density + farther * opposite.density,
        };
    }

    // Distances above the map beyond which the truth lies with probability tail: Newton's method for the logarithm of the
    // probability, which is nearly linear. It starts at the bound of the heavier part alone, with bisection as fallback.
    void bounds(double tail, float *out) const {
        double found[AT_ONCE], low[AT_ONCE] = {}, high[AT_ONCE];
        for (Index i = 0; i < number; ++i) {
            const double outer = outlier_scale[i] * std::log(std::max(outlier[i] * 0.5 / tail, 1e-9));
            found[i] = beyond(i, 0).beyond > tail ? std::max(scale[i] * std::log(std::max(own(i) * 0.5 / tail, 1.1)), outer) : 0;
            high[i] = FARTHEST;
        }
        Index open = number;
        for (int evaluation = 0; open > 0 && evaluation < EVALUATIONS; ++evaluation) {
            open = 0;
            for (Index i = 0; i < number; ++i) {
                const double x = found[i];
                const Share here = beyond(i, x);
                // logarithm of the ratio to tail, near 1
                const double f = 2 * (here.beyond - tail) / (here.beyond + tail), next = x + f * here.beyond / here.density;
                const double least = f > 0 ? x : low[i], most = f > 0 ? high[i] : x, half = most == FARTHEST ? 2 * least : 0.5 * (least + most);
                const double better = least < next && next < most ? next : half;
                const Index more = x > 0 && std::abs(f) >= PRECISION && most - least > PRECISION * most;
                low[i] = least, high[i] = most, found[i] = more ? better : x;
                open += more;
            }
        }
        std::copy_n(found, number, out);
    }

    // Expected absolute error.
    double expected(Index i) const {
        const auto distance = [](double apart) { return apart + width(apart) * double(exp_of_negative(float(-apart / width(apart)))); };
        const double other = share(i) * distance(above[i]) + (1 - share(i)) * distance(below[i]);
        return own(i) * scale[i] + outlier[i] * outlier_scale[i] + rim[i] * other;
    }
};

// Standard deviation, distances of the lower and of the upper bound, each with probability tail beyond it, and
// probability of an error up to close: out (4, H, W).
void describe(const ErrorMixture &mixture, double tail, double close, Array<float, 3> out) {
    // standard deviation of a normal distribution, over its mean absolute value
    const double normal = std::sqrt(std::numbers::pi / 2);
    const Index H = out.shape[1], W = out.shape[2];
    parallel_for(0, H, [&](Index y) {
        for (Index first = 0; first < W; first += AT_ONCE) {
            const Index number = std::min(AT_ONCE, W - first);
            const auto [scale, outlier_scale, outlier, rim, above, below] = mixture;
            const auto with_other = [&](Array<const float, 2> ahead, Array<const float, 2> behind) {
                return PixelErrors{number, scale.at(y, first), outlier_scale.at(y, first), outlier.at(y, first), rim.at(y, first), ahead.at(y, first), behind.at(y, first)};
            };
            const PixelErrors upwards = with_other(above, below), downwards = with_other(below, above);
            downwards.bounds(tail, out.at(1, y, first));
            upwards.bounds(tail, out.at(2, y, first));
            float *__restrict sigma = out.at(0, y, first), *__restrict probability = out.at(3, y, first);
            for (Index i = 0; i < number; ++i) {
                sigma[i] = float(normal * upwards.expected(i));
                probability[i] = float(std::max(0.0, 1 - upwards.beyond(i, close).beyond - downwards.beyond(i, close).beyond));
            }
        }
    });
}

const Submodule submodule("mixture", {{"RIM_WIDTH", RIM_WIDTH}, {"LEAST_RIM", LEAST_RIM}, {"describe", &describe}});

}  // namespace
}  // namespace sepi::mixture
