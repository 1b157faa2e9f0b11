// The Gauss-Newton refinement: sums over the views that see a pixel, of rows begin..end.
//
// A sample of a cubic spline is a sum of 4 x 4 coefficients. The four channels of a coefficient lie side by side, so that a
// row of four coefficients is one vector of sixteen numbers. Coefficients and weights are whole numbers of 16 bits, of
// which processors multiply twice as many at once as of floats. All else is done for eight pixels at once.
#include "pixels.hpp"

namespace sepi::gauss_newton {

// Pixels of a row computed together, so that their data stays in the first cache.
constexpr Index AT_ONCE = 128;

// Views for an iteration: the fields of sepi.matching.spline_views.SplineViews, in their order. The row after the margin is
// the first of the z-buffers.
struct SplineViews {
    Array<const std::int16_t, 5> splines;    // (T, S, n + 2 SPLINE_MARGIN, W + 2 SPLINE_MARGIN, 4)
    float unit;                              // factor of the splines
    Array<const float, 3> reference;         // (H, W, 4)
    Array<const float, 1> scales2, shares;   // of colours and of detail

    bool fields(auto visit) { return visit(splines, unit, reference, scales2, shares); }
};

using Four = std::array<Float8, 4>;

constexpr std::int32_t ONE = 1 << 15;  // the sum of the weights of coefficients, along either axis

// Eight pixels of a row, their reference colours, and their positions in the current view.
struct Pixels {
    Float8 x, disparity;
    Four own;
    Int8 inside;
    std::uint32_t nearest[LANES], coefficients[LANES];  // indices into the z-buffer, and of their first coefficients
    std::int32_t rows[2][LANES];                        // weights of coefficients, of the first two rows, and of the other two
    float columns[4][LANES];
};

// Integer weights, of sum ONE, of the four coefficients round a position, by its distance beyond the second.
std::array<Int8, 4> coefficient_weights(Float8 f) {
    constexpr float ALL = ONE, THIRDS = float(2.0 / 3);
    const Float8 g = 1.0f - f;
    const Int8 before = truncated(g * g * g * (ALL / 6) + 0.5f), after = truncated(f * f * f * (ALL / 6) + 0.5f);
    const Int8 left = truncated((THIRDS - f * f * (1.0f - f * 0.5f)) * ALL + 0.5f), right = truncated((THIRDS - g * g * (1.0f - g * 0.5f)) * ALL + 0.5f);
    // the larger weight gets the remainder of rounding, so that mirrored pictures give mirrored samples
    const Int8 rest = ONE - before - left - right - after, nearer = left >= right;
    return {before, left + (rest & nearer), right + (rest & ~nearer), after};
}

// Rows of four numbers in either half become columns.
Four transposed_halves(const Four &rows) {
    const auto low = [](Float8 a, Float8 b) { return __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13); };
    const auto high = [](Float8 a, Float8 b) { return __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15); };
    const Float8 a = low(rows[0], rows[2]), b = low(rows[1], rows[3]), c = high(rows[0], rows[2]), d = high(rows[1], rows[3]);
    return {low(a, b), high(a, b), low(c, d), high(c, d)};
}

// View number n; pictures (H, W).
struct View {
    const SplineViews &views;
    const SeenViews &seen;
    const Index n, H, W;
    const Index t = seen.places(n, 0), s = seen.places(n, 1);
    const float down = float(seen.baselines(n, 0)), across = float(seen.baselines(n, 1));
    const float bottom = float(H - 1), right = float(W - 1), unit = views.unit / (float(ONE) * float(ONE));
    const std::int32_t low = std::int32_t(seen.low);
    const std::int32_t pitch = std::int32_t(views.splines.strides[2]), width = std::int32_t(seen.nearest.strides[1]);
    const float *const nearest = seen.nearest.at(n);
    // from the one before the picture on
    const std::int16_t *const coefficients = views.splines.at(t, s, SPLINE_MARGIN - 1, SPLINE_MARGIN - 1);

