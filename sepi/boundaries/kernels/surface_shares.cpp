// Share of the nearer surface in a pixel beside a depth step: residuals of the views for each share.
#include "view_samples.hpp"

namespace sepi::surface_shares {

// Pixels beside a depth step, and their two possible surfaces; (H, W).
struct Rim {
    Array<float, 2> near, far;
    Array<bool, 2> inside, is_near;

    bool fields(auto visit) { return visit(near, far, inside, is_near); }
};

constexpr Index FEWEST_SAMPLES = 8;  // least number of views for a share
constexpr Index FEWEST_ALONE = 3;    // least number of views for the movement with the farther surface alone
constexpr Index SHARES = 12;         // number of shares, from 0 to 1; none is one half

constexpr Index LITTLE = 3;            // number of shares that fit a pixel moving with the farther surface
constexpr double SAME_SURFACE = 0.25;  // difference of disparity, pixels per view step
// standard deviation of a surface's colour from its clean neighbours', beyond their own; the same for a free colour,
// and without clean neighbours; colours in 0..1
constexpr double CLEAN_DEVIATION = 0.02, FREE_DEVIATION = 0.2, UNKNOWN_DEVIATION = 1;
// of a change of colour towards the edge: damping of its slope, squared pixels; share of its square that adds to the
// colour's variance; least standard deviation of one channel about it
constexpr double LEAST_EXTENT = 0.1, DOUBT = 0.1, LEAST_DEVIATION = 0.004;
constexpr float UNKNOWN = 1e3f;  // cost without information
constexpr Index AT_ONCE = 64;    // pixels of a turn of a thread

// Three channels, and an unused number.
using Channels = double __attribute__((vector_size(32)));

double total_of(Channels numbers) { return numbers[0] + numbers[1] + numbers[2]; }

// The nearer surface at a pixel: colour and its variance, and least and largest colours nearby.
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

// Set the colour and its variance by extrapolation of the clean pixels' colours.
//
// Surfaces get darker or brighter towards their edge, so the colour is linear in the position, with the slope shrunk by
// its uncertainty (James-Stein estimate), since texture has no slope that continues.
void go_on(const Moments &sums, NearerSurface &surface) {
    const auto positive = [](Channels numbers) { return numbers > 0.0 ? numbers : Channels{}; };
    const double n = sums.weight, at_y = sums.at_y / n, at_x = sums.at_x / n;
    const double yy = sums.yy / n - at_y * at_y + LEAST_EXTENT, xx = sums.xx / n - at_x * at_x + LEAST_EXTENT, yx = sums.yx / n - at_y * at_x;
    const double determinant = yy * xx - yx * yx;
    const Channels mean = sums.colour / n, down = sums.down / n - mean * at_y, across = sums.across / n - mean * at_x;
    const Channels slope_y = (xx * down - yx * across) / determinant, slope_x = (yy * across - yx * down) / determinant;
    const Channels variance = positive(sums.colour2 / n - mean * mean), change = -slope_y * at_y - slope_x * at_x;
    const double plain = total_of(variance), rest = total_of(positive(variance - slope_y * down - slope_x * across)), change2 = total_of(change * change);
    // variance of the change, from the residuals and the positions of the clean pixels
    const double lever = (xx * at_y * at_y - 2 * yx * at_y * at_x + yy * at_x * at_x) / determinant;
    const double doubt = (rest + 3 * squared(LEAST_DEVIATION)) / std::max(n * n / sums.weight2 - 3, 1.0) * lever;
    const double kept = std::max(0.0, 1 - doubt / (change2 + 1e-12));
    surface.own = mean + kept * change;
    surface.variance = (kept * (rest + DOUBT * kept * change2) + (1 - kept) * plain) / 3 + squared(CLEAN_DEVIATION);
}

// The nearer surface at a pixel; without clean pixels, its colour is the pixel's own.
NearerSurface nearer_surface(const Sides &sides, float near, double middle, Index y, Index x) {
    const auto colour_at = [&](Index i, Index j) { return Channels{sides.guide(i, j, 0), sides.guide(i, j, 1), sides.guide(i, j, 2)}; };
    NearerSurface surface;
    Moments sums;
    for_window(y, x, sides.clean_radius, sides.disparity.shape[0], sides.disparity.shape[1], [&](Index i, Index j) {
        const float d = sides.disparity(i, j);
        const Channels colour = colour_at(i, j);
        if (d > middle) {
            surface.least = colour < surface.least ? colour : surface.least;
            surface.most = colour > surface.most ? colour : surface.most;
        }
        if (sides.clean(i, j) && std::abs(d - near) < SAME_SURFACE) sums.add(double(i - y), double(j - x), colour);
    });
    if (sums.weight > 0) {
        go_on(sums, surface);
    } else {
        surface.own = colour_at(y, x), surface.variance = squared(UNKNOWN_DEVIATION);
    }
    return surface;
}

Float8 robust(Float8 residual2, Float8 half) { return residual2 / (residual2 + half); }

// Sum over n views of turn(view, c), which computes eight views of a channel.
template <class Turn>
float sum_over(Index n, Index channels, Turn turn) {
    Float8 total{};
    for (Index v = 0; v < n; v += LANES)
        for (Index c = 0; c < channels; ++c) total += first_lanes(turn(v, c), n - v, 0);
    return sum_of(total);
}

// Samples of the views for one pixel after the other.
struct ShownPixel {
    const RimViews &views;
    const ViewSamples samples_of;
    const Rim &rim;
    const Array<const float, 3> background;
    const Sides &sides;
    const double least_scale2, contrast2;

