#include <nanobind/stl/variant.h>

#include "base_detail.hpp"
#include "denoising.hpp"
#include "gaps.hpp"
#include "gauss_newton.hpp"
#include "kernels/arguments.hpp"
#include "splines.hpp"
#include "surface_windows.hpp"
#include "view_noise.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using sepi::Unlocked;

void bind_views(nb::module_ &kernels) {
    auto base_detail = kernels.def_submodule("base_detail");
    base_detail.def("detail_of_views", &sepi::detail_of_views, Unlocked(), "views"_a, "unit"_a, "present"_a, "low"_a, "nearness"_a, "falloff"_a, "detail_unit"_a,
                    "out"_a);

    auto denoising = kernels.def_submodule("denoising");
    denoising.def("denoise_views", &sepi::denoise_views, Unlocked(), "views"_a, "present"_a, "full"_a, "noise"_a, "least"_a, "out"_a);

    auto gaps = kernels.def_submodule("gaps");
    gaps.def("farther_alike", &sepi::farther_alike, Unlocked(), "disparity"_a, "lowest"_a, "colours"_a, "reach"_a, "least_step"_a, "distance2"_a, "farther"_a);
    gaps.def("compare_depths", &sepi::compare_depths, Unlocked(), "views"_a, "unit"_a, "disparity"_a, "farther"_a, "reference"_a, "asked"_a, "begin"_a, "end"_a,
             "sums"_a);

    auto view_noise = kernels.def_submodule("view_noise");
    view_noise.def("least_differences", &sepi::least_differences, Unlocked(), "views"_a, "t0"_a, "s0"_a, "moves"_a, "least"_a);
    view_noise.attr("BLOCK") = sepi::BLOCK;

    auto splines = kernels.def_submodule("splines");
    splines.attr("MARGIN") = sepi::SPLINE_MARGIN;
    splines.attr("REACH") = sepi::SPLINE_REACH;
    splines.def("spline_coefficients", &sepi::spline_coefficients, Unlocked(), "image"_a, "out"_a);
    splines.def("view_splines", &sepi::view_splines, Unlocked(), "views"_a, "colour_unit"_a, "detail"_a, "detail_unit"_a, "detail_low"_a, "of_colours"_a,
                "of_detail"_a, "low"_a, "out"_a);

    auto gauss_newton = kernels.def_submodule("gauss_newton");
    gauss_newton.attr("AT_ONCE") = sepi::AT_ONCE;
    gauss_newton.def("mean_of_views", &sepi::mean_of_views, Unlocked(), "views"_a, "seeing"_a, "disparity"_a, "begin"_a, "end"_a, "out"_a);
    gauss_newton.def("equations_of_views", &sepi::equations_of_views, Unlocked(), "views"_a, "seeing"_a, "disparity"_a, "image"_a, "begin"_a, "end"_a, "out"_a);

    auto surface_windows = kernels.def_submodule("surface_windows");
    surface_windows.def("sums_of_surface", &sepi::sums_of_surface, Unlocked(), "gradient"_a, "curvature"_a, "disparity"_a, "colours"_a, "radius"_a, "width"_a,
                        "colour_width"_a, "least"_a, "sums"_a);
}
