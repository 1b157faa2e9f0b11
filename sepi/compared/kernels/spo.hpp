// The spinning parallelogram operator: what lies on either side of a line, as histograms.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

// Distance between the halves of a parallelogram round every pixel: chi-square distance of their two histograms, each of
// sum 1, mean over the channels; out (H, W), 0..1.
// lines (N, C, H, W): EPIs sheared by a candidate, so that its lines are columns; row y of view n is row n of EPI y.
// Colours in 0..1, each of which counts for the two of so many bins between whose middles it lies; what lies beyond the
// middle of the first or last bin counts for that. Columns beyond the ends are like the last ones.
// shares (R): weights of a view's column at distances 1..R from the line; those of all views add up to 1.
void half_distances(Array<const float, 4> lines, Array<const float, 1> shares, Index bins, Array<float, 2> out);

}  // namespace sepi
