#include "kernels/arguments.hpp"
#include "planes.hpp"
#include "second_order.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using sepi::Unlocked;

// The kernels of the second-order smoothing that work in single or double precision.
template <class Number>
static void bind_of_numbers(nb::module_ &m) {
    m.def("turn_and_bend", &sepi::turn_and_bend<Number>, Unlocked(), "stencil"_a, "ahead"_a, "ratio"_a, "direction"_a, "out"_a);
    m.def("step", &sepi::step<Number>, Unlocked(), "length"_a, "direction"_a, "bent"_a, "solution"_a, "residual"_a);
    m.def("onto_finest", &sepi::onto_finest<Number>, Unlocked(), "vector"_a, "out"_a);
    m.def("diagonal_and_finest", &sepi::diagonal_and_finest<Number>, Unlocked(), "inverse"_a, "vector"_a, "fine"_a, "out"_a);
}

void bind_regularization(nb::module_ &kernels) {
    auto second_order = kernels.def_submodule("second_order");
    second_order.attr("MARGIN") = sepi::MARGIN;
    second_order.attr("SPACING") = sepi::SPACING;
    second_order.def("weights_of_differences", &sepi::weights_of_differences, Unlocked(), "disparity"_a, "reliability"_a, "colour"_a, "corners"_a, "factors"_a,
                     "threshold"_a, "variance"_a, "out"_a);
    bind_of_numbers<float>(second_order);
    bind_of_numbers<double>(second_order);
    second_order.def("diagonal_of_hats", &sepi::diagonal_of_hats, Unlocked(), "stencil"_a, "spacing"_a, "out"_a);

    auto planes = kernels.def_submodule("planes");
    planes.def("add_normal_equations", &sepi::add_normal_equations, Unlocked(), "labels"_a, "design"_a, "weight"_a, "disparity"_a, "left"_a, "right"_a);
    planes.def("values_of_planes", &sepi::values_of_planes, Unlocked(), "labels"_a, "design"_a, "planes"_a, "out"_a);
}
