// A sample of a cubic spline is a sum of 4 x 4 coefficients. The four channels of a coefficient lie side by side, so that a
// row of four coefficients is one vector of sixteen numbers. Coefficients and weights are whole numbers of 16 bits, of
// which processors multiply twice as many at once as of floats; what the rounding of the sums of columns leaves is a tenth
// of the steps of an 8-bit picture. All else is done for eight pixels at once.
#include "gauss_newton.hpp"

#include <array>

#include "kernels/lanes.hpp"
#include "kernels/parallel.hpp"
#include "splines.hpp"

namespace sepi {
namespace {

using Four = std::array<Float8, 4>;

constexpr std::int32_t ONE = 1 << 15;  // the sum of the weights of coefficients, along either axis

// Eight pixels of a row, what they are compared with, and sums over the views.
struct Pixels {
    Float8 x, disparity;
    Four own, down, across;
    std::array<Float8, 16> sums;
};

// What a view shows of eight pixels: 1 where it sees them, and the four channels there; where it does not, anything.
struct Samples {
    Float8 seen;
    Four channels;
};

// Whole weights, of sum ONE, of the four coefficients round a position, by how far it is beyond the second.
struct CoefficientWeights {
    Int8 before, left, right, after;

    explicit CoefficientWeights(Float8 f) {
        constexpr float ALL = ONE, THIRDS = float(2.0 / 3);
        const Float8 g = 1.0f - f;
        before = truncated(g * g * g * (ALL / 6) + 0.5f);
        after = truncated(f * f * f * (ALL / 6) + 0.5f);
        left = truncated((THIRDS - f * f * (1.0f - f * 0.5f)) * ALL + 0.5f);
        right = truncated((THIRDS - g * g * (1.0f - g * 0.5f)) * ALL + 0.5f);
        // what rounding leaves belongs to the larger, so that a mirrored picture is sampled alike
        const Int8 rest = ONE - before - left - right - after, nearer = left >= right;
        left += rest & nearer;
        right += rest & ~nearer;
    }
};

// Rows of four numbers in either half become columns.
Four transposed_halves(const Four &rows) {
    const auto low = [](Float8 a, Float8 b) { return __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13); };
    const auto high = [](Float8 a, Float8 b) { return __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15); };
    const Float8 a = low(rows[0], rows[2]), b = low(rows[1], rows[3]), c = high(rows[0], rows[2]), d = high(rows[1], rows[3]);
    return {low(a, b), high(a, b), low(c, d), high(c, d)};
}

class View {
  public:
    View(const SplineViews &views, const Seeing &seeing, Index n, Index H, Index W)
        : down_(views.baselines(n, 0)), across_(views.baselines(n, 1)), low_(float(views.low)), bottom_(float(H - 1)), right_(float(W - 1)),
          margin_(seeing.occlusion_margin), unit_(views.unit / float(ONE)) {
        const Index t = views.places(n, 0), s = views.places(n, 1);
        // one coefficient before the picture
        coefficients_ = views.splines.at(t, s, SPLINE_MARGIN - 1, SPLINE_MARGIN - 1), pitch_ = std::int32_t(views.splines.strides[2]);
        nearest_ = seeing.nearest.at(t, s), width_ = std::int32_t(seeing.nearest.strides[2]);
    }

    // Sample pixels of row y; false if the view sees none of them.
    bool sample(Index row, const Pixels &pixels, Samples &samples) const {
        Float8 y = float(row) - pixels.disparity * down_, x = pixels.x - pixels.disparity * across_;
        const Int8 inside = (y >= 0.0f) & (y <= bottom_) & (x >= 0.0f) & (x <= right_);
        // of what is outside, a corner is looked at
        y = inside ? y : spread(low_);
        x = inside ? x : Float8{};
        const Int8 top = truncated(y), left = truncated(x), low = Int8{} + std::int32_t(low_);
        std::int32_t places[LANES], pairs[6][LANES];
        float found[LANES];
        store(places, (truncated(y + 0.5f) - low) * width_ + truncated(x + 0.5f));
        for (int i = 0; i < LANES; ++i) found[i] = nearest_[places[i]];
        const Int8 seen = inside & (load(found) <= pixels.disparity + margin_);
        if (!any(seen)) return false;
        samples.seen = seen ? spread(1) : Float8{};
        // weights in pairs: of the rows each twice, of the columns the first two and the others
        const CoefficientWeights rows(y - __builtin_convertvector(top, Float8)), columns(x - __builtin_convertvector(left, Float8));
        store(pairs[0], rows.before | rows.before << 16);
        store(pairs[1], rows.left | rows.left << 16);
        store(pairs[2], rows.right | rows.right << 16);
        store(pairs[3], rows.after | rows.after << 16);
        store(pairs[4], columns.before | columns.left << 16);
        store(pairs[5], columns.right | columns.after << 16);
        store(places, (top - low) * pitch_ + left * 4);
        Four halves;
        for (int i = 0; i < 4; ++i) {
            const Int8 a = products(places[i], pairs, i), b = products(places[i + 4], pairs, i + 4);
            const Int8 first = __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11), others = __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
            halves[i] = __builtin_convertvector(first + others, Float8) * unit_;
        }
        samples.channels = transposed_halves(halves);
        return true;
    }

    const float down_, across_;  // baseline

  private:
    // Sums of the first two columns of coefficients, of four channels, and of the others, weighted for pixel i.
    Int8 products(Index place, const std::int32_t (&pairs)[6][LANES], int i) const {
        const auto row = [&](Index n) { return rounded_products(load(coefficients_ + place + n * pitch_), Short16(Int8{} + pairs[n][i])); };
        const Short16 sums = row(0) + row(1) + row(2) + row(3);
        // neighbours of one channel side by side
        const Short16 neighbours = __builtin_shufflevector(sums, sums, 0, 4, 1, 5, 2, 6, 3, 7, 8, 12, 9, 13, 10, 14, 11, 15);
        return dot_of_pairs(Int8(neighbours), __builtin_shufflevector(Int8{} + pairs[4][i], Int8{} + pairs[5][i], 0, 1, 2, 3, 12, 13, 14, 15));
    }

    const float low_, bottom_, right_, margin_, unit_;
    const std::int16_t *coefficients_;
    const float *nearest_;
    std::int32_t pitch_, width_;
};