    // rows of samples: colours, colours of the background, and variance of the latter
    static constexpr Index BEHIND = 3, NOISE = 6, ROWS = 7;
    const Scratch<float, 2> rows = zeros<float, 2>(ROWS, views.number() + LANES);
    Index number = 0;  // number of views with samples
    NearerSurface surface = {};
    float sums[NOISE] = {}, scale2 = 0, held = 0;

    // Compute the costs of all shares; false with too few views.
    bool find(Index y, Index x, float *costs) {
        const float near = rim.near(y, x), far = rim.far(y, x);
        look_along_near(near, far, y, x);
        if (number < FEWEST_SAMPLES) return false;
        surface = nearer_surface(sides, near, double(near + far) / 2, y, x);
        // a far pixel must be far for any colour of the nearer surface. A near one must have the surface's colour, since
        // before a plain background any colour is a share of another
        if (rim.is_near(y, x)) surface.variance = squared(FREE_DEVIATION);
        const float contrasts2 = sum_over(number, 3, [&](Index v, Index c) {
            const Float8 apart = samples(BEHIND + c, v) - spread(float(surface.own[c]));
            return apart * apart;
        });
        scale2 = float(least_scale2 + contrast2 * (contrasts2 / float(3 * number)));
        held = float(scale2 / surface.variance);
        for (Index row = 0; row < NOISE; ++row) sums[row] = sum_over(number, 1, [&](Index v, Index) { return samples(row, v); });
        for (Index k = 0; k < SHARES; ++k) costs[k] = cost_of(float(double(k) / (SHARES - 1)));
        if (!rim.is_near(y, x)) {
            const float alone = cost_alone(far, y, x);
            for (Index k = 0; k < LITTLE; ++k) costs[k] = std::min(costs[k], alone);
        }
        return true;
    }

    Float8 samples(Index row, Index v) const { return load(rows.array().at(row, v)); }

    // Colour between pixels of the background, and its variance, if they are known.
    std::optional<std::array<float, 4>> behind(const Place &place) const {
        const auto [row, column, fy, fx] = place;
        // pixels of weight 0 need not be known
        for (Index i = row + (fy == 1); i <= row + (fy > 0); ++i)
            for (Index j = column + (fx == 1); j <= column + (fx > 0); ++j)
                if (background(i, j, 3) < 0) return std::nullopt;
        // two pixels side by side
        const Float8 upper = load(background.at(row, column)), lower = load(background.at(row + 1, column));
        const Float8 both = fma(spread(float(fy)), lower - upper, upper);
        std::array<float, 4> found;
        for (int k = 0; k < 4; ++k) found[k] = both[k] + float(fx) * (both[k + 4] - both[k]);
        return found;
    }

