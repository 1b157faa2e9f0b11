#include <nanobind/stl/variant.h>

#include "base_detail.hpp"
#include "denoising.hpp"
#include "gaps.hpp"
#include "kernels/arguments.hpp"
#include "view_noise.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using sepi::Unlocked;

void bind_views(nb::module_ &kernels) {
    kernels.def_submodule("base_detail").def("detail_of_views", &sepi::detail_of_views, Unlocked(), "views"_a, "unit"_a, "present"_a, "low"_a, "window"_a,
                                             "detail_unit"_a, "out"_a);
    kernels.def_submodule("denoising").def("denoise_views", &sepi::denoise_views, Unlocked(), "views"_a, "present"_a, "full"_a, "noise"_a, "least"_a, "out"_a);
    auto gaps = kernels.def_submodule("gaps");
    gaps.def("farther_alike", &sepi::farther_alike, Unlocked(), "disparity"_a, "lowest"_a, "colours"_a, "reach"_a, "least_step"_a, "distance2"_a, "farther"_a);
    gaps.def("compare_depths", &sepi::compare_depths, Unlocked(), "views"_a, "unit"_a, "depths"_a, "asked"_a, "begin"_a, "end"_a, "sums"_a);
    auto view_noise = kernels.def_submodule("view_noise");
    view_noise.def("least_differences", &sepi::least_differences, Unlocked(), "views"_a, "t0"_a, "s0"_a, "moves"_a, "least"_a);
    view_noise.attr("BLOCK") = sepi::BLOCK;
}
