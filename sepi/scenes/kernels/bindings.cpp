#include "kernels/arguments.hpp"

namespace nb = nanobind;
using namespace nb::literals;

void bind_scenes(nb::module_ &) {}
