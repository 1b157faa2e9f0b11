// The plane sweep: photo-consistency, its aggregation over windows, and the best candidate.
//
// A (candidate, view) has one sub-pixel weight for the whole picture. Neighbouring candidates mostly have their samples
// between the same four pixels. A sample there is a polynomial of the disparity, and so is the squared difference: the
// coefficients of eight pixels stay in registers during the loop over candidates.
//
// There is no cost volume: a thread keeps the cost rows of one aggregation window, and takes the minimum as soon as a
// pixel is aggregated. One thread sums each pixel in a fixed order, so results do not depend on the number of threads.
#include "pixels.hpp"
#include "sweep_arrays.hpp"

namespace sepi::plane_sweep {

// Columns of a row whose costs are computed and aggregated together.
constexpr Index BLOCK = 32;

constexpr Index BLOCK_ROW = BLOCK + LANES;  // the last vector reaches beyond a block
constexpr Index AT_ONCE = 64;               // costs of a pixel, over groups and candidates, that are aggregated together

// Columns begin..end of row y.
struct Run {
    Index y, begin, end;
};

// Rows top..bottom of columns begin..end.
struct Tile {
    Index top, bottom, begin, end;
};

// Fractional pixels from the pixel above and to the left to the sample at the origin, and shift of the sample in pixels
// per unit of disparity.
struct Motion {
    float fy, fx, sy, sx;
};

// Squared colour differences of eight pixels: a polynomial of the distance from the origin, constant first.
struct SquaredDifferences {
    Float8 of[5]{};

    // Add the squared difference of sample and reference pixel in one channel. Upper left neighbours begin at upper, lower
    // left ones at lower.
    template <class Colour>
    void add(const Colour *upper, const Colour *lower, const Colour *reference, Motion at) {
        const Float8 left = load(upper), lower_left = load(lower);
        const Float8 across = load(upper + 1) - left, lower_across = load(lower + 1) - lower_left;
        const Float8 down = lower_left - left, both = lower_across - across;
        const Float8 fx = spread(at.fx), fy = spread(at.fy);
        const Float8 constant = fma(fy, fma(fx, both, down), fma(fx, across, left - load(reference)));
        const Float8 linear = fma(both, spread(at.fx * at.sy + at.fy * at.sx), fma(down, spread(at.sy), across * spread(at.sx)));
        const Float8 quadratic = both * spread(at.sy * at.sx), twice = linear + linear;
        of[0] = fma(constant, constant, of[0]);
        of[1] = fma(constant, twice, of[1]);
        of[2] = fma(linear, linear, fma(constant + constant, quadratic, of[2]));
        of[3] = fma(twice, quadratic, of[3]);
        of[4] = fma(quadratic, quadratic, of[4]);
    }

    // Set all but the first pixels to 0.
    void keep_first(Index number) {
        for (Float8 &each : of) each = first_lanes(each, number, 0);
    }

    // Squared differences, not below 0 by rounding.
    Float8 at(Float8 distance) const {
        Float8 sum = of[4];
        for (int power = 3; power >= 0; --power) sum = fma(distance, sum, of[power]);
        return larger(sum, Float8{});
    }
};

// Candidates begin..end whose samples are between the same four pixels, or the same of them.
struct Segment {
    Index begin, end, down, left;
    Motion at;
};

struct ComparedView {
    Index t, s;
    std::vector<Segment> segments;
    std::vector<float> distances;  // of each candidate from the origin of its segment

    ComparedView(const Candidates &candidates, Index t, Index s) : t(t), s(s), distances(candidates.disparities.shape[0]) {
        const Index K = candidates.disparities.shape[0];
        const auto *down = candidates.down.at(t, s), *across = candidates.across.at(t, s);
        const float *fy = candidates.fy.at(t, s), *fx = candidates.fx.at(t, s), *disparities = candidates.disparities.data;
        const auto as_before = [=](Index k) {
            return down[k - 1] == down[k] && across[k - 1] == across[k] && (fy[k - 1] == 0) == (fy[k] == 0) &&
                   (fx[k - 1] == 0) == (fx[k] == 0);
        };
        for (Index here = 0, next; here < K; here = next) {
            for (next = here + 1; next < K && as_before(next);) ++next;
            // disparity 0, which lies at an end of a segment, becomes its origin, and so is exact
            const Index origin = disparities[here] >= 0 ? here : next - 1;
            for (Index n = here; n < next; ++n) distances[n] = disparities[n] - disparities[origin];
            segments.push_back({here, next, down[here], across[here], {fy[origin], fx[origin], candidates.sy(t, s), candidates.sx(t, s)}});
        }
    }
};

// Groups of views.
struct Subset {
    std::vector<Index> groups;
    float views = 0;  // how many they are
};

struct ComparedViews {
    std::vector<std::vector<ComparedView>> groups;
    std::vector<Subset> subsets;

