#include "splines.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "kernels/lanes.hpp"
#include "kernels/parallel.hpp"
#include "kernels/sampling.hpp"
#include "pixels.hpp"

namespace sepi {
namespace {

// How far the convolution reaches where nothing is rounded: beyond it is less than 1e-6.
constexpr Index FULL_REACH = 12;

// Rows of a view that a thread does at a stretch.
constexpr Index ROWS_AT_ONCE = 64;

constexpr auto FILTER = [] {
    std::array<float, 2 * FULL_REACH + 1> filter{};
    double weight = std::numbers::sqrt3;
    for (Index k = 0; k <= FULL_REACH; ++k, weight *= std::numbers::sqrt3 - 2) filter[FULL_REACH - k] = filter[FULL_REACH + k] = float(weight);
    return filter;
}();

// The convolution across lines that begin stride apart, of BLOCK vectors of numbers: each waits for its last product, and the
// others need not.
template <Index REACH, int BLOCK>
void weighted(const float *lines, Index stride, float *out) {
    Float8 totals[BLOCK];
    for (int i = 0; i < BLOCK; ++i) totals[i] = FILTER[FULL_REACH - REACH] * load(lines + i * LANES);
    for (Index k = 1; k <= 2 * REACH; ++k)
        for (int i = 0; i < BLOCK; ++i) totals[i] += FILTER[FULL_REACH - REACH + k] * load(lines + k * stride + i * LANES);
    for (int i = 0; i < BLOCK; ++i) store(out + i * LANES, totals[i]);
}

template <Index REACH>
void weighted(const float *lines, Index stride, float *out, Index n) {
    constexpr int BLOCK = 4;
    Index x = 0;
    for (; x <= n - BLOCK * LANES; x += BLOCK * LANES) weighted<REACH, BLOCK>(lines + x, stride, out + x);
    for (; x < n; x += LANES) weighted<REACH, 1>(lines + x, stride, out + x);
}

// Coefficients of one row, into out (W + 2 SPLINE_MARGIN): of rows, stride apart, number REACH is it, and those round it are
// the others. padded (W + 2 SPLINE_MARGIN + 2 REACH) is scratch. All have LANES numbers behind them.
template <Index REACH>
void coefficient_row(const float *rows, Index stride, Index W, float *padded, float *out) {
    constexpr Index side = SPLINE_MARGIN + REACH;
    float *inner = padded + side;
    weighted<REACH>(rows, stride, inner, W);
    for (Index x = 0; x < side; ++x) {
        inner[-1 - x] = inner[mirrored(-1 - x, W)];
        inner[W + x] = inner[mirrored(W + x, W)];
    }
    weighted<REACH>(padded, 1, out, W + 2 * SPLINE_MARGIN);
}

// The four channels of pixels, rounded, side by side. Lines have LANES numbers behind them.
void store_interleaved(Array<const float, 2> lines, Index number, std::int16_t *out) {
    for (Index x = 0; x < number; x += LANES) {
        const auto pair = [&](Index c) { return (rounded(load(lines.at(c, x))) & 0xFFFF) | rounded(load(lines.at(c + 1, x))) << 16; };
        const Int8 first = pair(0), others = pair(2);
        const Int8 pixels[] = {
            __builtin_shufflevector(first, others, 0, 8, 1, 9, 2, 10, 3, 11),
            __builtin_shufflevector(first, others, 4, 12, 5, 13, 6, 14, 7, 15),
        };
        std::memcpy(out + 4 * x, pixels, std::min<Index>(LANES, number - x) * 4 * sizeof *out);
    }
}

}  // namespace

void spline_coefficients(Strided<const float, 3> image, Array<float, 3> out) {
    const Index H = image.shape[0], W = image.shape[1];
    parallel_for(0, (H + ROWS_AT_ONCE - 1) / ROWS_AT_ONCE, [&](Index piece) {
        const Index begin = piece * ROWS_AT_ONCE, end = std::min(H, begin + ROWS_AT_ONCE);
        const Scratch<float, 2> rows(end - begin + 2 * FULL_REACH, W + LANES);
        const Scratch<float, 1> padded(W + 2 * (SPLINE_MARGIN + FULL_REACH) + LANES), row(W + 2 * SPLINE_MARGIN + LANES);
        for (Index c = 0; c < image.shape[2]; ++c) {
            for (Index i = 0; i < rows.array().shape[0]; ++i)
                for (Index x = 0; x < W; ++x) rows.array()(i, x) = image(mirrored(begin + i - FULL_REACH, H), x, c);
            for (Index y = begin; y < end; ++y) {
                coefficient_row<FULL_REACH>(rows.array().at(y - begin), W + LANES, W, padded.array().data, row.array().data);
                std::copy_n(row.array().at(SPLINE_MARGIN), W, out.at(c, y));
            }
        }
    });
}

template <class Colour>
void view_splines(Strided<const Colour, 5> colours, float colour_unit, Array<const std::int16_t, 4> detail, float detail_unit, Index detail_low,
                  Array<const bool, 2> of_colours, Array<const bool, 2> of_detail, Index low, Array<std::int16_t, 5> out) {
    const Index S = colours.shape[1], H = colours.shape[2], W = colours.shape[3], n = out.shape[2], width = out.shape[3];
    const Index pieces = (n + ROWS_AT_ONCE - 1) / ROWS_AT_ONCE;
    parallel_for(0, colours.shape[0] * S * pieces, [&](Index task) {
        const Index t = task / pieces / S, s = task / pieces % S, first = task % pieces * ROWS_AT_ONCE, last = std::min(n, first + ROWS_AT_ONCE);
        const Index begin = of_colours(t, s) ? 0 : 3, end = of_detail(t, s) ? 4 : 3;
        if (begin == end) return;
        const Scratch<float, 3> scratch(4, ROWS_AT_ONCE + 2 * SPLINE_REACH, W + LANES);
        const Array<float, 3> rows = scratch.array();
        for (Index i = 0; i < last - first + 2 * SPLINE_REACH; ++i) {
            const Index y = mirrored(low - SPLINE_MARGIN + first + i - SPLINE_REACH, H);
            if (begin == 0) split_channels(colours[t][s][y], {rows.at(0, i), {3, W}, {rows.strides[0], 1}}, [=](auto colour) { return colour * colour_unit; });
            if (end == 4)
                for (Index x = 0; x < W; ++x) rows(3, i, x) = float(detail(t, s, y - detail_low, x)) * detail_unit;
        }
        const Scratch<float, 1> padded(W + 2 * (SPLINE_MARGIN + SPLINE_REACH) + LANES);
        const auto lines = zeros<float, 2>(4, width + LANES);
        for (Index i = first; i < last; ++i) {
            for (Index c = begin; c < end; ++c)
                coefficient_row<SPLINE_REACH>(rows.at(c, i - first), W + LANES, W, padded.array().data, lines.array().at(c));
            if (begin == 0) {
                store_interleaved(lines.array(), width, out.at(t, s, i));
            } else {
                for (Index x = 0; x < width; ++x) out(t, s, i, x, 3) = std::int16_t(std::int32_t(std::nearbyint(lines.array()(3, x))));
            }
        }
    });
}

#define INSTANTIATE(Colour)                                                                                                         \
    template void view_splines(Strided<const Colour, 5>, float, Array<const std::int16_t, 4>, float, Index, Array<const bool, 2>, \
                               Array<const bool, 2>, Index, Array<std::int16_t, 5>);
INSTANTIATE(std::uint8_t)
INSTANTIATE(std::uint16_t)
INSTANTIATE(float)
#undef INSTANTIATE

}  // namespace sepi