    // Compute the positions of a row's pixels.
    void find(Index row, Pixels &pixels) const {
        const Float8 up = pixels.disparity * down, back = pixels.disparity * across;
        pixels.inside = (up <= float(row)) & (-up <= bottom - float(row)) & (back <= pixels.x) & (-back <= right - pixels.x);
        // nearest position, with halves rounded symmetrically; pixels outside read a corner
        const Int8 y = pixels.inside ? std::int32_t(row - low) - rounded(up) : Int8{}, x = pixels.inside ? truncated(pixels.x) - rounded(back) : Int8{};
        store(pixels.nearest, y * width + x);
        // from there on, in small numbers, so that mirrored pictures give mirrored samples
        const Float8 below = whole(up) - up, beside = whole(back) - back;
        const Int8 above = below < 0.0f, left = beside < 0.0f;
        store(pixels.coefficients, (y + (above & pixels.inside)) * pitch + (x + (left & pixels.inside)) * 4);
        const auto rows = coefficient_weights(above ? below + 1.0f : below), columns = coefficient_weights(left ? beside + 1.0f : beside);
        for (Index n = 0; n < 2; ++n) store(pixels.rows[n], rows[2 * n] | rows[2 * n + 1] << 16);
        for (Index n = 0; n < 4; ++n) store(pixels.columns[n], __builtin_convertvector(columns[n], Float8) * unit);
        // prefetch data for sampling
        __builtin_prefetch(nearest + pixels.nearest[0]);
        for (Index n = 0; n < 4; ++n) __builtin_prefetch(coefficients + pixels.coefficients[0] + n * pitch);
    }

    // Sample the four channels of located pixels. Returns 1 where the view sees them; other samples have any value.
    Float8 sample(const Pixels &pixels, Four &channels) const {
        float found[LANES];
        for (int i = 0; i < LANES; ++i) found[i] = nearest[pixels.nearest[i]];
        const Int8 shown = pixels.inside & (load(found) <= pixels.disparity + seen.margin);
        if (!any(shown)) return Float8{};
        Four halves;
        for (int i = 0; i < 4; ++i) {
            const Float8 a = products(pixels, i), b = products(pixels, i + 4);
            halves[i] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11) + __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
        }
        channels = transposed_halves(halves);
        return shown ? spread(1) : Float8{};
    }

    // Sums of the first two columns of coefficients, of four channels, and of the others, weighted for pixel i. Neither is
    // rounded to whole numbers, so that transposed pictures give transposed samples.
    Float8 products(const Pixels &pixels, int i) const {
        const auto row = [&](Index n) { return load(coefficients + pixels.coefficients[i] + n * pitch); };
        const auto column = [&](auto pairs) {
            return dot_of_pairs(pairs(row(0), row(1)), Int8{} + pixels.rows[0][i]) + dot_of_pairs(pairs(row(2), row(3)), Int8{} + pixels.rows[1][i]);
        };
        // the first and third column of coefficients, and the second and fourth, of neighbours below each other
        const Int8 outer = column([](Short16 a, Short16 b) { return Int8(__builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 8, 24, 9, 25, 10, 26, 11, 27)); });
        const Int8 inner = column([](Short16 a, Short16 b) { return Int8(__builtin_shufflevector(a, b, 4, 20, 5, 21, 6, 22, 7, 23, 12, 28, 13, 29, 14, 30, 15, 31)); });
        const auto weights = [&](int n) { return __builtin_shufflevector(spread(pixels.columns[n][i]), spread(pixels.columns[n + 2][i]), 0, 1, 2, 3, 12, 13, 14, 15); };
        return __builtin_convertvector(outer, Float8) * weights(0) + __builtin_convertvector(inner, Float8) * weights(1);
    }
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

// Derivative weights of the colours.
Float8 dot(const Four &a, const Four &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// For each eight pixels of the rows first..last: begin their sums, add the samples of each view that sees one of them, and
// write the result, at their row, column and number.
template <class Sums, class Begin, class Add, class Write>
void over_views(const SplineViews &views, const SeenViews &seen, Array<const float, 2> disparity, Index first, Index last, Begin begin, Add add, Write write) {
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
            for (Index n = 0; n < seen.number(); ++n) {
                const View view{views, seen, n, H, W};
                each([&](Sums &sums, Index, Index) { view.find(y, sums); });
                each([&](Sums &sums, Index, Index) {
                    Four channels;
                    const Float8 shown = view.sample(sums, channels);
                    if (any(shown > 0.0f)) add(sums, view, shown, channels);
                });
            }
            each([&](const Sums &sums, Index x, Index count) { write(sums, y, x, count); });
        }
    });
}

