#include <nanobind/stl/variant.h>

#include "gauss_newton.hpp"
#include "kernels/arguments.hpp"
#include "splines.hpp"
#include "surface_windows.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using sepi::Unlocked;

void bind_splines(nb::module_ &kernels) {
    auto splines = kernels.def_submodule("splines");
    splines.attr("MARGIN") = sepi::SPLINE_MARGIN;
    splines.attr("REACH") = sepi::SPLINE_REACH;
    splines.def("spline_coefficients", &sepi::spline_coefficients, Unlocked(), "image"_a, "out"_a);
    splines.def("view_splines", &sepi::view_splines, Unlocked(), "colours"_a, "colour_unit"_a, "detail"_a, "detail_unit"_a, "detail_low"_a, "of_colours"_a,
                "of_detail"_a, "low"_a, "out"_a);

    auto gauss_newton = kernels.def_submodule("gauss_newton");
    gauss_newton.attr("AT_ONCE") = sepi::AT_ONCE;
    gauss_newton.def("mean_of_views", &sepi::mean_of_views, Unlocked(), "views"_a, "seeing"_a, "disparity"_a, "begin"_a, "end"_a, "out"_a);
    gauss_newton.def("equations_of_views", &sepi::equations_of_views, Unlocked(), "views"_a, "seeing"_a, "disparity"_a, "image"_a, "begin"_a, "end"_a,
                     "out"_a);

    auto surface_windows = kernels.def_submodule("surface_windows");
    surface_windows.def("sums_of_surface", &sepi::sums_of_surface, Unlocked(), "gradient"_a, "curvature"_a, "disparity"_a, "colours"_a, "radius"_a, "width"_a,
                        "colour_width"_a, "least"_a, "sums"_a);
}
