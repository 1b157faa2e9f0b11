#include "splines.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "kernels/lanes.hpp"
#include "kernels/parallel.hpp"
#include "kernels/sampling.hpp"

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

// The convolution across lines that begin stride apart, of n numbers.
template <Index REACH>
void weighted(const float *lines, Index stride, float *__restrict out, Index n) {
    for (Index x = 0; x < n; ++x) {
        float total = FILTER[FULL_REACH - REACH] * lines[x];
        for (Index k = 1; k <= 2 * REACH; ++k) total += FILTER[FULL_REACH - REACH + k] * lines[k * stride + x];
        out[x] = total;
    }
}

// Coefficients of one row, into out (W + 2 SPLINE_MARGIN): rows (2 REACH + 1, W) has it in the middle, and those round it.
// padded (W + 2 SPLINE_MARGIN + 2 REACH) is scratch.
template <Index REACH>
void coefficient_row(const float *rows, Index W, float *padded, float *out) {
    constexpr Index side = SPLINE_MARGIN + REACH;
    float *inner = padded + side;
    weighted<REACH>(rows, W, inner, W);
    for (Index x = 0; x < side; ++x) {
        inner[-1 - x] = inner[mirrored(-1 - x, W)];
        inner[W + x] = inner[mirrored(W + x, W)];
    }
    weighted<REACH>(padded, 1, out, W + 2 * SPLINE_MARGIN);
}

// A row of a view, its pixels so many numbers apart and their channels so many, times a unit, into each channel's line.
template <class Colour>
void load_colours(const Colour *pixels, Index step, Index next, Index W, float unit, std::array<float *, 3> lines) {
    Index x = 0;
    if (step == 3 && next == 1) {
        for (; x <= W - LANES; x += LANES) {
            const auto [red, green, blue] = load_interleaved(pixels + 3 * x);
            store(lines[0] + x, red * unit);
            store(lines[1] + x, green * unit);
            store(lines[2] + x, blue * unit);
        }
    }
    for (; x < W; ++x)
        for (Index c = 0; c < 3; ++c) lines[c][x] = float(pixels[step * x + next * c]) * unit;
}

std::int16_t whole(float number) { return std::int16_t(std::int32_t(std::nearbyint(number))); }

}  // namespace

void spline_coefficients(Strided<const float, 3> image, Array<float, 3> out) {
    const Index H = image.shape[0], W = image.shape[1];
    parallel_for(0, (H + ROWS_AT_ONCE - 1) / ROWS_AT_ONCE, [&](Index piece) {
        const Index begin = piece * ROWS_AT_ONCE, end = std::min(H, begin + ROWS_AT_ONCE);
        const Scratch<float, 2> rows(end - begin + 2 * FULL_REACH, W);
        const Scratch<float, 1> padded(W + 2 * (SPLINE_MARGIN + FULL_REACH)), row(W + 2 * SPLINE_MARGIN);
        for (Index c = 0; c < image.shape[2]; ++c) {
            for (Index i = 0; i < rows.array().shape[0]; ++i)
                for (Index x = 0; x < W; ++x) rows.array()(i, x) = image(mirrored(begin + i - FULL_REACH, H), x, c);
            for (Index y = begin; y < end; ++y) {
                coefficient_row<FULL_REACH>(rows.array().at(y - begin), W, padded.array().data, row.array().data);
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
        const Scratch<float, 3> rows(4, ROWS_AT_ONCE + 2 * SPLINE_REACH, W);
        for (Index i = 0; i < last - first + 2 * SPLINE_REACH; ++i) {
            const Index y = mirrored(low - SPLINE_MARGIN + first + i - SPLINE_REACH, H);
            const auto line = [&](Index c) { return rows.array().at(c, i); };
            if (begin == 0) load_colours(colours.at(t, s, y), colours.strides[3], colours.strides[4], W, colour_unit, {line(0), line(1), line(2)});
            if (end == 4) std::transform(detail.at(t, s, y - detail_low), detail.at(t, s, y - detail_low) + W, line(3), [&](float number) { return number * detail_unit; });
        }
        const Scratch<float, 1> padded(W + 2 * (SPLINE_MARGIN + SPLINE_REACH));
        const auto lines = zeros<float, 2>(4, width);
        const float *red = lines.array().at(0), *green = lines.array().at(1), *blue = lines.array().at(2), *own = lines.array().at(3);
        for (Index i = first; i < last; ++i) {
            for (Index c = begin; c < end; ++c) coefficient_row<SPLINE_REACH>(rows.array().at(c, i - first), W, padded.array().data, lines.array().at(c));
            std::int16_t *__restrict place = out.at(t, s, i);
            for (Index x = 0; x < width; ++x, place += 4) {
                if (begin == 0) place[0] = whole(red[x]), place[1] = whole(green[x]), place[2] = whole(blue[x]);
                place[3] = whole(own[x]);
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
