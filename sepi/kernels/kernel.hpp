// All that sources of kernels include, read once for all of them.
#pragma once

#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "arguments.hpp"
#include "lanes.hpp"
#include "parallel.hpp"
#include "sampling.hpp"
