#include "weighted_median.hpp"

#include "kernels/exponential.hpp"
#include "kernels/parallel.hpp"
#include "kernels/sampling.hpp"

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
            Entry *end = begin;
            double total = 0, below = 0;
            for_window(y, x, radius, H, W, [&](Index v, Index u) {
                const float w = weight(v, u) * exp_of_negative(factor * squared_distance(guide.at(v, u), guide.at(y, x)));
                if (!(w > 0)) return;
                *end++ = {values(v, u), w};
                total += w;
            });
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
