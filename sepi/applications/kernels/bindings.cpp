#include "all_views.hpp"
#include "kernels/arguments.hpp"
#include "refocusing.hpp"

void bind_applications(nb::module_ &kernels) {
    auto all_views = kernels.def_submodule("all_views");
    all_views.attr("EMPTY") = sepi::EMPTY;
    all_views.attr("TOLERANCE") = sepi::TOLERANCE;
    all_views.def("corner_disparities", &sepi::corner_disparities, Unlocked(), "disparity"_a, "out"_a);
    all_views.def("carry", &sepi::carry, Unlocked(), "disparity"_a, "corners"_a, "v"_a, "u"_a, "nearest"_a, "origin"_a);
    all_views.def("maps_of_views", &sepi::maps_of_views, Unlocked(), "sources"_a, "baselines"_a, "disparity"_a, "confidence"_a, "bars"_a, "extended"_a);

    auto refocusing = kernels.def_submodule("refocusing");
    refocusing.attr("WIDEST") = sepi::WIDEST;
    refocusing.def("add_view", &sepi::add_view, Unlocked(), "view"_a, "v"_a, "u"_a, "disparity"_a, "nearest"_a, "margin"_a, "centre"_a, "scale2"_a, "sums"_a,
                   "weights"_a);
    refocusing.def("fill_between", &sepi::fill_between, Unlocked(), "sheared"_a, "surfaces"_a, "focus"_a, "cell"_a, "margin"_a, "out"_a);
}
