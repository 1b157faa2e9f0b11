#include "coarse_sweep.hpp"
#include "kernels/arguments.hpp"
#include "view_order.hpp"

void bind_inspection(nb::module_ &kernels) {
    auto coarse_sweep = kernels.def_submodule("coarse_sweep");
    coarse_sweep.def("coarse_sweep", &sepi::coarse_sweep, Unlocked(), "reference"_a, "views"_a, "offsets"_a, "candidates"_a, "truncation"_a, "radius"_a,
                     "out"_a);

    auto view_order = kernels.def_submodule("view_order");
    view_order.def("layout_costs", &sepi::layout_costs, Unlocked(), "reference"_a, "views"_a, "offsets"_a, "candidates"_a, "points"_a, "radius"_a, "cost"_a,
                   "disparity"_a);
    view_order.def("residuals", &sepi::residuals, Unlocked(), "reference"_a, "view"_a, "baseline"_a, "disparity"_a, "asked"_a, "radius"_a, "out"_a);
}