// Mean of the views that see each pixel, with less weight for views unlike the reference view, into out (H, W, 4).
void mean_of_views(const SplineViews &views, const SeenViews &seen, Array<const float, 2> disparity, Index begin, Index end, Array<float, 3> out) {
    struct Mean : Pixels {
        Four channels;           // times their weights
        Float8 colours, detail;  // weights
    };
    over_views<Mean>(
        views, seen, disparity, begin, end,
        [&](Mean &sums, Index y, Index x, Index count) {
            // the reference view itself counts in full
            sums.channels = sums.own = load_channels(views.reference, y, x, count);
            sums.colours = sums.detail = spread(1);
        },
        [&](Mean &sums, const View &, Float8 seen, const Four &channels) {
            Four r;
            for (Index c = 0; c < 4; ++c) r[c] = channels[c] - sums.own[c];
            const Float8 weight = seen * robust_weight(dot(r, r), views.scales2(0));
            const Float8 detail_weight = seen * robust_weight(3.0f * (r[3] * r[3]), views.scales2(1));
            for (Index c = 0; c < 4; ++c) sums.channels[c] += (c < 3 ? weight : detail_weight) * channels[c];
            sums.colours += weight;
            sums.detail += detail_weight;
        },
        [&](const Mean &sums, Index y, Index x, Index count) {
            for (Index i = 0; i < count; ++i)
                for (Index c = 0; c < 4; ++c) out(y, x + i, c) = sums.channels[c][i] / (c < 3 ? sums.colours : sums.detail)[i];
        });
}

// Sums of each pixel, into out (2 or 14, H, W): gradient and curvature, whose ratio is the update towards less cost. If
// wanted, also the same over the views to the left, to the right, above and below only, misfit, agreement, agreement of
// the detail, and number of views. mean (H, W, 4) is the views' mean, down and across its derivatives.
void equations_of_views(const SplineViews &views, const SeenViews &seen, Array<const float, 2> disparity, Array<const float, 3> mean,
                        Array<const float, 3> down, Array<const float, 3> across, Index begin, Index end, Array<float, 3> out) {
    // slope and curvature, of colours and of detail; and further sums
    struct Equations : Pixels {
        Four down, across;  // derivatives of what pixels are compared with
        Four sums;
        Float8 evidence[12];
    };
    const Index asked = out.shape[0] - 2;
    const float colours = views.shares(0) / views.scales2(0), detail = views.shares(1) / views.scales2(1);
    const auto both = [=](const Four &of) { return std::array{colours * of[0] + detail * of[2], colours * of[1] + detail * of[3]}; };
    over_views<Equations>(
        views, seen, disparity, begin, end,
        [&](Equations &pixels, Index y, Index x, Index count) {
            pixels.own = load_channels(mean, y, x, count);
            pixels.down = load_channels(down, y, x, count);
            pixels.across = load_channels(across, y, x, count);
        },
        [&](Equations &pixels, const View &view, Float8 seen, const Four &channels) {
            Four r, g;
            for (Index c = 0; c < 4; ++c) {
                r[c] = channels[c] - pixels.own[c];
                g[c] = pixels.down[c] * view.down + pixels.across[c] * view.across;
            }
            const Float8 squared = dot(r, r), weight = seen * robust_weight(squared, views.scales2(0));
            const Float8 detail_weight = seen * (3.0f * robust_weight(3.0f * r[3] * r[3], views.scales2(1)));
            const Four terms{weight * dot(r, g), weight * dot(g, g), detail_weight * r[3] * g[3], detail_weight * g[3] * g[3]};
            for (Index k = 0; k < 4; ++k) pixels.sums[k] += terms[k];
            if (asked > 0) {
                const auto of_view = both(terms);
                const bool belongs[] = {view.across < 0, view.across > 0, view.down < 0, view.down > 0};
                const Four rest{weight * squared, weight, detail_weight / 3.0f, seen};
                for (Index k = 0; k < 4; ++k) {
                    for (Index i = 0; belongs[k] && i < 2; ++i) pixels.evidence[2 * k + i] += of_view[i];
                    pixels.evidence[8 + k] += rest[k];
                }
            }
        },
        [&](const Equations &pixels, Index y, Index x, Index count) {
            const auto sums = both(pixels.sums);
            for (Index k = 0; k < 2; ++k) store_first(out.at(k, y, x), sums[k], count);
            for (Index k = 0; k < asked; ++k) store_first(out.at(2 + k, y, x), pixels.evidence[k], count);
        });
}

const Submodule submodule("gauss_newton", {
    {"AT_ONCE", AT_ONCE},
    {"mean_of_views", &mean_of_views},
    {"equations_of_views", &equations_of_views},
});

}  // namespace sepi::gauss_newton
