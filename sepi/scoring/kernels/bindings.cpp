#include "kernels/arguments.hpp"
#include "regions.hpp"

void bind_scoring(nb::module_ &kernels) {
    auto regions = kernels.def_submodule("regions");
    regions.def("occluded", &sepi::occluded, Unlocked(), "ground_truth"_a, "baselines"_a, "nearest"_a, "out"_a);
}
