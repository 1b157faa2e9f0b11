#include "surface_shares.hpp"

#include <cmath>

#include "kernels/parallel.hpp"
#include "view_samples.hpp"

namespace sepi {
namespace {

constexpr Index LITTLE = 3;            // shares that a pixel may have which moves with the more distant surface
constexpr double SAME_SURFACE = 0.25;  // difference of disparity, pixels per view step
// standard deviation of a surface's colour from what its clean neighbours say, beyond what they differ by; the same
// where the colour is free, and where no clean one is known; colours in 0..1
constexpr double CLEAN_DEVIATION = 0.02, FREE_DEVIATION = 0.2, UNKNOWN_DEVIATION = 1;
// of a change of colour towards the edge: what its slope is held by, square of pixels; the part of its square that adds
// to the colour's variance; the least deviation of one channel about it
constexpr double LEAST_EXTENT = 0.1, DOUBT = 0.1, LEAST_DEVIATION = 0.004;
constexpr float UNKNOWN = 1e3f;  // cost where nothing tells
constexpr Index AT_ONCE = 64;    // pixels that a thread does at a stretch

double squared(double number) { return number * number; }

// Three channels, and a number that is not looked at.
using Channels = double __attribute__((vector_size(32)));

double total_of(Channels numbers) { return numbers[0] + numbers[1] + numbers[2]; }

// The nearer surface at a pixel: its colour and the variance of that, and the least and the most that it shows nearby.
struct NearerSurface {
    Channels own, least = {1, 1, 1}, most = {};
    double variance;
};

// Weighted sums over the nearer surface's clean pixels about a pixel.
struct Moments {
    double weight = 0, weight2 = 0, at_y = 0, at_x = 0, yy = 0, yx = 0, xx = 0;
    Channels colour = {}, down = {}, across = {}, colour2 = {};

    void add(double dy, double dx, Channels seen) {
        const double w = 1 / squared(1 + dy * dy + dx * dx);
        weight += w, weight2 += w * w;
        at_y += w * dy, at_x += w * dx;
        yy += w * dy * dy, yx += w * dy * dx, xx += w * dx * dx;
        const Channels weighted = w * seen;
        colour += weighted, down += weighted * dy, across += weighted * dx, colour2 += weighted * seen;
    }
};

// Set the colour and its variance by what clean pixels' colours go on as.
//
// Surfaces get darker or brighter towards their edge. The colour is linear in the place as far as that is more than its
// own doubt (James and Stein's estimate): texture has no slope that goes on.
void go_on(const Moments &sums, NearerSurface &surface) {
    const auto positive = [](Channels numbers) { return numbers > 0.0 ? numbers : Channels{}; };
    const double n = sums.weight, at_y = sums.at_y / n, at_x = sums.at_x / n;
    const double yy = sums.yy / n - at_y * at_y + LEAST_EXTENT, xx = sums.xx / n - at_x * at_x + LEAST_EXTENT, yx = sums.yx / n - at_y * at_x;
    const double determinant = yy * xx - yx * yx;
    const Channels mean = sums.colour / n, down = sums.down / n - mean * at_y, across = sums.across / n - mean * at_x;
    const Channels slope_y = (xx * down - yx * across) / determinant, slope_x = (yy * across - yx * down) / determinant;
    const Channels variance = positive(sums.colour2 / n - mean * mean), change = -slope_y * at_y - slope_x * at_x;
    const double plain = total_of(variance), rest = total_of(positive(variance - slope_y * down - slope_x * across)), change2 = total_of(change * change);
    // variance of the change, by what is left beside it and where the clean pixels lie
    const double lever = (xx * at_y * at_y - 2 * yx * at_y * at_x + yy * at_x * at_x) / determinant;
    const double doubt = (rest + 3 * squared(LEAST_DEVIATION)) / std::max(n * n / sums.weight2 - 3, 1.0) * lever;
    const double kept = std::max(0.0, 1 - doubt / (change2 + 1e-12));
    surface.own = mean + kept * change;
    surface.variance = (kept * (rest + DOUBT * kept * change2) + (1 - kept) * plain) / 3 + squared(CLEAN_DEVIATION);
}

// The nearer surface at a pixel: where no clean pixel tells of its colour, that is the pixel's own.
NearerSurface nearer_surface(const Sides &sides, float near, double middle, Index y, Index x) {
    const Index H = sides.disparity.shape[0], W = sides.disparity.shape[1], radius = sides.clean_radius;
    const auto colour_at = [&](Index i, Index j) { return Channels{sides.guide(i, j, 0), sides.guide(i, j, 1), sides.guide(i, j, 2)}; };
    NearerSurface surface;
    Moments sums;
    for (Index i = std::max<Index>(0, y - radius); i < std::min(H, y + radius + 1); ++i) {
        for (Index j = std::max<Index>(0, x - radius); j < std::min(W, x + radius + 1); ++j) {
            const float d = sides.disparity(i, j);
            const Channels colour = colour_at(i, j);
            if (d > middle) {
                surface.least = colour < surface.least ? colour : surface.least;
                surface.most = colour > surface.most ? colour : surface.most;
            }
            if (sides.clean(i, j) && std::abs(d - near) < SAME_SURFACE) sums.add(double(i - y), double(j - x), colour);
        }
    }
    if (sums.weight > 0) {
        go_on(sums, surface);
    } else {
        surface.own = colour_at(y, x), surface.variance = squared(UNKNOWN_DEVIATION);
    }
    return surface;
}

Float8 robust(Float8 residual2, Float8 half) { return residual2 / (residual2 + half); }

// Sum over n views of what turn(view, c) gives of eight of them, of each channel.
template <class Turn>
float sum_over(Index n, Index channels, Turn turn) {
    Float8 total{};
    for (Index v = 0; v < n; v += LANES)
        for (Index c = 0; c < channels; ++c) total += first_lanes(turn(v, c), n - v, 0);
    return sum_of(total);
}

// What the views show of one pixel after the other.
template <class Colour>
class ShownPixel {
  public:
    ShownPixel(const RimViews<Colour> &views, const Rim &rim, Array<const float, 3> background, const Sides &sides, double scale2, double contrast2)
        : views_(views), rim_(rim), background_(background), sides_(sides), least_scale2_(scale2), contrast2_(contrast2) {}

