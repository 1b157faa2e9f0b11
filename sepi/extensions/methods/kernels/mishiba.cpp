// The fast method with one-bit features.
#include "kernels/kernel.hpp"

namespace sepi::mishiba {

// Weighted median of the values, by bisection.
std::int32_t weighted_median(const std::int32_t *values, const std::int32_t *weights, Index count) {
    std::int32_t low = values[0], high = values[0], total = 0;
    for (Index n = 0; n < count; ++n) {
        low = std::min(low, values[n]), high = std::max(high, values[n]);
        total += weights[n];
    }
    while (low < high) {
        const std::int32_t middle = std::int32_t((Index(low) + high) >> 1);
        std::int32_t up_to = 0;
        for (Index n = 0; n < count; ++n) up_to += values[n] <= middle ? weights[n] : 0;
        const bool enough = 2 * Index(up_to) >= total;
        (enough ? high : low) = enough ? middle : middle + 1;
    }
    return low;
}

// Interpolate the costs of candidate k to all pixels, and update each pixel's least cost. Candidates come in rising
// order from 0. slopes (h, w, 3) and constants (h, w): costs as a linear function of the guide's colours, at
// every step-th row and column; guide (H, W, 3); labels (H, W), candidate of least cost so far; kept (H, W, 5), least
// cost so far, cost of the candidate before it, of that after it, of candidate k - 1, and the sum.
void keep_least(Index k, Array<const float, 3> slopes, Array<const float, 2> constants, Array<const float, 3> guide, Index step, Array<std::int64_t, 2> labels,
                Array<float, 3> kept) {
    const Index last_row = constants.shape[0] - 1, last_column = constants.shape[1] - 1;
    parallel_for(0, labels.shape[0], [&](Index y) {
        const Index i = std::min(y / step, last_row), below = std::min(i + 1, last_row), W = labels.shape[1];
        const float fy = float(double(y % step) / double(step));
        for (Index x = 0, j = 0, beyond = 0; x < W; ++x, ++beyond) {
            if (beyond == step) ++j, beyond = 0;
            const Index right = std::min(j + 1, last_column);
            const auto [a, b, c, d] = bilinear_weights(fy, float(double(beyond) / double(step)));
            const float *slope_a = slopes.at(i, j), *slope_b = slopes.at(i, right), *slope_c = slopes.at(below, j), *slope_d = slopes.at(below, right);
            float cost = a * constants(i, j) + b * constants(i, right) + c * constants(below, j) + d * constants(below, right);
            for (Index m = 0; m < 3; ++m) cost += (a * slope_a[m] + b * slope_b[m] + (c * slope_c[m] + d * slope_d[m])) * guide(y, x, m);
            float *own = kept.at(y, x);
            std::int64_t &label = labels(y, x);
            if (k == 0 || cost < own[0]) {
                label = k;
                own[0] = cost, own[1] = own[3], own[2] = cost;
            } else if (label == k - 1) {
                own[2] = cost;
            }
            own[3] = cost;
            own[4] += cost;
        }
    });
}

// For each pixel, the value of least absolute differences from its datum and its current neighbours, all (H, W).
// Neighbours are up to radius times gap pixels away, every gap-th one; table: weight of one by the squared difference
// of colours, an entry for each per_entry, 0 beyond. A window's weights add up to less than 2^31.
void median_pass(Array<const std::int32_t, 2> current, Array<const std::int32_t, 2> data, Array<const std::int32_t, 2> data_weights,
                 Array<const float, 3> guide, Index radius, Index gap, Array<const std::int32_t, 1> table, double per_entry, Array<std::int32_t, 2> out) {
    const Index H = current.shape[0], W = current.shape[1], most = (2 * radius + 1) * (2 * radius + 1) + 1, reach = radius * gap;
    const float scale = float(1 / per_entry);
    parallel_for(0, H, [&](Index y) {
        const Scratch<std::int32_t, 2> entries(2, most);
        std::int32_t *values = entries.array().at(0), *weights = entries.array().at(1);
        for (Index x = 0; x < W; ++x) {
            const float *own = guide.at(y, x);
            values[0] = data(y, x), weights[0] = data_weights(y, x);
            Index count = 1;
            for (Index v = std::max(y - reach, y % gap); v < std::min(y + reach + 1, H); v += gap) {
                for (Index u = std::max(x - reach, x % gap); u < std::min(x + reach + 1, W); u += gap) {
                    const Index entry = Index(squared_distance(guide.at(v, u), own) * scale), last = table.shape[0] - 1;
                    // written always, and counted if it matters, since branches would be mispredicted
                    values[count] = current(v, u), weights[count] = table(std::min(entry, last));
                    count += (entry <= last) & ((v != y) | (u != x));
                }
            }
            out(y, x) = weighted_median(values, weights, count);
        }
    });
}

const Submodule submodule("mishiba", {{"keep_least", &keep_least}, {"median_pass", &median_pass}});

}  // namespace sepi::mishiba
