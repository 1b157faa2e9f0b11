#include "kernels/arguments.hpp"
#include "reprojection.hpp"
#include "triangles.hpp"

void bind_rendered(nb::module_ &kernels) {
    auto triangles = kernels.def_submodule("triangles");
    triangles.def("first_met", &sepi::first_met, Unlocked(), "corners"_a, "origin"_a, "rotation"_a, "frame"_a, "near"_a, "out"_a);

    auto reprojection = kernels.def_submodule("reprojection");
    reprojection.def("seen_elsewhere", &sepi::seen_elsewhere, Unlocked(), "disparities"_a, "baselines"_a, "view"_a, "same"_a, "hidden"_a, "seen"_a);
    reprojection.def("gathered_light", &sepi::gathered_light, Unlocked(), "light"_a, "disparities"_a, "surface"_a, "baselines"_a, "view"_a, "bend"_a, "mean"_a,
                     "variance"_a);
}
