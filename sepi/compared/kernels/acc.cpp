#include "acc.hpp"

#include <cmath>

#include "kernels/parallel.hpp"

namespace sepi {
namespace {

// out[j] = from[j] * (row * column[j]) of n complex numbers, their parts side by side: the plain formula, since that of
// std::complex looks for infinities, and does not vectorise.
void turn(const float *from, Complex row, const float *column, Index n, float *__restrict out) {
    const float real = row.real(), imaginary = row.imag();
    for (Index j = 0; j < 2 * n; j += 2) {
        const float a = real * column[j] - imaginary * column[j + 1], b = real * column[j + 1] + imaginary * column[j];
        out[j] = from[j] * a - from[j + 1] * b;
        out[j + 1] = from[j] * b + from[j + 1] * a;
    }
}

const float *parts(const Complex *numbers) { return reinterpret_cast<const float *>(numbers); }

}  // namespace

void turn_phases(Array<const Complex, 3> spectrum, Array<const Complex, 2> rows, Array<const Complex, 2> columns, Array<Complex, 4> out) {
    const Index C = out.shape[1], H = out.shape[2], W = out.shape[3];
    parallel_for(0, out.shape[0] * C, [&](Index number) {
        const Index m = number / C, c = number % C;
        for (Index i = 0; i < H; ++i) turn(parts(spectrum.at(c, i)), rows(m, i), parts(columns.at(m)), W, reinterpret_cast<float *>(out.at(m, c, i)));
    });
}

void add_differences(Array<const float, 4> shifted, Array<const float, 3> reference, double across_share, double colour_share, double colour_truncation,
                     double gradient_truncation, Array<float, 3> out) {
    const Index H = out.shape[1], W = out.shape[2], C = reference.shape[0];
    const float share = float(colour_share), part = float(1.0 / double(C)), half = float(0.5 / double(C));
    const float across = float((1 - colour_share) * across_share), down = float((1 - colour_share) * (1 - across_share));
    const float most = float(colour_truncation), steepest = float(gradient_truncation);
    parallel_for(0, H, [&](Index y) {
        const Scratch<float, 2> rows(4, W + 2);
        float *__restrict residual = rows.array().at(0, 1), *__restrict colour = rows.array().at(1);
        float *__restrict right = rows.array().at(2), *__restrict below = rows.array().at(3);
        const Index above = std::max<Index>(y - 1, 0), under = std::min(y + 1, H - 1);
        for (Index m = 0; m < out.shape[0]; ++m) {
            std::fill_n(colour, 3 * (W + 2), 0.0f);
            for (Index c = 0; c < C; ++c) {
                const float *here = shifted.at(m, c, y), *upper = shifted.at(m, c, above), *lower = shifted.at(m, c, under);
                const float *own = reference.at(c, y), *own_upper = reference.at(c, above), *own_lower = reference.at(c, under);
                for (Index x = 0; x < W; ++x) {
                    residual[x] = here[x] - own[x];
                    colour[x] += std::abs(residual[x]);
                    below[x] += std::abs((lower[x] - own_lower[x]) - (upper[x] - own_upper[x]));
                }
                residual[-1] = residual[0], residual[W] = residual[W - 1];
                for (Index x = 0; x < W; ++x) right[x] += std::abs(residual[x + 1] - residual[x - 1]);
            }
            float *__restrict cost = out.at(m, y);
            for (Index x = 0; x < W; ++x)
                cost[x] += share * std::min(part * colour[x], most) + across * std::min(half * right[x], steepest) + down * std::min(half * below[x], steepest);
        }
    });
}

}  // namespace sepi
