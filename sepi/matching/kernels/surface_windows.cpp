// Sums over windows of one surface.
#include "pixels.hpp"

namespace sepi::surface_windows {

// Rows of a turn of a thread.
constexpr Index ROWS_AT_ONCE = 32;

// Likeness of two values: 1 up to half a width, 0 from one and a half widths.
Float8 alike(Float8 apart, float width) { return smaller(larger(1.5f - apart / width, Float8{}), spread(1)); }

// Sums of gradient and curvature (H, W) over those pixels of a window of 2 radius + 1 that belong to the surface of its
// middle, into sums (2, H, W).
//
// The weight of a pixel falls with its differences of disparity (H, W), relative to width, and of colours (3, H, W),
// relative to colour_width. Colours (3, 0, 0) do not count.
void sums_of_surface(Array<const float, 2> gradient, Array<const float, 2> curvature, Array<const float, 2> disparity, Array<const float,
                     3> colours, Index radius, float width, float colour_width, float least, Array<float, 3> sums) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const Array<const float, 2> pictures[] = {gradient, curvature, disparity, colours[0], colours[1], colours[2]};
    const auto add = [&](auto number, Index begin, Index rows) {
        const Index top = std::max<Index>(0, begin - radius), bottom = std::min(H, begin + rows + radius);
        // gradient and curvature are 0 beyond the picture
        const Scratch<float, 3> padded(number.value, bottom - top, W + 2 * radius + LANES);
        for (Index n = 0; n < number; ++n)
            for (Index row = top; row < bottom; ++row)
                std::fill_n(std::copy_n(pictures[n].at(row), W, std::fill_n(padded.array().at(n, row - top), radius, 0.0f)), radius + LANES, 0.0f);
        for (Index y = begin; y < begin + rows; ++y) {
            for (Index x = 0; x < W; x += LANES) {
                Float8 own[number], found[2] = {};
                for (Index n = 2; n < number; ++n) own[n] = load(padded.array().at(n, y - top, x + radius));
                for (Index row = std::max(top, y - radius); row < std::min(bottom, y + radius + 1); ++row) {
                    const float *others[number];
                    for (Index n = 0; n < number; ++n) others[n] = padded.array().at(n, row - top, x);
                    for (Index step = 0; step <= 2 * radius; ++step) {
                        const auto at = [&](Index n) { return load(others[n] + step); };
                        Float8 share = alike(magnitude(at(2) - own[2]), width);
                        if constexpr (number == 6) {
                            const Float8 r = at(3) - own[3], g = at(4) - own[4], b = at(5) - own[5];
                            share *= least + (1.0f - least) * alike(root(r * r + g * g + b * b), colour_width);
                        }
                        for (Index n = 0; n < 2; ++n) found[n] += share * at(n);
                    }
                }
                for (Index n = 0; n < 2; ++n) store_first(sums.at(n, y, x), found[n], std::min<Index>(LANES, W - x));
            }
        }
    };
    over_stretches({1, 1}, H, ROWS_AT_ONCE, [&](Index, Index, Index begin, Index rows) {
        colours.shape[1] > 0 ? add(std::integral_constant<Index, 6>(), begin, rows) : add(std::integral_constant<Index, 3>(), begin, rows);
    });
}

const Submodule submodule("surface_windows", {{"sums_of_surface", &sums_of_surface}});

}  // namespace sepi::surface_windows
