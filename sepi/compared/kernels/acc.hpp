// Costs of views that were moved by phases of their spectra.
#pragma once

#include <complex>

#include "kernels/array.hpp"

namespace sepi {

using Complex = std::complex<float>;

// out[m, c, i, j] = spectrum[c, i, j] * (rows[m, i] * columns[m, j]); columns may be more than out has.
void turn_phases(Array<const Complex, 3> spectrum, Array<const Complex, 2> rows, Array<const Complex, 2> columns, Array<Complex, 4> out);

// Add one view's truncated differences of colour and gradient, means over the channels, to out (M, H, W).
// shifted (M, C, H or more, W or more), reference (C, H, W); central differences repeat the first and last pixel.
void add_differences(Array<const float, 4> shifted, Array<const float, 3> reference, double across_share, double colour_share, double colour_truncation,
                     double gradient_truncation, Array<float, 3> out);

}  // namespace sepi
