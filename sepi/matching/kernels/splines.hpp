// Cubic splines of the views. Coefficients are a convolution with sqrt(3) (sqrt(3) - 2)^|k| along each axis, mirrored at
// the ends (Unser 1999, doi:10.1109/79.799930); cut off where it is below single precision, so that a row's coefficients
// do not depend on rows far away.
#pragma once

#include "pixels.hpp"

namespace sepi {

// Coefficients beyond each side of a view.
constexpr Index SPLINE_MARGIN = 2;

// How far the convolution of the views' coefficients reaches; beyond it is a tenth of what rounding to int16 does.
constexpr Index SPLINE_REACH = 8;

// Coefficients of an image (H, W, C), into out (C, H, W).
void spline_coefficients(Strided<const float, 3> image, Array<float, 3> out);

// Coefficients of views' colours (T, S, H, W, 3) and detail (T, S, n or 0, W), rounded, into
// out (T, S, n + 2 SPLINE_MARGIN, W + 2 SPLINE_MARGIN, 4), mirrored in the margins.
//
// Colours and detail are multiplied with their units first. Rows of detail begin at detail_low, and reach SPLINE_REACH
// farther than those that are wanted, or to the picture's end; low is the row after the first SPLINE_MARGIN ones of out.
// of_colours and of_detail (T, S) have the views whose colours, and whose detail, are wanted; what out has of others stays.
void view_splines(const Views &views, float colour_unit, Array<const std::int16_t, 4> detail, float detail_unit, Index detail_low,
                  Array<const bool, 2> of_colours, Array<const bool, 2> of_detail, Index low, Array<std::int16_t, 5> out);

}  // namespace sepi
