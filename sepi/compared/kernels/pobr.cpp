#include "pobr.hpp"

#include <cmath>

#include "kernels/parallel.hpp"

namespace sepi {

void mean_truncated_differences(Array<const float, 4> sheared, Index reference, double truncation, Array<float, 2> out) {
    const Index N = sheared.shape[0], H = sheared.shape[2], W = sheared.shape[3];
    const float limit = float(3 * truncation), scale = 1 / (limit * float(N - 1));
    parallel_for(0, H, [&](Index y) {
        const float *red = sheared.at(reference, 0, y), *green = sheared.at(reference, 1, y), *blue = sheared.at(reference, 2, y);
        const auto sums = zeros<float, 1>(W);
        float *__restrict total = sums.array().data;
        // two views at a time; the reference view itself adds nothing
        for (Index n = 0; n < N; n += 2) {
            const Index other = n + 1 < N ? n + 1 : reference;
            const float *r = sheared.at(n, 0, y), *g = sheared.at(n, 1, y), *b = sheared.at(n, 2, y);
            const float *other_r = sheared.at(other, 0, y), *other_g = sheared.at(other, 1, y), *other_b = sheared.at(other, 2, y);
            for (Index x = 0; x < W; ++x) {
                const float first = std::abs(r[x] - red[x]) + std::abs(g[x] - green[x]) + std::abs(b[x] - blue[x]);
                const float second = std::abs(other_r[x] - red[x]) + std::abs(other_g[x] - green[x]) + std::abs(other_b[x] - blue[x]);
                total[x] = total[x] + std::min(first, limit) + std::min(second, limit);
            }
        }
        for (Index x = 0; x < W; ++x) out(y, x) = total[x] * scale;
    });
}

}  // namespace sepi
