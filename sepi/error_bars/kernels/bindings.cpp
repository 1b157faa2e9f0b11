#include "kernels/arguments.hpp"

namespace nb = nanobind;
using namespace nb::literals;

void bind_error_bars(nb::module_ &) {}
