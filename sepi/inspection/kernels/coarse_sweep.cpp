#include "coarse_sweep.hpp"

#include <cmath>
#include <limits>

#include "kernels/parallel.hpp"

namespace sepi {
namespace {

constexpr Index ROWS = 16;     // that one thread holds for all candidates: they stay within a few MB
constexpr Index COLUMNS = 16;  // whose costs are brought together: what lies side by side in memory is fetched together
constexpr float INFINITE = std::numeric_limits<float>::infinity();

void add(float *__restrict out, const float *row, Index n) {
    for (Index x = 0; x < n; ++x) out[x] += row[x];
}

// Pixels of a view's row whose samples lie at the fractions fx and fy between neighbours.
struct Samples {
    const float *above, *below;
    float fx, fy;

    // Add the differences from n pixels of the reference view.
    void add_differences(const float *here, float truncation, Index n, float *__restrict cost, float *__restrict seen) const {
        const auto add_each = [&](auto sample) {
            for (Index i = 0; i < n; ++i) {
                cost[i] += std::min(std::abs(here[i] - sample(i)), truncation);
                seen[i] += 1;
            }
        };
        const auto between = [](float a, float b, float f) { return a + f * (b - a); };
        if (fy == 0) {
            add_each([&](Index i) { return between(above[i], above[i + 1], fx); });
        } else if (fx == 0) {
            add_each([&](Index i) { return between(above[i], below[i], fy); });
        } else {
            add_each([&](Index i) { return between(between(above[i], above[i + 1], fx), between(below[i], below[i + 1], fx), fy); });
        }
    }
};

struct Matching {
    Array<const float, 2> reference;
    Array<const float, 3> views;
    Array<const float, 2> offsets;
    float truncation;
    Index radius;

    // Mean difference of row y over the views that see it; infinite where fewer than half do. seen (W) is scratch.
    void row_costs(float candidate, Index y, float *__restrict seen, float *__restrict cost) const {
        const Index V = views.shape[0], H = reference.shape[0], W = reference.shape[1];
        std::fill_n(seen, W, 0.0f);
        std::fill_n(cost, W, 0.0f);
        for (Index v = 0; v < V; ++v) {
            const double down = double(y) - double(candidate * offsets(v, 0));
            const float across = -candidate * offsets(v, 1);
            const auto row = Index(std::floor(down)), shift = Index(std::floor(across));
            // one column fewer than fit, for the right neighbour of the sample
            const Index begin = std::max<Index>(0, -shift), end = std::min(W, W - 1 - shift);
            if (row < 0 || row >= H - 1 || end <= begin) continue;
            const Samples samples{views.at(v, row, begin + shift), views.at(v, row + 1, begin + shift), float(double(across) - double(shift)),
                                  float(down - double(row))};
            samples.add_differences(reference.at(y, begin), truncation, end - begin, cost + begin, seen + begin);
        }
        const float fewest = float(double(V) / 2);
        for (Index x = 0; x < W; ++x) cost[x] = seen[x] >= fewest ? cost[x] / seen[x] : INFINITE;
    }

    // Mean over the window of costs, whose first row is row first of the picture, from row top on; sums is scratch of
    // the shape of costs.
    void box_mean(Array<const float, 2> costs, Index first, Index top, Array<float, 2> sums, Array<float, 2> out) const {
        const Index H = reference.shape[0], W = reference.shape[1];
        for (Index r = 0; r < costs.shape[0]; ++r) {
            float *total = sums.at(r);
            std::copy_n(costs.at(r), W, total);
            for (Index j = 1; j <= std::min(radius, W - 1); ++j) {
                add(total + j, costs.at(r), W - j);
                add(total, costs.at(r, j), W - j);
            }
        }
        for (Index r = 0; r < out.shape[0]; ++r) {
            const Index above = std::max<Index>(top + r - radius, 0), below = std::min(top + r + radius, H - 1);
            float *__restrict mean = out.at(r);
            std::copy_n(sums.at(above - first), W, mean);
            for (Index y = above + 1; y <= below; ++y) add(mean, sums.at(y - first), W);
            for (Index x = 0; x < W; ++x) {
                const Index width = std::min(x + radius, W - 1) - std::max<Index>(x - radius, 0) + 1;
                mean[x] /= float((below - above + 1) * width);
            }
        }
    }
};

// Lowest of a pixel's costs, lowest outside its valley, mean, and the position of the lowest among the candidates.
struct Valley {
    float low = INFINITE, other = INFINITE, mean;
    double position;

    Valley(const float *costs, Index N) {
        Index best = 0, count = 0;
        float total = 0;
        for (Index n = 0; n < N; ++n) {
            if (costs[n] < INFINITE) {
                total += costs[n];
                ++count;
            }
            if (costs[n] < costs[best]) best = n;
        }
        mean = total / float(std::max<Index>(count, 1));
        position = double(best);
        if (best == 0 || best == N - 1 || !(costs[best - 1] < INFINITE) || !(costs[best + 1] < INFINITE)) return;
        low = costs[best];
        Index left = best, right = best;
        while (left > 0 && costs[left - 1] >= costs[left]) --left;
        while (right < N - 1 && costs[right + 1] >= costs[right]) ++right;
        for (Index n = 0; n < left; ++n) other = std::min(other, costs[n]);
        for (Index n = right + 1; n < N; ++n) other = std::min(other, costs[n]);
        const float before = costs[best - 1], after = costs[best + 1];
        const double curvature = before - 2 * double(low) + after;
        if (curvature > 0) position += 0.5f * (before - after) / curvature;
    }
};

}  // namespace

void coarse_sweep(Array<const float, 2> reference, Array<const float, 3> views, Array<const float, 2> offsets, Array<const float, 1> candidates,
                  float truncation, Index radius, Array<float, 3> out) {
    const Matching matching{reference, views, offsets, truncation, radius};
    const Index H = reference.shape[0], W = reference.shape[1], N = candidates.shape[0];
    const double sampling = candidates(1) - candidates(0);
    parallel_for(0, (H + ROWS - 1) / ROWS, [&](Index block) {
        const Index top = block * ROWS, bottom = std::min(H, top + ROWS);
        const Index first = std::max<Index>(0, top - radius), last = std::min(H, bottom + radius);
        const Scratch<float, 3> volume(N, bottom - top, W);
        const Scratch<float, 2> costs(last - first, W), sums(last - first, W), columns(COLUMNS, N);
        const Scratch<float, 1> seen(W);
        for (Index n = 0; n < N; ++n) {
            for (Index y = first; y < last; ++y) matching.row_costs(candidates(n), y, seen.array().data, costs.array().at(y - first));
            matching.box_mean(costs.array(), first, top, sums.array(), volume.array()[n]);
        }
        for (Index y = top; y < bottom; ++y) {
            for (Index begin = 0; begin < W; begin += COLUMNS) {
                const Index end = std::min(W, begin + COLUMNS);
                for (Index n = 0; n < N; ++n)
                    for (Index x = begin; x < end; ++x) columns.array()(x - begin, n) = volume.array()(n, y - top, x);
                for (Index x = begin; x < end; ++x) {
                    const Valley valley(columns.array().at(x - begin), N);
                    out(0, y, x) = valley.low;
                    out(1, y, x) = valley.other;
                    out(2, y, x) = valley.mean;
                    out(3, y, x) = float(candidates(0) + valley.position * sampling);
                }
            }
        }
    });
}

}  // namespace sepi
