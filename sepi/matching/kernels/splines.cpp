// Cubic splines of the views. Coefficients are a convolution with sqrt(3) (sqrt(3) - 2)^|k| along each axis, mirrored at
// the ends (Unser 1999, doi:10.1109/79.799930); cut off where it is below single precision, so that a row's coefficients
// do not depend on rows far away.
#include "pixels.hpp"

namespace sepi::splines {

// Reach of the convolution for the views' coefficients; the rest is a tenth of the rounding to int16.
constexpr Index SPLINE_REACH = 8;

// Reach of the convolution without rounding; the rest is below 1e-6.
constexpr Index FULL_REACH = 12;

// Rows of a view for a turn of a thread.
constexpr Index ROWS_AT_ONCE = 64;

constexpr auto FILTER = [] {
    std::array<float, 2 * FULL_REACH + 1> filter{};
    double weight = std::numbers::sqrt3;
    for (Index k = 0; k <= FULL_REACH; ++k, weight *= std::numbers::sqrt3 - 2) filter[FULL_REACH - k] = filter[FULL_REACH + k] = float(weight);
    return filter;
}();

// Coefficients of a row of W, of which lines begins REACH above, into out (W + 2 SPLINE_MARGIN), which has LANES numbers
// behind it; padded (W + 2 (SPLINE_MARGIN + REACH)), which has them, too, is scratch.
template <Index REACH>
void coefficients(const float *lines, Index W, float *padded, float *out) {
    const auto convolve = [](const float *from, Index stride, Index n, float *to) {
        sum_products(n, std::integral_constant<Index, 2 * REACH + 1>(), to, [=](Float8 total, Index k, Index x) {
            return total + FILTER[FULL_REACH - REACH + k] * load(from + k * stride + x);
        });
    };
    float *inner = padded + SPLINE_MARGIN + REACH;
    convolve(lines, W + LANES, W, inner);
    mirror_ends(inner, W, SPLINE_MARGIN + REACH);
    convolve(padded, 1, W + 2 * SPLINE_MARGIN, out);
}

// Coefficients of an image (H, W, C), into out (C, H, W).
void spline_coefficients(Strided<const float, 3> image, Array<float, 3> out) {
    const Index H = image.shape[0], W = image.shape[1], C = image.shape[2];
    over_stretches({1, 1}, H, ROWS_AT_ONCE, [&](Index, Index, Index first, Index number) {
        const Scratch<float, 3> lines(C, number + 2 * FULL_REACH, W + LANES);
        load_rows<float>(image, first - FULL_REACH, lines.array());
        const Scratch<float, 1> row(W + 2 * SPLINE_MARGIN + LANES), padded(W + 2 * (SPLINE_MARGIN + FULL_REACH) + LANES);
        for (Index c = 0; c < C; ++c) {
            for (Index i = 0; i < number; ++i) {
                coefficients<FULL_REACH>(lines.array().at(c, i), W, padded.array().data, row.array().data);
                std::copy_n(row.array().at(SPLINE_MARGIN), W, out.at(c, first + i));
            }
        }
    });
}

// Coefficients of views' colours (T, S, H, W, 3) and detail (T, S, n or 0, W), rounded, into
// out (T, S, n + 2 SPLINE_MARGIN, W + 2 SPLINE_MARGIN, 4), mirrored in the margins.
//
// Colours and detail are multiplied by their units first. Rows of detail begin at detail_low, and reach SPLINE_REACH
// beyond those wanted, or to the picture's end; low is the row after the first SPLINE_MARGIN ones of out. of_colours and
// of_detail (T, S) are masks of the views whose colours, and whose detail, are wanted; others stay unchanged in out.
void view_splines(const Views &views, float colour_unit, Array<const std::int16_t, 4> detail, float detail_unit, Index detail_low,
                  Array<const bool, 2> of_colours, Array<const bool, 2> of_detail, Index low, Array<std::int16_t, 5> out) {
    const Index H = shape_of(views)[2], width = out.shape[3], W = width - 2 * SPLINE_MARGIN;
    over_stretches(of_colours.shape, out.shape[2], ROWS_AT_ONCE, [&](Index t, Index s, Index first, Index number) {
        const Index begin = of_colours(t, s) ? 0 : 3, end = of_detail(t, s) ? 4 : 3, top = low - SPLINE_MARGIN + first - SPLINE_REACH;
        if (begin == end) return;
        const Scratch<float, 3> lines(4, number + 2 * SPLINE_REACH, W + LANES);
        if (begin == 0) load_rows(views, t, s, top, lines.array(), [=](auto colour) { return colour * colour_unit; });
        for (Index i = 0; end == 4 && i < number + 2 * SPLINE_REACH; ++i) {
            const std::int16_t *row = detail.at(t, s, mirrored(top + i, H) - detail_low);
            std::transform(row, row + W, lines.array().at(3, i), [=](std::int16_t value) { return float(value) * detail_unit; });
        }
        const Index stride = width + LANES;
        const auto row = zeros<float, 2>(4, stride);
        const Scratch<float, 1> padded(W + 2 * (SPLINE_MARGIN + SPLINE_REACH) + LANES);
        for (Index i = 0; i < number; ++i) {
            for (Index c = begin; c < end; ++c)
                coefficients<SPLINE_REACH>(lines.array().at(c, i), W, padded.array().data, row.array().at(c));
            const float *from = row.array().at(begin);
            std::int16_t *to = out.at(t, s, first + i, 0, begin);
            const auto whole = [](float value) { return std::int16_t(rounded(value)); };
            begin == 0 ? store_interleaved<4>(from, stride, width, to, whole) : store_interleaved<1, 4>(from, stride, width, to, whole);
        }
    });
}

const Submodule submodule("splines", {
    {"MARGIN", SPLINE_MARGIN},
    {"REACH", SPLINE_REACH},
    {"spline_coefficients", &spline_coefficients},
    {"view_splines", &view_splines},
});

}  // namespace sepi::splines