    // Find the costs of all shares; false if the views do not tell.
    bool find(Index y, Index x, float *costs) {
        const float near = rim_.near(y, x), far = rim_.far(y, x);
        look_along_near(near, far, y, x);
        if (n_ < FEWEST_SAMPLES) return false;
        surface_ = nearer_surface(sides_, near, double(near + far) / 2, y, x);
        // to be far, a pixel must be so whatever its colour. To be near it must have the surface's colour: before a bare
        // background, any is a share of another
        if (rim_.is_near(y, x)) surface_.variance = squared(FREE_DEVIATION);
        scale2_ = float(least_scale2_ + contrast2_ * mean_contrast2());
        held_ = float(scale2_ / surface_.variance);
        for (Index row = 0; row < NOISE; ++row) sums_[row] = sum_over(n_, 1, [&](Index v, Index) { return samples(row, v); });
        for (Index k = 0; k < SHARES; ++k) costs[k] = cost_of(float(double(k) / (SHARES - 1)));
        if (!rim_.is_near(y, x)) {
            const float alone = cost_alone(far, y, x);
            for (Index k = 0; k < LITTLE; ++k) costs[k] = std::min(costs[k], alone);
        }
        return true;
    }

  private:
    // rows of what the views show: colours, those behind them, and the variance of the latter
    static constexpr Index BEHIND = 3, NOISE = 6, ROWS = 7;

    Float8 samples(Index row, Index v) const { return load(samples_.array().at(row, v)); }

    // Colour between pixels of the background, and its variance, if they are known.
    std::optional<std::array<float, 4>> behind(const Place &place) const {
        const auto [row, column, fy, fx] = place;
        for (Index i = row; i < row + 2; ++i)
            for (Index j = column; j < column + 2; ++j)
                if (background_(i, j, 3) < 0) return std::nullopt;
        // two pixels side by side
        const Float8 upper = load(background_.at(row, column)), lower = load(background_.at(row + 1, column));
        const Float8 both = fma(spread(float(fy)), lower - upper, upper);
        std::array<float, 4> found;
        for (int k = 0; k < 4; ++k) found[k] = both[k] + float(fx) * (both[k + 4] - both[k]);
        return found;
    }

    void take(Index view, const Place &place) {
        const auto colour = sample(views_, view, place);
        for (Index c = 0; c < 3; ++c) samples_.array()(c, n_) = colour[c];
        ++n_;
    }

