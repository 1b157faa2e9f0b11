#include "surface_windows.hpp"

#include "kernels/lanes.hpp"
#include "kernels/parallel.hpp"

namespace sepi {
namespace {

// Rows that a thread does at a stretch.
constexpr Index ROWS_AT_ONCE = 16;

// How far two things are alike, 1 up to half a width from each other, 0 from one and a half on.
Float8 alike(Float8 apart, float width) { return smaller(larger(1.5f - apart / width, Float8{}), spread(1)); }

}  // namespace

void sums_of_surface(Array<const float, 2> gradient, Array<const float, 2> curvature, Array<const float, 2> disparity, Array<const float, 3> colours,
                     Index radius, float width, float colour_width, float least, Array<float, 3> sums) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const bool coloured = colours.shape[1] > 0;
    const Array<const float, 2> pictures[] = {gradient, curvature, disparity, colours[0], colours[1], colours[2]};
    parallel_for(0, (H + ROWS_AT_ONCE - 1) / ROWS_AT_ONCE, [&](Index block) {
        const Index begin = block * ROWS_AT_ONCE, end = std::min(H, begin + ROWS_AT_ONCE);
        const Index top = std::max<Index>(0, begin - radius), bottom = std::min(H, end + radius);
        // with margins: what lies beyond the picture has no gradient and no curvature, and adds nothing
        const auto padded = zeros<float, 3>(coloured ? 6 : 3, bottom - top, W + 2 * radius + LANES);
        for (Index n = 0; n < padded.array().shape[0]; ++n)
            for (Index row = top; row < bottom; ++row) std::copy_n(pictures[n].at(row), W, padded.array().at(n, row - top, radius));
        for (Index y = begin; y < end; ++y) {
            for (Index x = 0; x < W; x += LANES) {
                const auto own = [&](Index n) { return load(padded.array().at(n, y - top, x + radius)); };
                const Float8 own_disparity = own(2), red = coloured ? own(3) : Float8{}, green = coloured ? own(4) : Float8{}, blue = coloured ? own(5) : Float8{};
                Float8 sum{}, weight{};
                for (Index row = std::max<Index>(0, y - radius); row < std::min(H, y + radius + 1); ++row) {
                    for (Index step = 0; step <= 2 * radius; ++step) {
                        const auto other = [&](Index n) { return load(padded.array().at(n, row - top, x + step)); };
                        Float8 share = alike(magnitude(other(2) - own_disparity), width);
                        if (coloured) {
                            const Float8 r = other(3) - red, g = other(4) - green, b = other(5) - blue;
                            share *= least + (1.0f - least) * alike(root(r * r + g * g + b * b), colour_width);
                        }
                        sum += share * other(0);
                        weight += share * other(1);
                    }
                }
                store_first(sums.at(0, y, x), sum, std::min<Index>(LANES, W - x));
                store_first(sums.at(1, y, x), weight, std::min<Index>(LANES, W - x));
            }
        }
    });
}

}  // namespace sepi
