// The evidence by colour mixture.
#pragma once

#include <tuple>

#include "kernels/array.hpp"

namespace sepi {

// The least and the largest disparity of each pixel and its eight neighbours: the fields of
// sepi.boundaries.surroundings.Surroundings, in their order; (H, W).
struct Surroundings {
    Array<const float, 2> farthest, nearest;

    auto fields() { return std::tie(farthest, nearest); }
};

// How surely little of the nearer surface is in a pixel, 0..1, into out (H, W) where it is any; guide (H, W, 3).
void mixture_evidence(Array<const float, 2> disparity, const Surroundings &around, Strided<const float, 3> guide, double discontinuity, Index radius,
                      double contrast, double threshold, double least_variance, Array<float, 2> out);

}  // namespace sepi