    // What the views show of a pixel that moves with the nearer surface, and what is behind it there.
    void look_along_near(float near, float far, Index y, Index x) {
        n_ = 0;
        for (Index view = 0; view < views_.number(); ++view) {
            const auto place = place_seen(views_, view, near, y, x);
            // where the background that is there in the view is in the reference view
            const double down = double(y) - (near - far) * views_.baselines(view, 0), across = double(x) - (near - far) * views_.baselines(view, 1);
            const auto there = place_amid(down, across, background_.shape[0], background_.shape[1]);
            if (!place || !there) continue;
            if (const auto known = behind(*there)) {
                for (Index k = 0; k < 4; ++k) samples_.array()(BEHIND + k, n_) = (*known)[k];
                take(view, *place);
            }
        }
    }

    // Mean squared difference of the nearer surface's colour from what is behind it.
    float mean_contrast2() const {
        const float sum = sum_over(n_, 3, [&](Index v, Index c) {
            const Float8 apart = samples(BEHIND + c, v) - spread(float(surface_.own[c]));
            return apart * apart;
        });
        return sum / float(3 * n_);
    }

    // Mean robust residual of views that show a share of one colour before the background, 0..1. The colour is that which
    // fits best within the surface's limits, and is held near its own with the weight of so many views.
    float cost_of(float share) const {
        const float rest = 1 - share;
        float total = 0;
        Float8 shown[3];
        for (Index c = 0; c < 3; ++c) {
            const float along = sums_[c] - rest * sums_[BEHIND + c];
            const double own = surface_.own[c], best = (share * along + held_ * own) / (share * share * double(n_) + held_);
            const double fit = std::min(std::max(best, surface_.least[c]), surface_.most[c]);
            total += float(held_ * squared(fit - own) / scale2_);
            shown[c] = spread(float(share * fit));
        }
        const float residuals = sum_over(n_, 1, [&](Index v, Index) {
            const Float8 half = fma(spread(rest * rest), samples(NOISE, v), spread(scale2_));
            const auto cost = [&](Index c) {
                const Float8 apart = samples(c, v) - shown[c] - spread(rest) * samples(BEHIND + c, v);
                return robust(apart * apart, half);
            };
            return cost(0) + cost(1) + cost(2);
        });
        return (total + residuals) / float(3 * n_);
    }

    // Mean robust residual of a pixel that moves with the more distant surface, over views that see it.
    float cost_alone(float far, Index y, Index x) {
        n_ = 0;
        for (Index view = 0; view < views_.number(); ++view) {
            // the reference view itself always fits
            if (views_.baselines(view, 0) == 0 && views_.baselines(view, 1) == 0) continue;
            if (const auto place = place_seen(views_, view, far, y, x)) take(view, *place);
        }
        if (n_ < FEWEST_ALONE) return UNKNOWN;
        const float sum = sum_over(n_, 3, [&, own = sides_.colour(y, x)](Index v, Index c) {
            const Float8 apart = samples(c, v) - spread(own[c]);
            return robust(apart * apart, spread(scale2_));
        });
        return sum / float(3 * n_);
    }

    const RimViews<Colour> &views_;
    const Rim &rim_;
    const Array<const float, 3> background_;
    const Sides &sides_;
    const double least_scale2_, contrast2_;

    const Scratch<float, 2> samples_ = zeros<float, 2>(ROWS, views_.number() + LANES);
    Index n_ = 0;  // views that tell
    NearerSurface surface_;
    float sums_[NOISE], scale2_, held_;
};

}  // namespace

template <class Colour>
void costs_of_shares(const RimViews<Colour> &views, const Rim &rim, Array<const float, 3> background, const Sides &sides, double scale2, double contrast2,
                     Array<const std::int64_t, 1> pixels, Array<float, 2> costs, Array<bool, 1> told) {
    const Index W = sides.disparity.shape[1], count = pixels.shape[0];
    parallel_for(0, (count + AT_ONCE - 1) / AT_ONCE, [&](Index task) {
        ShownPixel<Colour> shown(views, rim, background, sides, scale2, contrast2);
        for (Index i = task * AT_ONCE; i < std::min(count, (task + 1) * AT_ONCE); ++i)
            if (shown.find(pixels(i) / W, pixels(i) % W, costs.at(i))) told(i) = true;
    });
}

#define INSTANTIATE(Colour)                                                                                                    \
    template void costs_of_shares(const RimViews<Colour> &, const Rim &, Array<const float, 3>, const Sides &, double, double, \
                                  Array<const std::int64_t, 1>, Array<float, 2>, Array<bool, 1>);
INSTANTIATE(std::uint8_t)
INSTANTIATE(std::uint16_t)
INSTANTIATE(float)
#undef INSTANTIATE

}  // namespace sepi
