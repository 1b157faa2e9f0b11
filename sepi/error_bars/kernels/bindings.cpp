#include "kernels/arguments.hpp"
#include "mixture.hpp"

void bind_error_bars(nb::module_ &kernels) {
    auto mixture = kernels.def_submodule("mixture");
    mixture.attr("RIM_WIDTH") = sepi::RIM_WIDTH;
    mixture.attr("LEAST_RIM") = sepi::LEAST_RIM;
    mixture.def("describe", &sepi::describe, Unlocked(), "mixture"_a, "tail"_a, "close"_a, "out"_a);
}
