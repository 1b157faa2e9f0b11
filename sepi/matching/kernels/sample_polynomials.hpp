// Samples between four pixels of a view, as polynomials of the disparity: what plane sweeps spend their time with.
#pragma once

#include "kernels/lanes.hpp"
#include "sweep_arrays.hpp"

namespace sepi {

// Fractional pixels from the pixel above and to the left to the sample at the origin, and by how many pixels the sample
// moves as the disparity rises by one.
struct Motion {
    float fy, fx, sy, sx;
};

// Squared colour differences of eight pixels: a polynomial of the distance from the origin, constant first.
struct SquaredDifferences {
    Float8 of[5]{};

    // Add how sample and reference pixel differ in one channel. Upper left neighbours begin at upper, lower left ones at
    // lower.
    template <class Colour>
    void add(const Colour *upper, const Colour *lower, const Colour *reference, Motion at) {
        const Float8 left = load(upper), lower_left = load(lower);
        const Float8 across = load(upper + 1) - left, lower_across = load(lower + 1) - lower_left;
        const Float8 down = lower_left - left, both = lower_across - across;
        const Float8 fx = spread(at.fx), fy = spread(at.fy);
        const Float8 constant = fma(fy, fma(fx, both, down), fma(fx, across, left - load(reference)));
        const Float8 linear = fma(both, spread(at.fx * at.sy + at.fy * at.sx), fma(down, spread(at.sy), across * spread(at.sx)));
        const Float8 quadratic = both * spread(at.sy * at.sx), twice = linear + linear;
        of[0] = fma(constant, constant, of[0]);
        of[1] = fma(constant, twice, of[1]);
        of[2] = fma(linear, linear, fma(constant + constant, quadratic, of[2]));
        of[3] = fma(twice, quadratic, of[3]);
        of[4] = fma(quadratic, quadratic, of[4]);
    }

    // Have them be 0 but for the first pixels.
    void keep_first(Index number) {
        for (Float8 &each : of) each = first_lanes(each, number, 0);
    }

    // Rounding makes none negative.
    Float8 at(Float8 distance) const {
        Float8 sum = of[4];
        for (int power = 3; power >= 0; --power) sum = fma(distance, sum, of[power]);
        return larger(sum, Float8{});
    }
};

// Row above the samples of a row, and how far below it they are.
struct UpperRow {
    Index top;
    float below;
};

inline UpperRow upper_row(Index y, Index down, float fy, Index height) {
    // the last row has none below: seen from the one above
    if (y + down == height - 1 && fy == 0) return {height - 2, 1.0f};
    return {y + down, fy};
}

// The candidates begin..end whose samples are between the same four pixels, or the same of them.
inline Index end_of_same_pixels(Index begin, Index number, const std::int64_t *down, const float *fy, const std::int64_t *across, const float *fx) {
    Index k = begin + 1;
    while (k < number && down[k - 1] == down[k] && across[k - 1] == across[k] && (fy[k - 1] == 0) == (fy[k] == 0) &&
           (fx[k - 1] == 0) == (fx[k] == 0))
        ++k;
    return k;
}

// Number of the candidate that is the origin of begin..end. A disparity of 0, which can only be at an end, is one:
// nothing is rounded there.
inline Index origin_of(const float *disparities, Index begin, Index end) {
    return disparities[begin] >= 0 ? begin : end - 1;
}

}  // namespace sepi
