// Sampling shared by kernels: continuation of lines beyond their ends, interpolation weights, nearest pixels.
#pragma once

#include <algorithm>
#include <array>
#include <cstdlib>
#include <optional>

#include "array.hpp"

namespace sepi {

// Index in a line of n that is mirrored at its ends, repeatedly.
inline Index mirrored(Index i, Index n) {
    const Index period = std::max<Index>(1, 2 * n - 2);
    i = std::abs(i) % period;
    return std::min(i, period - i);
}

// Index in a line of n that repeats its ends.
inline Index clamped(Index i, Index n) { return std::min(std::max<Index>(i, 0), n - 1); }

// Weights of the pixels at -1, 0, 1 and 2 for a sample at fraction f, 0..1: cubic convolution (Keys 1981,
// doi:10.1109/TASSP.1981.1163711).
inline std::array<float, 4> cubic_weights(double f) {
    return {
        float(((-0.5 * f + 1.0) * f - 0.5) * f),
        float((1.5 * f - 2.5) * f * f + 1.0),
        float(((-1.5 * f + 2.0) * f + 0.5) * f),
        float((0.5 * f - 0.5) * f * f),
    };
}

inline double squared(double number) { return number * number; }

// Squared distance of two colours.
inline float squared_distance(const float *one, const float *other) {
    const float r = one[0] - other[0], g = one[1] - other[1], b = one[2] - other[2];
    return r * r + g * g + b * b;
}

// Bilinear weights of a pixel, its right neighbour, and both below, for a sample at fractions below and to the right.
inline std::array<float, 4> bilinear_weights(float fy, float fx) { return {(1 - fy) * (1 - fx), (1 - fy) * fx, fy * (1 - fx), fy * fx}; }

// Whether a move by whole pixels and a fraction rounds up; halves go to even moves, symmetric in sign.
inline Index is_nearer_next(Index moved, double fraction) { return fraction > 0.5 || (fraction == 0.5 && moved % 2 != 0); }

// Position of a sample: a pixel, and fractions 0..1 below and to the right of it.
struct Place {
    Index row, column;
    double fy, fx;

    // The pixels on the other side. A sample exactly on a pixel uses that one only, so that a mirrored picture has
    // mirrored samples.
    Index below() const { return row + (fy > 0); }
    Index right() const { return column + (fx > 0); }

    // Row and column of the nearest pixel, for a sample moved from (y, x).
    std::array<Index, 2> nearest(Index y, Index x) const { return {row + is_nearer_next(row - y, fy), column + is_nearer_next(column - x, fx)}; }
};

// Position in a picture (H, W), unless outside or not finite.
inline std::optional<Place> place_within(double down, double across, Index H, Index W) {
    if (!(0 <= down && down <= double(H - 1) && 0 <= across && across <= double(W - 1))) return std::nullopt;
    const auto row = Index(down), column = Index(across);
    return Place{row, column, down - double(row), across - double(column)};
}

// Whether a test holds for all pixels (i, j) of a bilinear sample.
template <class Test>
bool all_about(const Place &at, const Test &test) {
    return test(at.row, at.column) && test(at.row, at.right()) && test(at.below(), at.column) && test(at.below(), at.right());
}

// A bilinear sample of value(i, j).
template <class Value>
float bilinear(const Place &at, const Value &value) {
    const auto [a, b, c, d] = bilinear_weights(float(at.fy), float(at.fx));
    return a * value(at.row, at.column) + b * value(at.row, at.right()) + c * value(at.below(), at.column) + d * value(at.below(), at.right());
}

// Calls body(i, j) for the pixels of a picture (H, W) up to radius away from one, in rows and columns.
template <class Body>
void for_window(Index y, Index x, Index radius, Index H, Index W, const Body &body) {
    for (Index i = std::max<Index>(0, y - radius); i < std::min(H, y + radius + 1); ++i)
        for (Index j = std::max<Index>(0, x - radius); j < std::min(W, x + radius + 1); ++j) body(i, j);
}

}  // namespace sepi
