#include <nanobind/stl/variant.h>

#include "colour_mixture.hpp"
#include "edge_lines.hpp"
#include "kernels/arguments.hpp"
#include "specks.hpp"
#include "surface_shares.hpp"

void bind_boundaries(nb::module_ &kernels) {
    auto background = kernels.def_submodule("background");
    background.def("brightness_of_views", &sepi::brightness_of_views, Unlocked(), "views"_a, "sides"_a, "missing"_a, "brightness"_a, "residual"_a);
    background.def("background_of", &sepi::background_of, Unlocked(), "views"_a, "layer"_a, "wanted"_a, "begin"_a, "end"_a, "background"_a);
    background.attr("FEWEST_VIEWS") = sepi::FEWEST_VIEWS;
    background.attr("UNSEEN") = sepi::UNSEEN;

    auto surface_shares = kernels.def_submodule("surface_shares");
    surface_shares.def("costs_of_shares", &sepi::costs_of_shares, Unlocked(), "views"_a, "rim"_a, "background"_a, "sides"_a, "scale2"_a, "contrast2"_a,
                       "pixels"_a, "costs"_a, "told"_a);
    surface_shares.attr("FEWEST_SAMPLES") = sepi::FEWEST_SAMPLES;
    surface_shares.attr("FEWEST_ALONE") = sepi::FEWEST_ALONE;
    surface_shares.attr("SHARES") = sepi::SHARES;

    auto colour_mixture = kernels.def_submodule("colour_mixture");
    colour_mixture.def("mixture_evidence", &sepi::mixture_evidence, Unlocked(), "disparity"_a, "around"_a, "guide"_a, "discontinuity"_a, "radius"_a,
                       "contrast"_a, "threshold"_a, "least_variance"_a, "out"_a);

    auto edge_lines = kernels.def_submodule("edge_lines");
    edge_lines.def("evidence_of_lines", &sepi::evidence_of_lines, Unlocked(), "disparity"_a, "middle"_a, "number"_a, "costs"_a, "edges"_a, "pixels"_a,
                   "evidence"_a);
    edge_lines.attr("STEPS") = sepi::STEPS;

    auto specks = kernels.def_submodule("specks");
    specks.def("specks_of", &sepi::specks_of, Unlocked(), "disparity"_a, "difference"_a, "most_pixels"_a, "most_of_hole"_a, "specks"_a);
}
