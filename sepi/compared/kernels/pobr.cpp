#include "pobr.hpp"

#include "angular_patches.hpp"
#include "kernels/parallel.hpp"

namespace sepi {

void mean_truncated_differences(Array<const float, 4> sheared, Index reference, double truncation, Array<float, 2> out) {
    const float limit = float(3 * truncation), scale = 1 / (limit * float(sheared.shape[0] - 1));
    parallel_for(0, out.shape[0], [&](Index y) {
        float *total = out.at(y);
        std::fill_n(total, out.shape[1], 0.0f);
        for_differences(sheared, sheared[reference], reference, y, [=](Index, Index x, float red, float green, float blue) {
            total[x] += std::min(std::abs(red) + std::abs(green) + std::abs(blue), limit);
        });
        for (Index x = 0; x < out.shape[1]; ++x) total[x] *= scale;
    });
}

}  // namespace sepi