    ComparedViews(const ViewStack &views, const Candidates &candidates) : groups(views.subsets.shape[1]), subsets(views.subsets.shape[0]) {
        for (Index t = 0; t < views.groups.shape[0]; ++t)
            for (Index s = 0; s < views.groups.shape[1]; ++s)
                if (const Index g = views.groups(t, s); g >= 0) groups[g].emplace_back(candidates, t, s);
        for (Index n = 0; n < views.subsets.shape[0]; ++n)
            for (Index g = 0; g < views.subsets.shape[1]; ++g)
                if (views.subsets(n, g)) subsets[n].groups.push_back(g), subsets[n].views += float(groups[g].size());
    }
};

// Sweep of tiles with a largest number of columns; maps (3, N, H, W): best disparity, its cost, and mean cost.
struct TileSweep {
    const ViewStack &views;
    const ComparedViews &compared;
    const Candidates &candidates;
    const Window &window;
    const ExpectedCosts &expected;
    const Array<const bool, 2> mask;
    const Index width;
    const Array<float, 4> maps;
    Tile tile{};

    const Index H = mask.shape[0], W = mask.shape[1];
    // with missing pixels, all pixels are handled like those near the border
    const Index border = views.shown.shape[2] > 0 ? H + W : Index(std::ceil(candidates.reach)) + window.radius + 1;
    const Index padded = (candidates.disparities.shape[0] + LANES - 1) / LANES * LANES, size = 2 * window.radius + 1;
    // with the columns of the windows at both ends
    const Index columns = width + 2 * window.radius + LANES, parts = (Index(compared.groups.size()) * padded + AT_ONCE - 1) / AT_ONCE;
    // rows of a window: row r at r % size, column x - radius of the tile at x; finite outside the picture
    const Scratch<float, 4> cost_ring = zeros<float, 4>(size, parts, columns, AT_ONCE);
    const Scratch<float, 4> count_ring = zeros<float, 4>(size, parts, columns, AT_ONCE);
    const Scratch<float, 2> block_costs{padded, BLOCK_ROW}, block_counts{padded, BLOCK_ROW};
    const Scratch<float, 2> weights{size * size, BLOCK};
    const Scratch<float, 2> sums{BLOCK, parts * AT_ONCE}, numbers{BLOCK, parts * AT_ONCE};
    const Scratch<float, 1> pixel_costs{padded};

    // Sweep the pixels of a tile that are in the mask.
    void run(const Tile &next) {
        tile = next;
        const Index radius = window.radius, last = std::min(W, tile.end + radius);
        Index done = -1;  // last row whose costs are in the ring
        for (Index y = tile.top; y < tile.bottom; ++y) {
            if (!wanted({y, tile.begin, tile.end}, 0)) continue;
            const Index reached = std::min(H, y + radius + 1);
            for (Index row = std::max({Index(0), y - radius, done + 1}); row < reached; ++row)
                for (Index x = std::max<Index>(0, tile.begin - radius); x < last; x += BLOCK) fill_run({row, x, std::min(last, x + BLOCK)});
            done = reached - 1;
            for (Index x = tile.begin; x < tile.end; x += BLOCK) sweep_run({y, x, std::min(tile.end, x + BLOCK)});
        }
    }

    // Whether the mask has a pixel of the tile in a run, or within a distance of it.
    bool wanted(Run run, Index reach) const {
        const Index begin = std::max(tile.begin, run.begin - reach), end = std::min(tile.end, run.end + reach);
        for (Index y = std::max(tile.top, run.y - reach); y < std::min(tile.bottom, run.y + reach + 1); ++y)
            if (begin < end && std::memchr(mask.at(y, begin), true, end - begin)) return true;
        return false;
    }

    // Whether every view sees all pixels within a distance of a pixel, at every candidate.
    bool all_seen(Index y, Index x, Index reach) const {
        const Index margin = border + reach;
        return margin <= y && y < H - margin && margin <= x && x < W - margin;
    }