// Derivative of z / (z + scale2) with respect to z, times scale2: 1 for 0.
Float8 robust_weight(Float8 z, float scale2) {
    const Float8 w = scale2 / (scale2 + z);
    return w * w;
}

// Four channels of some pixels, at most eight; 0 of others.
Four load_channels(Array<const float, 3> image, Index y, Index x, Index count) {
    float channels[4][LANES] = {};
    for (Index i = 0; i < count; ++i)
        for (Index c = 0; c < 4; ++c) channels[c][i] = image(y, x + i, c);
    return {load(channels[0]), load(channels[1]), load(channels[2]), load(channels[3])};
}

void store_first(float *place, Float8 lanes, Index count) { std::memcpy(place, &lanes, count * sizeof(float)); }

// Of each eight pixels of the rows: begin them, add what each view that sees one of them shows, and write what comes of it.
// Beginning and writing get the pixels' row, column and number.
template <class Begin, class Add, class Write>
void over_views(const SplineViews &views, const Seeing &seeing, Array<const float, 2> disparity, Index first, Index last, Begin begin, Add add, Write write) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    parallel_for(first, last, [&](Index y) {
        std::array<Pixels, AT_ONCE / LANES> all;
        for (Index left = 0; left < W; left += AT_ONCE) {
            const Index number = std::min(AT_ONCE, W - left);
            const auto each = [&](auto action) {
                for (Index i = 0; i < number; i += LANES) action(all[i / LANES], left + i, std::min<Index>(LANES, number - i));
            };
            each([&](Pixels &pixels, Index x, Index count) {
                float own[LANES] = {};
                std::copy_n(disparity.at(y, x), count, own);
                // beyond the last, pixels lie outside all views
                pixels = {Float8{0, 1, 2, 3, 4, 5, 6, 7} + float(x), load(own), {}, {}, {}, {}};
                begin(pixels, y, x, count);
            });
            for (Index n = 0; n < views.places.shape[0]; ++n) {
                const View view(views, seeing, n, H, W);
                each([&](Pixels &pixels, Index, Index) {
                    if (Samples samples; view.sample(y, pixels, samples)) add(pixels, view, samples);
                });
            }
            each([&](Pixels &pixels, Index x, Index count) { write(pixels, y, x, count); });
        }
    });
}

// What a view adds for a pixel.
struct Terms {
    Float8 slope, curve, residual2, weight;          // of colours
    Float8 detail_slope, detail_curve, detail_weight;

    Terms(const Pixels &pixels, const View &view, const Samples &samples, Array<const float, 1> scales2) {
        Four r, g;
        for (Index c = 0; c < 4; ++c) {
            r[c] = samples.channels[c] - pixels.own[c];
            g[c] = pixels.down[c] * view.down_ + pixels.across[c] * view.across_;
        }
        residual2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
        weight = samples.seen * robust_weight(residual2, scales2(0));
        detail_weight = samples.seen * (3.0f * robust_weight(3.0f * r[3] * r[3], scales2(1)));
        slope = weight * (r[0] * g[0] + r[1] * g[1] + r[2] * g[2]);
        curve = weight * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
        detail_slope = detail_weight * r[3] * g[3];
        detail_curve = detail_weight * g[3] * g[3];
    }

    // To sums of slope and curvature, of colours and of detail.
    void add_to(std::array<Float8, 16> &sums) const {
        sums[0] += slope;
        sums[1] += curve;
        sums[2] += detail_slope;
        sums[3] += detail_curve;
    }
};

