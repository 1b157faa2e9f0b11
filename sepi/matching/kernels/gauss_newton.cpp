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

// Eight pixels of a row, what they are compared with, and where the view at hand has them.
struct Pixels {
    Float8 x, disparity;
    Four own;
    Int8 inside;
    std::uint32_t nearest[LANES], coefficients[LANES];  // what hides them, and the first of their coefficients
    std::int32_t weights[6][LANES];                     // of these, in pairs: of the four rows each twice, of the columns the first two and the others
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

struct View {
    float down, across;  // baseline

    View(const SplineViews &views, const Seeing &seeing, Index n, Index H, Index W)
        : down(views.baselines(n, 0)), across(views.baselines(n, 1)), low_(std::int32_t(views.low)), bottom_(float(H - 1)), right_(float(W - 1)),
          margin_(seeing.occlusion_margin), unit_(views.unit / float(ONE)), pitch_(std::int32_t(views.splines.strides[2])),
          width_(std::int32_t(seeing.nearest.strides[2])), nearest_(seeing.nearest.at(views.places(n, 0), views.places(n, 1))),
          // one before the picture
          coefficients_(views.splines.at(views.places(n, 0), views.places(n, 1), SPLINE_MARGIN - 1, SPLINE_MARGIN - 1)) {}

    // Find pixels of a row.
    void find(Index row, Pixels &pixels) const {
        Float8 y = float(row) - pixels.disparity * down, x = pixels.x - pixels.disparity * across;
        pixels.inside = (y >= 0.0f) & (y <= bottom_) & (x >= 0.0f) & (x <= right_);
        // of what is outside, a corner is looked at
        y = pixels.inside ? y : spread(float(low_));
        x = pixels.inside ? x : Float8{};
        const Int8 top = truncated(y), left = truncated(x);
        store(pixels.nearest, (truncated(y + 0.5f) - low_) * width_ + truncated(x + 0.5f));
        store(pixels.coefficients, (top - low_) * pitch_ + left * 4);
        const CoefficientWeights rows(y - __builtin_convertvector(top, Float8)), columns(x - __builtin_convertvector(left, Float8));
        store(pixels.weights[0], rows.before | rows.before << 16);
        store(pixels.weights[1], rows.left | rows.left << 16);
        store(pixels.weights[2], rows.right | rows.right << 16);
        store(pixels.weights[3], rows.after | rows.after << 16);
        store(pixels.weights[4], columns.before | columns.left << 16);
        store(pixels.weights[5], columns.right | columns.after << 16);
        // what sampling asks for comes while others are found
        __builtin_prefetch(nearest_ + pixels.nearest[0]);
        for (Index n = 0; n < 4; ++n) __builtin_prefetch(coefficients_ + pixels.coefficients[0] + n * pitch_);
    }

    // Sample pixels that are found; false if the view sees none of them.
    bool sample(const Pixels &pixels, Samples &samples) const {
        float found[LANES];
        for (int i = 0; i < LANES; ++i) found[i] = nearest_[pixels.nearest[i]];
        const Int8 seen = pixels.inside & (load(found) <= pixels.disparity + margin_);
        if (!any(seen)) return false;
        samples.seen = seen ? spread(1) : Float8{};
        Four halves;
        for (int i = 0; i < 4; ++i) {
            const Int8 a = products(pixels, i), b = products(pixels, i + 4);
            const Int8 first = __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11), others = __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
            halves[i] = __builtin_convertvector(first + others, Float8) * unit_;
        }
        samples.channels = transposed_halves(halves);
        return true;
    }

  private:
    // Sums of the first two columns of coefficients, of four channels, and of the others, weighted for pixel i.
    Int8 products(const Pixels &pixels, int i) const {
        const auto line = [&](Index n) { return Int8{} + pixels.weights[n][i]; };
        const auto row = [&](Index n) { return rounded_products(load(coefficients_ + pixels.coefficients[i] + n * pitch_), Short16(line(n))); };
        const Short16 sums = row(0) + row(1) + row(2) + row(3);
        // neighbours of one channel side by side
        const Short16 neighbours = __builtin_shufflevector(sums, sums, 0, 4, 1, 5, 2, 6, 3, 7, 8, 12, 9, 13, 10, 14, 11, 15);
        return dot_of_pairs(Int8(neighbours), __builtin_shufflevector(line(4), line(5), 0, 1, 2, 3, 12, 13, 14, 15));
    }

