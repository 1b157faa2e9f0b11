// Denoising: the detail of each view, kept as far as it exceeds the noise.
#pragma once

#include "pixels.hpp"

namespace sepi {

// Views that are written to, (T, S, H, W, C).
using NewViews = std::variant<Array<std::uint8_t, 5>, Array<std::uint16_t, 5>, Array<float, 5>>;

// Views (T, S, H, W, C) without what noise alone explains, of those that are present, into out, of the same type. full is
// the value of white. noise (N, 4) says from which brightness on, which rises, the noise of one channel has a variance of
// noise[2] + (brightness - noise[0]) / noise[1] * noise[3]; the first is below all. Detail is kept as far as its energy exceeds
// least (H, W) times that. Whole numbers are rounded and cut off at black and white.
void denoise_views(const Views &views, Array<const bool, 2> present, float full, Array<const float, 2> noise, Array<const float, 2> least, const NewViews &out);

}  // namespace sepi
