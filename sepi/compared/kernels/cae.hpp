// The constrained angular entropy and the constrained adaptive defocus.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

constexpr Index LEVELS = 256;  // bins of the histograms, over colours in 0..1
constexpr Index PATCH = 5;     // width of a sub-patch in pixels; three by three of them make up the neighbourhood of a pixel

// Entropy of each channel's angular patch, each view weighted by how near its level is to that of the reference view.
// sheared (N, 3, H, W), own (3, H, W) the reference view, weights[d] at a difference of d levels, 0 beyond; out (3, H, W).
void constrained_entropies(Array<const float, 4> sheared, Array<const float, 3> own, Array<const float, 1> weights, Array<float, 3> out);

// Least over the sub-patches round a pixel of their weighted mean response and what their colours add to it.
// response (H, W, K), guide (H, W, 3), out (H, W, K). Beyond its border a picture goes on as it ends.
void constrained_least_patch(Array<const float, 3> response, Array<const float, 3> guide, float sigma, float constraint, Array<float, 3> out);

}  // namespace sepi
