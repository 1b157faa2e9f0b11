#include "weighted_median.hpp"

#include "kernels/exponential.hpp"
#include "kernels/parallel.hpp"

namespace sepi {
namespace {

struct Entry {
    float value, weight;
};

}  // namespace

void weighted_medians(Array<const float, 2> values, Array<const float, 3> guide, Index radius, double sigma, Array<const float, 2> weight,
                      Array<float, 2> out) {
    const Index H = values.shape[0], W = values.shape[1];
    const float factor = float(-0.5 / (sigma * sigma));
    parallel_for(0, H, [&](Index y) {
        const Scratch<Entry, 1> window((2 * radius + 1) * (2 * radius + 1));
        Entry *const begin = window.array().data;
        for (Index x = 0; x < W; ++x) {
            const float *own = guide.at(y, x);
            Entry *end = begin;
            double total = 0, below = 0;
            for (Index v = std::max<Index>(0, y - radius); v < std::min(H, y + radius + 1); ++v) {
                for (Index u = std::max<Index>(0, x - radius); u < std::min(W, x + radius + 1); ++u) {
                    const float *colour = guide.at(v, u);
                    const float r = colour[0] - own[0], g = colour[1] - own[1], b = colour[2] - own[2];
                    const float w = weight(v, u) * exp_of_negative(factor * (r * r + g * g + b * b));
                    if (!(w > 0)) continue;
                    *end++ = {values(v, u), w};
                    total += w;
                }
            }
            std::stable_sort(begin, end, [](const Entry &a, const Entry &b) { return a.value < b.value; });
            out(y, x) = values(y, x);
            for (const Entry *entry = begin; entry < end; ++entry) {
                below += entry->weight;
                if (below < 0.5 * total) continue;
                out(y, x) = entry->value;
                break;
            }
        }
    });
}

}  // namespace sepi
