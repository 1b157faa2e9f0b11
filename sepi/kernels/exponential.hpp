// Exponential function for single precision with the same bits everywhere; libraries differ in the last bit.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace sepi {

// exp(x) of a number up to 0, rounded to single precision; 0 below -87. Loops over it vectorise.
[[gnu::always_inline]] inline float exp_of_negative(double x) {
    const double n = std::floor(x * 1.4426950408889634 + 0.5);
    const double f = (x - n * 0.693145751953125) - n * 1.42860682030941723212e-6;
    double p = 1 + f * (1.0 / 8) * (1 + f * (1.0 / 9) * (1 + f * (1.0 / 10)));
    p = 1 + f * (1.0 / 5) * (1 + f * (1.0 / 6) * (1 + f * (1.0 / 7) * p));
    p = 1 + f * (1 + f * (1.0 / 2) * (1 + f * (1.0 / 3) * (1 + f * (1.0 / 4) * p)));
    // 2^n by its bits
    const float power = std::bit_cast<float>((std::int32_t(std::max(n, -126.0)) + 127) << 23);
    return x > -87 ? float(p * double(power)) : 0.0f;
}

}  // namespace sepi
