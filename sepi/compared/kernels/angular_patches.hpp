// Loops over angular patches: what views that are sheared by a candidate show of each pixel of the reference view.
#pragma once

#include <cmath>

#include "kernels/array.hpp"

namespace sepi {

// Calls body(n, x, red, green, blue) with the difference of each view's colour (N, 3, H, W) from a reference's (3, H, W) at
// the pixels of row y, but for one view. View by view: pixels beside each other lie beside each other in all of them.
template <class Body>
void for_differences(Array<const float, 4> sheared, Array<const float, 3> reference, Index left_out, Index y, const Body &body) {
    const float *red = reference.at(0, y), *green = reference.at(1, y), *blue = reference.at(2, y);
    for (Index n = 0; n < sheared.shape[0]; ++n) {
        if (n == left_out) continue;
        const float *r = sheared.at(n, 0, y), *g = sheared.at(n, 1, y), *b = sheared.at(n, 2, y);
        for (Index x = 0; x < sheared.shape[3]; ++x) body(n, x, r[x] - red[x], g[x] - green[x], b[x] - blue[x]);
    }
}

}  // namespace sepi
