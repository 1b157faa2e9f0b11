#include <nanobind/stl/variant.h>

#include "kernels/arguments.hpp"
#include "plane_sweep.hpp"
#include "semi_global.hpp"
#include "sheared_views.hpp"
#include "visibility.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using sepi::Unlocked;

// The kernels that look at the colours of views, of one type.
template <class Colour>
static void bind_of_colours(nb::module_ &plane_sweep) {
    plane_sweep.def("sweep_plane_rows", &sepi::sweep_plane_rows<Colour>, Unlocked(), "views"_a, "candidates"_a, "window"_a, "expected"_a, "mask"_a, "begin"_a,
                    "end"_a, "height"_a, "width"_a, "maps"_a);
}

void bind_sweeps(nb::module_ &kernels) {
    auto plane_sweep = kernels.def_submodule("plane_sweep");
    bind_of_colours<std::uint8_t>(plane_sweep);
    bind_of_colours<std::uint16_t>(plane_sweep);
    bind_of_colours<float>(plane_sweep);
    plane_sweep.attr("BLOCK") = sepi::BLOCK;

    auto visibility = kernels.def_submodule("visibility");
    visibility.attr("EMPTY") = sepi::EMPTY;
    visibility.attr("MISSING") = sepi::MISSING;
    visibility.def("z_buffers", &sepi::z_buffers, Unlocked(), "disparity"_a, "present"_a, "baselines"_a, "low"_a, "high"_a, "out"_a);
    visibility.def("occluded_in_any_view", &sepi::occluded_in_any_view, Unlocked(), "disparity"_a, "views"_a, "begin"_a, "end"_a, "out"_a);
    visibility.def("sweep_visible_rows", &sepi::sweep_visible_rows, Unlocked(), "views"_a, "visibility"_a, "robust"_a, "candidates"_a, "begin"_a, "end"_a,
                   "cost"_a);

    auto semi_global = kernels.def_submodule("semi_global");
    semi_global.attr("PATHS_AT_ONCE") = sepi::PATHS_AT_ONCE;
    semi_global.def("aggregate", &sepi::aggregate, Unlocked(), "cost"_a, "guide"_a, "radius"_a, "variance"_a, "out"_a);
    semi_global.def("semi_global", &sepi::semi_global, Unlocked(), "cost"_a, "guide"_a, "small"_a, "large"_a, "weakening"_a, "band"_a, "out"_a);
    semi_global.def("choose", &sepi::choose, Unlocked(), "smoothed"_a, "averaged"_a, "disparities"_a, "same"_a, "disparity"_a, "margin"_a);

    auto sheared_views = kernels.def_submodule("sheared_views");
    sheared_views.def("shear", &sepi::shear, Unlocked(), "views"_a, "offsets"_a, "cubic"_a, "out"_a);
}
