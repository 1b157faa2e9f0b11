#include "kernels/arguments.hpp"

namespace nb = nanobind;
using namespace nb::literals;

void bind_inspection(nb::module_ &) {}
