// The plane sweep of the range estimate.
#include "kernels/kernel.hpp"

namespace sepi::coarse_sweep {

constexpr Index ROWS = 16;  // rows of a thread for all candidates, a few MB
constexpr Index LINE = 16;  // numbers in a cache line, so that planes of costs begin in different cache sets

void add(const float *row, Index n, float *__restrict out) {
    for (Index x = 0; x < n; ++x) out[x] += row[x];
}

// Mean difference of row y from its samples in the views at a candidate; infinite where fewer than half of them see it.
// seen (W) is scratch.
void row_costs(Array<const float, 2> reference, Array<const float, 3> views, Array<const float, 2> offsets, float candidate, float truncation, Index y,
               float *__restrict seen, float *__restrict cost) {
    const Index V = views.shape[0], H = reference.shape[0], W = reference.shape[1];
    const auto between = [](float a, float b, float f) { return a + f * (b - a); };
    const float *here = reference.at(y);
    std::fill_n(seen, W, 0.0f);
    std::fill_n(cost, W, 0.0f);
    for (Index v = 0; v < V; ++v) {
        const double down = double(y) - double(candidate * offsets(v, 0));
        const float across = -candidate * offsets(v, 1);
        const auto row = Index(std::floor(down)), shift = Index(std::floor(across));
        if (row < 0 || row >= H - 1) continue;
        const float *above = views.at(v, row) + shift, *below = views.at(v, row + 1) + shift;
        const float fy = float(down - double(row)), fx = float(double(across) - double(shift));
        // one column fewer than fit, for the right neighbour of the sample
        for (Index x = std::max<Index>(0, -shift); x < std::min(W, W - 1 - shift); ++x) {
            const float sample = between(between(above[x], above[x + 1], fx), between(below[x], below[x + 1], fx), fy);
            cost[x] += std::min(std::abs(here[x] - sample), truncation);
            seen[x] += 1;
        }
    }
    const float fewest = float(double(V) / 2);
    for (Index x = 0; x < W; ++x) cost[x] = seen[x] >= fewest ? cost[x] / seen[x] : INFINITE;
}

// Lowest of a pixel's costs, lowest outside its valley, mean, and the position of the lowest among the candidates.
struct Valley {
    float low = INFINITE, other = INFINITE, mean;
    double position;

    template <class Costs>
    Valley(const Costs &costs, Index N) {
        Index best = 0, count = 0;
        float total = 0;
        for (Index n = 0; n < N; ++n) {
            if (costs(n) < INFINITE) total += costs(n), ++count;
            if (costs(n) < costs(best)) best = n;
        }
        mean = total / float(std::max<Index>(count, 1));
        position = double(best);
        if (best == 0 || best == N - 1 || !(costs(best - 1) < INFINITE) || !(costs(best + 1) < INFINITE)) return;
        low = costs(best);
        Index left = best, right = best;
        while (left > 0 && costs(left - 1) >= costs(left)) --left;
        while (right < N - 1 && costs(right + 1) >= costs(right)) ++right;
        for (Index n = 0; n < N; ++n)
            if (n < left || n > right) other = std::min(other, costs(n));
        const float before = costs(best - 1), after = costs(best + 1);
        const double curvature = before - 2 * double(low) + after;
        if (curvature > 0) position += 0.5f * (before - after) / curvature;
    }
};

// Match the reference view (H, W) with other views (V, H, W), at offsets (V, 2) view steps down and across, at each of
// the candidates (N), disparities that rise evenly, by differences up to the truncation, averaged over a window of
// radius pixels to each side.
// out (4, H, W): lowest cost; lowest outside the valley round it, or infinite; mean cost; the candidate of the lowest,
// refined by a parabola. Candidates at which fewer than half of the views see a pixel of the window are left out; the
// lowest is infinite where that leaves none, or where it is at an end of the candidates and may go on falling beyond.
void coarse_sweep(Array<const float, 2> reference, Array<const float, 3> views, Array<const float, 2> offsets, Array<const float, 1> candidates,
                  float truncation, Index radius, Array<float, 3> out) {
    const Index H = reference.shape[0], W = reference.shape[1], N = candidates.shape[0];
    const double sampling = candidates(1) - candidates(0);
    parallel_for(0, (H + ROWS - 1) / ROWS, [&](Index block) {
        const Index top = block * ROWS, bottom = std::min(H, top + ROWS);
        const Index first = std::max<Index>(0, top - radius), last = std::min(H, bottom + radius);
        const auto volume = zeros<float, 2>(N, (bottom - top) * W + LINE);
        const auto sums = zeros<float, 2>(last - first, W), rows = zeros<float, 2>(2, W + 2 * radius);
        float *cost = rows.array().at(0, radius);  // with nothing on either side
        for (Index n = 0; n < N; ++n) {
            // means over the window, of its rows first
            for (Index y = first; y < last; ++y) {
                float *total = sums.array().at(y - first);
                row_costs(reference, views, offsets, candidates(n), truncation, y, rows.array().at(1), cost);
                std::copy_n(cost, W, total);
                for (Index j = 1; j <= radius; ++j) add(cost - j, W, total), add(cost + j, W, total);
            }
            for (Index y = top; y < bottom; ++y) {
                const Index above = std::max<Index>(y - radius, 0), below = std::min(y + radius, H - 1);
                float *__restrict mean = volume.array().at(n, (y - top) * W);
                for (Index i = above; i <= below; ++i) add(sums.array().at(i - first), W, mean);
                for (Index x = 0; x < W; ++x) {
                    const Index width = std::min(x + radius, W - 1) - std::max<Index>(x - radius, 0) + 1;
                    mean[x] /= float((below - above + 1) * width);
                }
            }
        }
        for (Index y = top; y < bottom; ++y) {
            for (Index x = 0; x < W; ++x) {
                const Valley valley([&](Index n) { return volume.array()(n, (y - top) * W + x); }, N);
                out(0, y, x) = valley.low;
                out(1, y, x) = valley.other;
                out(2, y, x) = valley.mean;
                out(3, y, x) = float(candidates(0) + valley.position * sampling);
            }
        }
    });
}

const Submodule submodule("coarse_sweep", {{"coarse_sweep", &coarse_sweep}});

}  // namespace sepi::coarse_sweep
