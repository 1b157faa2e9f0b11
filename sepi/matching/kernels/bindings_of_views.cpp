#include "base_detail.hpp"
#include "denoising.hpp"
#include "gaps.hpp"
#include "kernels/arguments.hpp"
#include "view_noise.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using sepi::Unlocked;


// The kernels that look at the colours of views, of one type.
template <class Colour>
static void bind_of_colours(nb::module_ &base_detail, nb::module_ &denoising, nb::module_ &gaps, nb::module_ &view_noise) {
    base_detail.def("detail_of_views", &sepi::detail_of_views<Colour>, Unlocked(), "colours"_a, "unit"_a, "present"_a, "low"_a, "window"_a, "detail_unit"_a,
                    "out"_a);
    denoising.def("denoise_views", &sepi::denoise_views<Colour>, Unlocked(), "views"_a, "present"_a, "full"_a, "levels"_a, "variances"_a, "least"_a, "out"_a);
    gaps.def("compare_depths", &sepi::compare_depths<Colour>, Unlocked(), "views"_a, "unit"_a, "depths"_a, "asked"_a, "begin"_a, "end"_a, "sums"_a);
    view_noise.def("least_differences", &sepi::least_differences<Colour>, Unlocked(), "colours"_a, "t0"_a, "s0"_a, "moves"_a, "least"_a);
}

void bind_views(nb::module_ &kernels) {
    auto base_detail = kernels.def_submodule("base_detail"), denoising = kernels.def_submodule("denoising");
    auto gaps = kernels.def_submodule("gaps"), view_noise = kernels.def_submodule("view_noise");
    bind_of_colours<std::uint8_t>(base_detail, denoising, gaps, view_noise);
    bind_of_colours<std::uint16_t>(base_detail, denoising, gaps, view_noise);
    bind_of_colours<float>(base_detail, denoising, gaps, view_noise);
    gaps.def("farther_alike", &sepi::farther_alike, Unlocked(), "disparity"_a, "lowest"_a, "colours"_a, "reach"_a, "least_step"_a, "distance2"_a, "farther"_a);
    view_noise.attr("BLOCK") = sepi::BLOCK;
}
