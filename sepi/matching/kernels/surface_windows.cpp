#include "surface_windows.hpp"

#include <cmath>

#include "kernels/parallel.hpp"

namespace sepi {
namespace {

// How far two things are alike, 1 up to half a width from each other, 0 from one and a half on.
float alike(float apart, float width) { return std::min(std::max(1.5f - apart / width, 0.0f), 1.0f); }

float squared(float number) { return number * number; }

}  // namespace

void sums_of_surface(Array<const float, 2> gradient, Array<const float, 2> curvature, Array<const float, 2> disparity, Array<const float, 3> colours,
                     Index radius, float width, float colour_width, float least, Array<float, 3> sums) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    // what pixels of a row have is added to others, as far as share says that both are of one surface
    const auto add = [&](Index y, Index row, Index step, auto share) {
        // pixels x, and those beside them at x + step
        const float *other_gradient = gradient.at(row, step), *other_curvature = curvature.at(row, step);
        float *__restrict sum = sums.at(0, y), *__restrict weight = sums.at(1, y);
        for (Index x = std::max<Index>(0, -step); x < W - std::max<Index>(0, step); ++x) {
            const float counts = share(x);
            sum[x] += counts * other_gradient[x];
            weight[x] += counts * other_curvature[x];
        }
    };
    parallel_for(0, H, [&](Index y) {
        for (Index row = std::max<Index>(0, y - radius); row < std::min(H, y + radius + 1); ++row) {
            for (Index step = std::max(-radius, 1 - W); step <= std::min(radius, W - 1); ++step) {
                const float *own = disparity.at(y), *other = disparity.at(row, step);
                const auto near = [=](Index x) { return alike(std::abs(other[x] - own[x]), width); };
                if (colours.shape[1] == 0) {
                    add(y, row, step, near);
                    continue;
                }
                const float *red = colours.at(0, y), *green = colours.at(1, y), *blue = colours.at(2, y);
                const float *other_red = colours.at(0, row, step), *other_green = colours.at(1, row, step), *other_blue = colours.at(2, row, step);
                add(y, row, step, [=](Index x) {
                    const float apart2 = squared(other_red[x] - red[x]) + squared(other_green[x] - green[x]) + squared(other_blue[x] - blue[x]);
                    return near(x) * (least + (1.0f - least) * alike(std::sqrt(apart2), colour_width));
                });
            }
        }
    });
}

}  // namespace sepi