    // Costs of a run where needed, and near the border the number of views that see its pixels.
    void fill_run(Run run) {
        const Index radius = window.radius;
        while (run.begin < run.end && !wanted({run.y, run.begin, std::min(run.end, run.begin + LANES)}, radius)) run.begin += LANES;
        while (run.begin < run.end && !wanted({run.y, run.end - 1, run.end}, radius)) --run.end;
        if (run.begin >= run.end) return;
        const bool count = !all_seen(run.y, run.begin, radius) || !all_seen(run.y, run.end - 1, radius);
        float *costs = block_costs.array().data, *counts = count ? block_counts.array().data : nullptr;
        for (Index g = 0; g < Index(compared.groups.size()); ++g) {
            for (float *each : {costs, counts})
                if (each) std::fill_n(each, padded * BLOCK_ROW, 0.0f);
            std::visit(
                [&](const auto &colours) {
                    for (const ComparedView &view : compared.groups[g]) add_view(colours, view, run, costs, counts);
                },
                views.colours);
            turn(costs, run, g, cost_ring.array());
            if (count) turn(counts, run, g, count_ring.array());
        }
    }

    // Costs of a run in one group, (K', BLOCK_ROW), and some zeros after them, to their place in a ring.
    void turn(const float *costs, Run run, Index g, Array<float, 4> ring) const {
        for (Index k = 0; k < padded; k += LANES) {
            const Index place = g * padded + k;
            for (Index x = run.begin; x < run.end; x += LANES) {
                const auto columns = transposed(costs + k * BLOCK_ROW + x - run.begin, BLOCK_ROW);
                float *target = ring.at(run.y % size, place / AT_ONCE, x - tile.begin + window.radius, place % AT_ONCE);
                for (Index i = 0; i < LANES; ++i) store(target + i * AT_ONCE, columns[i]);
            }
        }
    }

    // Sums over the windows of pixels at columns of a run, whose weights are known, into sums (n, G K'), of rows in a ring.
    void aggregate(Array<const float, 4> ring, Run run, const std::vector<Index> &columns, Array<float, 2> sums) const {
        const Index radius = window.radius, top = std::max<Index>(0, run.y - radius), bottom = std::min(H, run.y + radius + 1);
        for (Index part = 0; part < parts; ++part)
            for (const Index x : columns) {
                Float8 total[AT_ONCE / LANES]{};
                for (Index row = top; row < bottom; ++row) {
                    const float *costs = ring.at(row % size, part, run.begin + x - tile.begin);
                    const float *weight = weights.array().at((row - run.y + radius) * size, x);
                    for (Index j = 0; j < size; ++j, costs += AT_ONCE, weight += BLOCK)
                        for (Index i = 0; i < AT_ONCE / LANES; ++i) total[i] = fma(spread(*weight), load(costs + i * LANES), total[i]);
                }
                for (Index i = 0; i < AT_ONCE / LANES; ++i) store(sums.at(x, part * AT_ONCE + i * LANES), total[i]);
            }
    }

    // Best candidates of the pixels of a run that are in the mask.
    void sweep_run(Run run) {
        std::vector<Index> asked, counted;
        for (Index x = run.begin; x < run.end; ++x) {
            if (!mask(run.y, x)) continue;
            asked.push_back(x - run.begin);
            // away from the border every view sees every pixel of the window: nothing to count
            if (!all_seen(run.y, x, 0)) counted.push_back(x - run.begin);
        }
        if (asked.empty()) return;
        window_weights(window.guide, window.variance, run.y, run.begin, run.end, window.radius, weights.array());
        aggregate(cost_ring.array(), run, asked, sums.array());
        aggregate(count_ring.array(), run, counted, numbers.array());
        for (const Index column : asked) {
            const Index y = run.y, x = run.begin + column;
            const float *counts = all_seen(y, x, 0) ? nullptr : numbers.array().at(column);
            for (Index n = 0; n < maps.shape[1]; ++n) {
                const auto best = best_candidate(n, y, x, sums.array().at(column), counts);
                for (Index i = 0; i < 3; ++i) maps(i, n, y, x) = best[i];
            }
        }
    }

