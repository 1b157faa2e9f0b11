#include "kernels/arguments.hpp"
#include "mean_shift.hpp"

void bind_image(nb::module_ &kernels) {
    auto mean_shift = kernels.def_submodule("mean_shift");
    mean_shift.def("patch_modes", &sepi::patch_modes, Unlocked(), "planes"_a, "mask"_a, "radius"_a, "unit"_a, "modes"_a);
    mean_shift.def("sample_modes", &sepi::sample_modes, Unlocked(), "samples"_a, "bandwidth"_a, "modes"_a);
}