    std::int32_t low_;
    float bottom_, right_, margin_, unit_;
    std::int32_t pitch_, width_;
    const float *nearest_;
    const std::int16_t *coefficients_;
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

// Of each eight pixels of the rows first..last: begin them, add what each view that sees one of them shows, and write what
// comes of it, at their row, column and number.
template <class Sums, class Begin, class Add, class Write>
void over_views(const SplineViews &views, const Seeing &seeing, Array<const float, 2> disparity, Index first, Index last, Begin begin, Add add, Write write) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    parallel_for(first, last, [&](Index y) {
        std::array<Sums, AT_ONCE / LANES> all;
        for (Index left = 0; left < W; left += AT_ONCE) {
            const Index number = std::min(AT_ONCE, W - left);
            const auto each = [&](auto action) {
                for (Index i = 0; i < number; i += LANES) action(all[i / LANES], left + i, std::min<Index>(LANES, number - i));
            };
            each([&](Sums &sums, Index x, Index count) {
                sums = Sums();
                sums.x = Float8{0, 1, 2, 3, 4, 5, 6, 7} + float(x);
                // beyond the last, pixels lie outside all views
                std::memcpy(&sums.disparity, disparity.at(y, x), count * sizeof(float));
                begin(sums, y, x, count);
            });
            for (Index n = 0; n < views.places.shape[0]; ++n) {
                const View view(views, seeing, n, H, W);
                each([&](Sums &sums, Index, Index) { view.find(y, sums); });
                each([&](Sums &sums, Index, Index) {
                    if (Samples samples; view.sample(sums, samples)) add(sums, view, samples);
                });
            }
            each([&](const Sums &sums, Index x, Index count) { write(sums, y, x, count); });
        }
    });
}

struct Mean : Pixels {
    Four channels;           // times their weights
    Float8 colours, detail;  // weights
};

// What a view adds for a pixel: slope and curvature, the colours' squared residual, and weights.
struct Terms {
    Float8 slope, curve, detail_slope, detail_curve, residual2, weight, detail_weight;
};

struct Equations : Pixels {
    Four down, across;  // derivatives of what pixels are compared with
    Float8 slope, curve, detail_slope, detail_curve;

    void begin(const MeanView &image, Index y, Index x, Index count) {
        own = load_channels(image.mean, y, x, count);
        down = load_channels(image.down, y, x, count);
        across = load_channels(image.across, y, x, count);
    }

    Terms add(const View &view, const Samples &samples, const SplineViews &views) {
        Four r, g;
        for (Index c = 0; c < 4; ++c) {
            r[c] = samples.channels[c] - own[c];
            g[c] = down[c] * view.down + across[c] * view.across;
        }
        const Float8 residual2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
        const Float8 weight = samples.seen * robust_weight(residual2, views.scales2(0));
        const Float8 detail_weight = samples.seen * (3.0f * robust_weight(3.0f * r[3] * r[3], views.scales2(1)));
        const Terms terms{weight * (r[0] * g[0] + r[1] * g[1] + r[2] * g[2]), weight * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]),
                          detail_weight * r[3] * g[3], detail_weight * g[3] * g[3], residual2, weight, detail_weight};
        slope += terms.slope;
        curve += terms.curve;
        detail_slope += terms.detail_slope;
        detail_curve += terms.detail_curve;
        return terms;
    }
};

struct Evidence : Equations {
    std::array<std::array<Float8, 2>, 4> halves;
    Four rest;
};

// Of colours and detail together, by their shares.
struct Both {
    Float8 slope, curve;

