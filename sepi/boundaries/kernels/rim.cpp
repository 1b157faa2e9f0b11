#include "rim.hpp"

#include "kernels/parallel.hpp"

namespace sepi {

void rim_of(Array<const float, 2> disparity, Index radius, double step, const Rim &rim) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    parallel_for(0, H, [&](Index y) {
        const Index top = std::max<Index>(0, y - radius), bottom = std::min(H, y + radius + 1);
        for (Index x = 0; x < W; ++x) {
            const Index left = std::max<Index>(0, x - radius), right = std::min(W, x + radius + 1);
            float lowest = disparity(y, x), highest = lowest;
            for (Index i = top; i < bottom; ++i) {
                for (Index j = left; j < right; ++j) {
                    lowest = std::min(lowest, disparity(i, j));
                    highest = std::max(highest, disparity(i, j));
                }
            }
            if (highest - lowest < step) continue;
            const double middle = double(lowest + highest) / 2;
            double weights[2] = {}, sums[2] = {};
            for (Index i = top; i < bottom; ++i) {
                for (Index j = left; j < right; ++j) {
                    const double weight = 1 / double(1 + (i - y) * (i - y) + (j - x) * (j - x));
                    const bool nearer = disparity(i, j) > middle;
                    weights[nearer] += weight;
                    sums[nearer] += weight * disparity(i, j);
                }
            }
            const auto far = float(sums[0] / weights[0]), near = float(sums[1] / weights[1]);
            rim.far(y, x) = far, rim.near(y, x) = near;
            rim.inside(y, x) = true;
            rim.is_near(y, x) = disparity(y, x) > double(near + far) / 2;
        }
    });
}

}  // namespace sepi
