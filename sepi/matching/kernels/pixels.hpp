// Views of any picture type, and operations on their rows that kernels share.
#pragma once

#include "seen_views.hpp"

namespace sepi {

// Views (T, S, H, W, C) of any picture type.
using Views = std::variant<Strided<const std::uint8_t, 5>, Strided<const std::uint16_t, 5>, Strided<const float, 5>>;

// Coefficients of a spline beyond each side of a view.
constexpr Index SPLINE_MARGIN = 2;

inline std::array<Index, 5> shape_of(const Views &views) {
    return std::visit([](const auto &some) { return some.shape; }, views);
}

// Calls body(t, s, first, number) for groups of the n rows of each view of a grid.
template <class Body>
void over_stretches(std::array<Index, 2> grid, Index n, Index rows, const Body &body) {
    const Index S = grid[1], pieces = (n + rows - 1) / rows;
    parallel_for(0, grid[0] * S * pieces, [&](Index task) {
        const Index view = task / pieces, first = task % pieces * rows;
        body(view / S, view % S, first, std::min(rows, n - first));
    });
}

// Rows from first on of a view (H, W, C), mirrored at its ends: channel by channel into out (C or more, n, W or more), as
// scale converts them.
template <class Colour, class Number, class Scale = std::identity>
void load_rows(Array<const Colour, 3> view, Index first, Array<Number, 3> out, Scale scale = {}) {
    const Index W = view.shape[1], C = std::min(view.shape[2], out.shape[0]);
    for (Index i = 0; i < out.shape[1]; ++i) {
        const auto row = view[mirrored(first + i, view.shape[0])];
        if (C == 3 && row.strides[0] == 3 && row.strides[1] == 1) {
            Number *__restrict red = out.at(0, i), *__restrict green = out.at(1, i), *__restrict blue = out.at(2, i);
            for (Index x = 0; x < W; ++x) {
                const Colour *colour = row.data + 3 * x;
                red[x] = scale(float(colour[0])), green[x] = scale(float(colour[1])), blue[x] = scale(float(colour[2]));
            }
        } else {
            for (Index c = 0; c < C; ++c)
                for (Index x = 0; x < W; ++x) out(c, i, x) = scale(float(row(x, c)));
        }
    }
}

template <class Number, class Scale = std::identity>
void load_rows(const Views &views, Index t, Index s, Index first, Array<Number, 3> out, Scale scale = {}) {
    std::visit([&](const auto &some) { load_rows(some[t][s], first, out, scale); }, views);
}

// C channels of n pixels, from lines that begin stride apart, side by side and STEP from pixel to pixel, as convert makes of them.
template <int C, int STEP = C, class Number, class Convert>
void store_interleaved(const float *lines, Index stride, Index n, Number *__restrict out, Convert convert) {
    for (Index x = 0; x < n; ++x)
        for (Index c = 0; c < C; ++c) out[STEP * x + c] = convert(lines[c * stride + x]);
}

// Weights of the windows of pixels begin..end of row y, summing to one, into weights ((2 radius + 1)^2, end - begin or more);
// zero outside: exp(-distance^2 / (2 variance)) of distances in the guide (3, H, W), by the variance (H, W) of the middle.
inline void window_weights(Array<const float, 3> guide, Array<const float, 2> variance, Index y, Index begin, Index end, Index radius,
                           Array<float, 2> weights) {
    const Index H = guide.shape[1], W = guide.shape[2], size = 2 * radius + 1;
    const auto totals = zeros<float, 1>(end - begin);
    float *__restrict total = totals.array().data;
    const float *variances = variance.at(y, begin);
    std::fill_n(weights.data, size * size * weights.strides[0], 0.0f);
    for (Index i = std::max<Index>(0, radius - y); i < std::min(size, H - y + radius); ++i) {
        for (Index j = 0; j < size; ++j) {
            const Index dx = j - radius, first = std::max(begin, -dx), last = std::min(end, W - dx);
            const float *here[3], *there[3];
            for (Index c = 0; c < 3; ++c) here[c] = guide.at(c, y, begin), there[c] = guide.at(c, y + i - radius, begin + dx);
            float *__restrict weight = weights.at(i * size + j);
            for (Index x = first - begin; x < last - begin; ++x) {
                const float r = here[0][x] - there[0][x], g = here[1][x] - there[1][x], b = here[2][x] - there[2][x];
                weight[x] = exp_of_negative(-0.5f * (r * r + g * g + b * b) / variances[x]);
                total[x] += weight[x];
            }
        }
    }
    for (Index n = 0; n < size * size; ++n) {
        float *__restrict weight = weights.at(n);
        for (Index x = 0; x < end - begin; ++x) weight[x] /= total[x];
    }
}

// Minimum of the parabola through three adjacent costs, from the middle one; 0 for a curvature up to a limit.
template <class Number>
double vertex(const Number *middle, double least) {
    const double bend = middle[-1] - 2 * double(middle[0]) + middle[1];
    return bend > least ? 0.5f * (middle[-1] - middle[1]) / bend : 0;
}

// Mirror a line of n at its ends.
inline void mirror_ends(float *line, Index n, Index beyond) {
    for (Index x = 1; x <= beyond; ++x) {
        line[-x] = line[mirrored(-x, n)];
        line[n - 1 + x] = line[mirrored(n - 1 + x, n)];
    }
}

// Sums of n lines of products, into out: add(total, k, x) adds number k of eight of them. Several vectors at a time hide
// the latency of additions; a known number of vectors lets the compiler unroll the loop. Lines go on for LANES numbers.
template <class Number, class Add>
void sum_products(Index n, Number products, float *out, Add add) {
    const auto block = [&]<int SIZE>(Index x, std::integral_constant<int, SIZE>) {
        Float8 totals[SIZE] = {};
        for (Index k = 0; k < products; ++k)
            for (int i = 0; i < SIZE; ++i) totals[i] = add(totals[i], k, x + i * LANES);
        for (int i = 0; i < SIZE; ++i) store(out + x + i * LANES, totals[i]);
    };
    Index x = 0;
    for (; x <= n - 8 * LANES; x += 8 * LANES) block(x, std::integral_constant<int, 8>());
    for (; x <= n - 4 * LANES; x += 4 * LANES) block(x, std::integral_constant<int, 4>());
    for (; x < n; x += LANES) block(x, std::integral_constant<int, 1>());
}

}  // namespace sepi
