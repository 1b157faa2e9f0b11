// What kernels decide alike about pixels: where a line goes on beyond its end, how a sample weighs its neighbours,
// which of two surfaces a view shows.
#pragma once

#include <algorithm>
#include <array>
#include <cstdlib>

#include "array.hpp"

namespace sepi {

// Index in a line of n that is mirrored at its ends, for ever.
inline Index mirrored(Index i, Index n) {
    const Index period = std::max<Index>(1, 2 * n - 2);
    i = std::abs(i) % period;
    return std::min(i, period - i);
}

// Index in a line of n that goes on as it ends.
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

}  // namespace sepi
