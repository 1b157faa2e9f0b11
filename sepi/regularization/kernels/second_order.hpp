// Second-order smoothing: its matrix, as a stencil, and the hats of its preconditioner.
//
// Pictures have a margin of MARGIN pixels of zeros on each side, so that no loop has to look where it is; hats have
// none. Node i of the finest lies at SPACING i - 0.5 pixels; a coarser level has every other node, and each of its hats
// is one of the finer level and half of each of its neighbours. Sums are those of rows, taken one after the other, to
// the same bits on any number of threads. Number is float or double.
#pragma once

#include "kernels/array.hpp"

namespace sepi {

constexpr Index MARGIN = 2;   // how far second differences reach, pixels
constexpr Index SPACING = 2;  // pixels from node to node of the finest hats

// Weights of second differences in one direction; corners (n, 2) and factors (n) say what pixels make a difference.
void weights_of_differences(Array<const float, 2> disparity, Array<const float, 2> reliability, Array<const double, 2> colour,
                            Array<const std::int64_t, 2> corners, Array<const double, 1> factors, double threshold, double variance, Array<double, 2> out);

// direction becomes ratio * direction + ahead, and out the matrix times that; returns the inner product of both.
template <class Number>
double turn_and_bend(Array<const Number, 3> stencil, Array<const Number, 2> ahead, Number ratio, Array<Number, 2> direction, Array<Number, 2> out);

// Add a direction, so many times, to a solution, and take what the matrix makes of it, bent, from the residual; returns
// the squared norm of the residual.
template <class Number>
double step(Number length, Array<const Number, 2> direction, Array<const Number, 2> bent, Array<Number, 2> solution, Array<Number, 2> residual);

// Inner products of a picture with the finest hats, out (h, w).
template <class Number>
void onto_finest(Array<const Number, 2> vector, Array<Number, 2> out);

// out becomes inverse * vector, plus the finest hats; returns the inner product of vector and out.
template <class Number>
double diagonal_and_finest(Array<const Number, 2> inverse, Array<const Number, 2> vector, Array<const Number, 2> fine, Array<Number, 2> out);

// What the matrix has on its diagonal as hats spacing pixels apart see it, out (h, w).
void diagonal_of_hats(Array<const double, 3> stencil, Index spacing, Array<double, 2> out);

}  // namespace sepi
