// The weighted median of a map.
#include "kernels/kernel.hpp"

namespace sepi::weighted_median {

// As sepi.extensions.methods.costs.weighted_median; values, weight and out (H, W), guide (H, W, 3).
void weighted_medians(Array<const float, 2> values, Array<const float, 3> guide, Index radius, double sigma, Array<const float, 2> weight,
                      Array<float, 2> out) {
    const Index H = values.shape[0], W = values.shape[1];
    const float factor = float(-0.5 / (sigma * sigma));
    parallel_for(0, H, [&](Index y) {
        std::vector<std::pair<float, float>> window;  // values and weights
        for (Index x = 0; x < W; ++x) {
            double total = 0, below = 0;
            window.clear();
            for_window(y, x, radius, H, W, [&](Index v, Index u) {
                const float w = weight(v, u) * exp_of_negative(factor * squared_distance(guide.at(v, u), guide.at(y, x)));
                if (w > 0) window.push_back({values(v, u), w}), total += w;
            });
            std::sort(window.begin(), window.end());
            const auto half = std::find_if(window.begin(), window.end(), [&](const auto &entry) { return (below += entry.second) >= 0.5 * total; });
            out(y, x) = half == window.end() ? values(y, x) : half->first;
        }
    });
}

const Submodule submodule("weighted_median", {{"weighted_medians", &weighted_medians}});

}  // namespace sepi::weighted_median