    void take(Index view, const Place &place) {
        const auto colour = samples_of.sample(view, place);
        for (Index c = 0; c < 3; ++c) rows.array()(c, number) = colour[c];
        ++number;
    }

    // Samples of the views for a pixel that moves with the nearer surface, and the background behind it.
    void look_along_near(float near, float far, Index y, Index x) {
        number = 0;
        for (Index view = 0; view < views.number(); ++view) {
            // and the position in the reference view of the background there
            const auto place = samples_of.place_seen(view, near, y, x), there = samples_of.place_in(view, near - far, y, x);
            if (!place || !there) continue;
            if (const auto known = behind(*there)) {
                for (Index k = 0; k < 4; ++k) rows.array()(BEHIND + k, number) = (*known)[k];
                take(view, *place);
            }
        }
    }

    // Mean robust residual of the views for a share of one colour before the background, 0..1. The colour is the best
    // within the surface's limits; a penalty with the weight of several views holds it near the surface's own.
    float cost_of(float share) const {
        const float rest = 1 - share;
        float total = 0;
        Float8 shown[3];
        for (Index c = 0; c < 3; ++c) {
            const float along = sums[c] - rest * sums[BEHIND + c];
            const double own = surface.own[c], best = (share * along + held * own) / (share * share * double(number) + held);
            const double fit = std::min(std::max(best, surface.least[c]), surface.most[c]);
            total += float(held * squared(fit - own) / scale2);
            shown[c] = spread(float(share * fit));
        }
        const float residuals = sum_over(number, 1, [&](Index v, Index) {
            const Float8 half = fma(spread(rest * rest), samples(NOISE, v), spread(scale2));
            const auto cost = [&](Index c) {
                const Float8 apart = samples(c, v) - shown[c] - spread(rest) * samples(BEHIND + c, v);
                return robust(apart * apart, half);
            };
            return cost(0) + cost(1) + cost(2);
        });
        return (total + residuals) / float(3 * number);
    }

    // Mean robust residual of a pixel that moves with the farther surface, over the views that see it.
    float cost_alone(float far, Index y, Index x) {
        number = 0;
        for (Index view = 0; view < views.number(); ++view) {
            // the reference view itself always fits
            if (views.seen.baselines(view, 0) == 0 && views.seen.baselines(view, 1) == 0) continue;
            if (const auto place = samples_of.place_seen(view, far, y, x)) take(view, *place);
        }
        if (number < FEWEST_ALONE) return UNKNOWN;
        const float sum = sum_over(number, 3, [&, own = sides.colour(y, x)](Index v, Index c) {
            const Float8 apart = samples(c, v) - spread(own[c]);
            return robust(apart * apart, spread(scale2));
        });
        return sum / float(3 * number);
    }
};

// Costs of each share of the nearer surface for the pixels (n,) of a rim: mean robust residuals of the views, 0..1, for
// shares from 0 to 1, into costs (n, SHARES), with told (n,) set; both stay unchanged with too few views. At the nearer
// surface's disparity, each view shows the same share of that surface before another part of the background (H, W, 4),
// from background_of. A view counts half at the squared residual scale2 plus contrast2 times the squared difference of
// both surfaces' colours, since errors of samples grow with it.
void costs_of_shares(const RimViews &views, const Rim &rim, Array<const float, 3> background, const Sides &sides, double scale2, double contrast2,
                     Array<const std::int64_t, 1> pixels, Array<float, 2> costs, Array<bool, 1> told) {
    const Index W = sides.disparity.shape[1], count = pixels.shape[0];
    parallel_for(0, (count + AT_ONCE - 1) / AT_ONCE, [&](Index task) {
        ShownPixel shown{views, ViewSamples{views}, rim, background, sides, scale2, contrast2};
        for (Index i = task * AT_ONCE; i < std::min(count, (task + 1) * AT_ONCE); ++i)
            if (shown.find(pixels(i) / W, pixels(i) % W, costs.at(i))) told(i) = true;
    });
}

const Submodule submodule("surface_shares", {
    {"costs_of_shares", &costs_of_shares},
    {"FEWEST_SAMPLES", FEWEST_SAMPLES},
    {"FEWEST_ALONE", FEWEST_ALONE},
    {"SHARES", SHARES},
});

}  // namespace sepi::surface_shares