    // Add the residuals of one view to costs (K', BLOCK_ROW), and where it sees the pixels 1 to counts, unless that is null.
    template <class Colour>
    void add_view(Array<const Colour, 5> all_colours, const ComparedView &view, Run run, float *costs, float *counts) const {
        const auto colours = all_colours[view.t][view.s], reference = all_colours[views.t0][views.s0];
        const auto shown = views.shown[view.t][view.s];
        const Float8 scale2 = spread(views.scale2);
        for (const auto &[begin, end, down, left, motion] : view.segments) {
            const auto [top, below] = upper_row(run.y, down, motion.fy, H);
            if (top < 0 || top > H - 2) continue;
            // columns of the run whose samples lie inside; on the last column, the next one has weight 0
            const bool all = shown.shape[0] == 0;
            const Index low = all ? 0 : std::max(shown(top, 0), shown(top + 1, 0));
            const Index high = all ? W : std::min(shown(top, 1), shown(top + 1, 1));
            const Index first = std::max(run.begin, low - left), last = std::min(run.end, (motion.fx == 0 ? high : high - 1) - left);
            const Motion at{below, motion.fx, motion.sy, motion.sx};
            const auto squares_of = [&](Index x) {
                SquaredDifferences squares;
                for (Index c = 0; c < 3; ++c)
                    squares.add(colours.at(c, top, x + left), colours.at(c, top + 1, x + left), reference.at(c, run.y, x), at);
                // differences of 0 add nothing
                if (last - x < LANES) squares.keep_first(last - x);
                return squares;
            };
            const auto add = [&](const SquaredDifferences &squares, Float8 distance, float *cost) {
                const Float8 z = squares.at(distance);
                store(cost, load(cost) + z / (z + scale2));
            };
            for (Index x = first; x < last; x += 2 * LANES) {
                float *cost = costs + begin * BLOCK_ROW + x - run.begin;
                const auto squares = squares_of(x);
                if (last - x <= LANES) {
                    for (Index n = begin; n < end; ++n, cost += BLOCK_ROW) add(squares, spread(view.distances[n]), cost);
                    break;
                }
                // sixteen pixels at a time, to hide the latency of each
                const auto next = squares_of(x + LANES);
                for (Index n = begin; n < end; ++n, cost += BLOCK_ROW) {
                    const Float8 distance = spread(view.distances[n]);
                    add(squares, distance, cost);
                    add(next, distance, cost + LANES);
                }
            }
            if (!counts) continue;
            for (Index n = begin; n < end; ++n)
                for (Index x = first; x < last; ++x) counts[n * BLOCK_ROW + x - run.begin] += 1;
        }
    }

    // Disparity at the lowest of the costs of a pixel by subset n, refined below the disparity sampling; that cost; the mean
    // of all. sums, and counts unless all views see the pixel, are of its window (G, K').
    std::array<float, 3> best_candidate(Index n, Index y, Index x, const float *sums, const float *counts) const {
        const auto disparities = candidates.disparities;
        const Index K = disparities.shape[0];
        const Subset &subset = compared.subsets[n];
        const Array<float, 1> costs = pixel_costs.array();
        // correction of the costs for noise: moments of the subset, times weights of the pixel
        const float *first = expected.moments.at(0, n), *second = expected.moments.at(1, n);
        const Float8 first_weight = spread(expected.weights(0, y, x)), second_weight = spread(expected.weights(1, y, x));
        constexpr float MOST = 1e9f;
        Float8 all_least = spread(MOST), sum{}, number = spread(subset.views);
        for (Index k = 0; k < K; k += LANES) {
            const auto of_groups = [&](const float *values) {
                Float8 total{};
                for (const Index g : subset.groups) total = total + load(values + g * padded + k);
                return total;
            };
            if (counts) number = of_groups(counts);
            // (mean - taken) / (1 - taken); a candidate that no view of the subset sees is no match
            const Float8 lost = number * fma(second_weight, load(second + k), first_weight * load(first + k));
            const Float8 cost = number <= Float8{} ? spread(1) : (of_groups(sums) - lost) / (number - lost);
            store(costs.at(k), cost);
            all_least = smaller(all_least, first_lanes(cost, K - k, MOST));
            sum = sum + first_lanes(cost, K - k, 0);
        }
        const float lowest = least_of(all_least);
        Index best = 0;
        while (best < K - LANES && !any(load(costs.at(best)) == spread(lowest))) best += LANES;
        while (best < K - 1 && costs(best) != lowest) ++best;
        // no parabola for a perfect match, or at the ends of the range
        const double offset = lowest != 0 && 0 < best && best < K - 1 ? vertex(costs.at(best), 0) : 0;
        const float sampling = (disparities(K - 1) - disparities(0)) / float(K - 1);
        return {float(disparities(best) + offset * sampling), lowest, sum_of(sum) / float(K)};
    }
};

// Sweep the rows begin..end of the mask (H, W) in tiles of at most height rows, width columns.
void sweep_plane_rows(const ViewStack &views, const Candidates &candidates, const Window &window, const ExpectedCosts &expected,
                      Array<const bool, 2> mask, Index begin, Index end, Index height, Index width, Array<float, 4> maps) {
    const Index W = mask.shape[1];
    const ComparedViews compared(views, candidates);
    parallel_for(0, (end - begin + height - 1) / height, [&](Index task) {
        const Index top = begin + task * height;
        TileSweep sweep{views, compared, candidates, window, expected, mask, std::min(W, width), maps};
        for (Index left = 0; left < W; left += width) sweep.run({top, std::min(end, top + height), left, std::min(W, left + width)});
    });
}

const Submodule submodule("plane_sweep", {{"sweep_plane_rows", &sweep_plane_rows}, {"BLOCK", BLOCK}});

}  // namespace sepi::plane_sweep
