// Rows of pixels.
#pragma once

#include "kernels/lanes.hpp"

namespace sepi {

// Each channel of a row (W, C) by itself into out (C, W or more), as what scale makes of numbers and of vectors of float.
template <class Colour, class Scale, class Number = float>
void split_channels(Array<const Colour, 2> row, Array<Number, 2> out, Scale scale) {
    const Index W = row.shape[0], C = row.shape[1];
    Index x = 0;
    if (C == 3 && row.strides[0] == 3 && row.strides[1] == 1) {
        for (; x <= W - LANES; x += LANES) {
            const auto [red, green, blue] = load_interleaved(row.at(x));
            store(out.at(0, x), scale(red));
            store(out.at(1, x), scale(green));
            store(out.at(2, x), scale(blue));
        }
    }
    if (C == 1 && row.strides[0] == 1)
        for (; x <= W - LANES; x += LANES) store(out.at(0, x), scale(load(row.at(x))));
    for (Index c = 0; c < C; ++c)
        for (Index i = x; i < W; ++i) out(c, i) = scale(float(row(i, c)));
}

}  // namespace sepi