// How colours and detail are added up.
struct Shares {
    float colour, detail;

    explicit Shares(const SplineViews &views) : colour(views.shares(0) / views.scales2(0)), detail(views.shares(1) / views.scales2(1)) {}

    void write(const Pixels &pixels, Index count, float *gradient, float *curvature) const {
        store_first(gradient, colour * pixels.sums[0] + detail * pixels.sums[2], count);
        store_first(curvature, colour * pixels.sums[1] + detail * pixels.sums[3], count);
    }
};

// Loads the mean of the views and its derivatives.
auto compared_with(const MeanView &image) {
    return [&](Pixels &pixels, Index y, Index x, Index count) {
        pixels.own = load_channels(image.mean, y, x, count);
        pixels.down = load_channels(image.down, y, x, count);
        pixels.across = load_channels(image.across, y, x, count);
    };
}

}  // namespace

void mean_of_views(const SplineViews &views, const Seeing &seeing, Array<const float, 2> disparity, Index begin, Index end, Array<float, 3> out) {
    const float colour = views.scales2(0), detail = views.scales2(1);
    over_views(
        views, seeing, disparity, begin, end,
        [&](Pixels &pixels, Index y, Index x, Index count) {
            const auto [red, green, blue, own] = pixels.own = load_channels(views.reference, y, x, count);
            // the reference view itself counts in full: weighted channels, and the weights of colours and of detail
            pixels.sums = {red, green, blue, own, spread(1), spread(1)};
        },
        [=](Pixels &pixels, const View &, const Samples &samples) {
            Four r;
            for (Index c = 0; c < 4; ++c) r[c] = samples.channels[c] - pixels.own[c];
            const Float8 weight = samples.seen * robust_weight(r[0] * r[0] + r[1] * r[1] + r[2] * r[2], colour);
            const Float8 detail_weight = samples.seen * robust_weight(3.0f * (r[3] * r[3]), detail);
            for (Index c = 0; c < 3; ++c) pixels.sums[c] += weight * samples.channels[c];
            pixels.sums[3] += detail_weight * samples.channels[3];
            pixels.sums[4] += weight;
            pixels.sums[5] += detail_weight;
        },
        [&](const Pixels &pixels, Index y, Index x, Index count) {
            for (Index i = 0; i < count; ++i)
                for (Index c = 0; c < 4; ++c) out(y, x + i, c) = pixels.sums[c][i] / pixels.sums[c < 3 ? 4 : 5][i];
        });
}

void normal_equations(const SplineViews &views, const Seeing &seeing, Array<const float, 2> disparity, const MeanView &image, Index begin, Index end,
                      Array<float, 2> gradient, Array<float, 2> curvature) {
    const Shares shares(views);
    over_views(
        views, seeing, disparity, begin, end, compared_with(image),
        [&](Pixels &pixels, const View &view, const Samples &samples) { Terms(pixels, view, samples, views.scales2).add_to(pixels.sums); },
        [&](const Pixels &pixels, Index y, Index x, Index count) { shares.write(pixels, count, gradient.at(y, x), curvature.at(y, x)); });
}

void equations_and_evidence(const SplineViews &views, const Seeing &seeing, Array<const float, 2> disparity, const MeanView &image, Index begin, Index end,
                            Array<float, 2> gradient, Array<float, 2> curvature, Array<float, 4> halves, Array<float, 3> rest) {
    const Shares shares(views);
    over_views(
        views, seeing, disparity, begin, end, compared_with(image),
        [&](Pixels &pixels, const View &view, const Samples &samples) {
            const Terms terms(pixels, view, samples, views.scales2);
            terms.add_to(pixels.sums);
            const Float8 evidence[] = {terms.weight * terms.residual2, terms.weight, terms.detail_weight / 3.0f, samples.seen};
            for (Index k = 0; k < 4; ++k) pixels.sums[4 + k] += evidence[k];
            const Float8 slope = shares.colour * terms.slope + shares.detail * terms.detail_slope;
            const Float8 curve = shares.colour * terms.curve + shares.detail * terms.detail_curve;
            const bool belongs[] = {view.across_ < 0, view.across_ > 0, view.down_ < 0, view.down_ > 0};
            for (Index k = 0; k < 4; ++k) {
                if (!belongs[k]) continue;
                pixels.sums[8 + 2 * k] += slope;
                pixels.sums[9 + 2 * k] += curve;
            }
        },
        [&](const Pixels &pixels, Index y, Index x, Index count) {
            shares.write(pixels, count, gradient.at(y, x), curvature.at(y, x));
            for (Index k = 0; k < 4; ++k) {
                store_first(rest.at(k, y, x), pixels.sums[4 + k], count);
                for (Index i = 0; i < 2; ++i) store_first(halves.at(k, i, y, x), pixels.sums[8 + 2 * k + i], count);
            }
        });
}

}  // namespace sepi