    template <class Parts>
    Both(const Parts &parts, const SplineViews &views) {
        const float colour = views.shares(0) / views.scales2(0), detail = views.shares(1) / views.scales2(1);
        slope = colour * parts.slope + detail * parts.detail_slope;
        curve = colour * parts.curve + detail * parts.detail_curve;
    }
};

}  // namespace

void mean_of_views(const SplineViews &views, const Seeing &seeing, Array<const float, 2> disparity, Index begin, Index end, Array<float, 3> out) {
    over_views<Mean>(
        views, seeing, disparity, begin, end,
        [&](Mean &sums, Index y, Index x, Index count) {
            // the reference view itself counts in full
            sums.channels = sums.own = load_channels(views.reference, y, x, count);
            sums.colours = sums.detail = spread(1);
        },
        [&](Mean &sums, const View &, const Samples &samples) {
            Four r;
            for (Index c = 0; c < 4; ++c) r[c] = samples.channels[c] - sums.own[c];
            const Float8 weight = samples.seen * robust_weight(r[0] * r[0] + r[1] * r[1] + r[2] * r[2], views.scales2(0));
            const Float8 detail_weight = samples.seen * robust_weight(3.0f * (r[3] * r[3]), views.scales2(1));
            for (Index c = 0; c < 4; ++c) sums.channels[c] += (c < 3 ? weight : detail_weight) * samples.channels[c];
            sums.colours += weight;
            sums.detail += detail_weight;
        },
        [&](const Mean &sums, Index y, Index x, Index count) {
            for (Index i = 0; i < count; ++i)
                for (Index c = 0; c < 4; ++c) out(y, x + i, c) = sums.channels[c][i] / (c < 3 ? sums.colours : sums.detail)[i];
        });
}

void normal_equations(const SplineViews &views, const Seeing &seeing, Array<const float, 2> disparity, const MeanView &image, Index begin, Index end,
                      Array<float, 2> gradient, Array<float, 2> curvature) {
    over_views<Equations>(
        views, seeing, disparity, begin, end, [&](Equations &sums, Index y, Index x, Index count) { sums.begin(image, y, x, count); },
        [&](Equations &sums, const View &view, const Samples &samples) { sums.add(view, samples, views); },
        [&](const Equations &sums, Index y, Index x, Index count) {
            const Both both(sums, views);
            store_first(gradient.at(y, x), both.slope, count);
            store_first(curvature.at(y, x), both.curve, count);
        });
}

void equations_and_evidence(const SplineViews &views, const Seeing &seeing, Array<const float, 2> disparity, const MeanView &image, Index begin, Index end,
                            Array<float, 2> gradient, Array<float, 2> curvature, Array<float, 4> halves, Array<float, 3> rest) {
    over_views<Evidence>(
        views, seeing, disparity, begin, end, [&](Evidence &sums, Index y, Index x, Index count) { sums.begin(image, y, x, count); },
        [&](Evidence &sums, const View &view, const Samples &samples) {
            const Terms terms = sums.add(view, samples, views);
            const Four rest_of_view{terms.weight * terms.residual2, terms.weight, terms.detail_weight / 3.0f, samples.seen};
            const Both both(terms, views);
            const bool belongs[] = {view.across < 0, view.across > 0, view.down < 0, view.down > 0};
            for (Index k = 0; k < 4; ++k) {
                sums.rest[k] += rest_of_view[k];
                if (!belongs[k]) continue;
                sums.halves[k][0] += both.slope;
                sums.halves[k][1] += both.curve;
            }
        },
        [&](const Evidence &sums, Index y, Index x, Index count) {
            const Both both(sums, views);
            store_first(gradient.at(y, x), both.slope, count);
            store_first(curvature.at(y, x), both.curve, count);
            for (Index k = 0; k < 4; ++k) {
                store_first(rest.at(k, y, x), sums.rest[k], count);
                for (Index i = 0; i < 2; ++i) store_first(halves.at(k, i, y, x), sums.halves[k][i], count);
            }
        });
}

}  // namespace sepi
