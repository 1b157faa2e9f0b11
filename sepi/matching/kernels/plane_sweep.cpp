// One (candidate, view) has one sub-pixel weight for the whole picture, so a row is a run of contiguous multiply-adds.
// Candidates next to each other mostly have their samples between the same four pixels. What lies between these is a
// polynomial of the disparity: eight pixels' coefficients stay in registers while the candidates are gone through.
//
// No cost volume is ever held: a thread keeps the cost rows of one aggregation window, and the minimum is taken as soon
// as a pixel is aggregated. Each pixel is summed by one thread in a fixed order: results do not depend on the number of
// threads.
#include "plane_sweep.hpp"

#include <cmath>
#include <utility>

#include "kernels/lanes.hpp"
#include "kernels/parallel.hpp"
#include "sample_polynomials.hpp"

namespace sepi {
namespace {

// Columns begin..end of row y.
struct Run {
    Index y, begin, end;
};

// Rows top..bottom of columns begin..end; views are counted nearer than margin to the border.
struct Tile {
    Index top, bottom, begin, end, margin;
};

struct Span {
    Index begin, end;
};

// Columns of a run whose samples, below row top and left columns on, are in shown (H or 0, 2).
Span seen_run(Array<const std::int64_t, 2> shown, Index W, Run run, Index top, Index left, float fx) {
    Index low = 0, high = W;
    if (shown.shape[0] > 0 && 0 <= top && top <= shown.shape[0] - 2) {
        low = std::max(shown(top, 0), shown(top + 1, 0));
        high = std::min(shown(top, 1), shown(top + 1, 1));
    }
    // on the last column nothing beyond it has a weight
    return {std::max(run.begin, low - left), std::min(run.end, (fx == 0 ? high : high - 1) - left)};
}

template <class Colour>
struct Sizes {
    Index T, S, H, W, K, G;

    Sizes(const ViewStack<Colour> &views, const Candidates &candidates)
        : T(views.groups.shape[0]), S(views.groups.shape[1]), H(views.colours.shape[3]), W(views.colours.shape[4] - LANES), K(candidates.number()),
          G(views.subsets.shape[1]) {}
};

// Add the residuals of one view to cost (K, n); distances (K,) is scratch.
template <class Colour>
void add_view(const ViewStack<Colour> &views, const Candidates &candidates, Index t, Index s, Run run, float *distances, Array<float, 2> cost) {
    const Sizes<Colour> sizes(views, candidates);
    const auto colours = views.colours[t][s], reference = views.colours[views.t0][views.s0];
    const auto shown = views.shown[t][s];
    const Index r = candidates.row(t, s), c = candidates.column(t, s);
    const auto *down = candidates.down.at(r), *across = candidates.across.at(c);
    const float *fy = candidates.fy.at(r), *fx = candidates.fx.at(c), *disparities = candidates.disparities.data;
    const Float8 scale2 = spread(views.scale2);
    for (Index here = 0, next; here < sizes.K; here = next) {
        const UpperRow upper = upper_row(run.y, down[here], fy[here], sizes.H);
        const Index top = upper.top, left = across[here];
        const auto [first, last] = seen_run(shown, sizes.W, run, top, left, fx[here]);
        next = here + 1;
        if (top < 0 || top > sizes.H - 2 || last <= first) continue;
        next = end_of_same_pixels(here, sizes.K, down, fy, across, fx);
        const Index origin = origin_of(disparities, here, next);
        for (Index n = here; n < next; ++n) distances[n] = disparities[n] - disparities[origin];
        const Motion at{fy[here] == 0 ? upper.below : fy[origin], fx[origin], candidates.sy(r), candidates.sx(c)};
        for (Index x = first; x < last; x += LANES) {
            const auto of_channel = [&](Index channel) {
                return difference(colours.at(channel, top, x + left), colours.at(channel, top + 1, x + left), reference.at(channel, run.y, x), at);
            };
            Polynomial red = of_channel(0), green = of_channel(1), blue = of_channel(2);
            // differences of 0 add nothing to what others have added
            if (last - x < LANES)
                for (Polynomial *each : {&red, &green, &blue}) each->keep_first(last - x);
            float *place = cost.at(here, x - run.begin);
            for (Index n = here; n < next; ++n, place += cost.strides[0]) {
                const Float8 e = spread(distances[n]);
                const Float8 r0 = red.at(e), r1 = green.at(e), r2 = blue.at(e);
                const Float8 z = fma(r2, r2, fma(r1, r1, r0 * r0));
                store(place, load(place) + z / (z + scale2));
            }
        }
    }
}

// Photo-consistency of a run of pixels, summed over each group of views, for every candidate, into
// costs (G, K or more, n + LANES): sums of robust residuals, each 0..1, and 0 after them.
template <class Colour>
void cost_row(const ViewStack<Colour> &views, const Candidates &candidates, Run run, float *distances, Array<float, 3> costs) {
    for (Index g = 0; g < costs.shape[0]; ++g)
        for (Index k = 0; k < costs.shape[1]; ++k) std::fill_n(costs.at(g, k), run.end - run.begin + LANES, 0.0f);
    for (Index t = 0; t < views.groups.shape[0]; ++t)
        for (Index s = 0; s < views.groups.shape[1]; ++s)
            if (const Index g = views.groups(t, s); g >= 0) add_view(views, candidates, t, s, run, distances, costs[g]);
}

// Number of views of each group that see each pixel of a run at each candidate, into counts (n, G K').
template <class Colour>
void count_views(const ViewStack<Colour> &views, const Candidates &candidates, Run run, Array<float, 2> counts) {
    const Sizes<Colour> sizes(views, candidates);
    const Index U = candidates.across.shape[0], width = counts.shape[1] / sizes.G;
    // views of each group, and equally far across, that have the row, at each candidate
    const auto having = zeros<float, 3>(sizes.G, U, sizes.K);
    const auto some = zeros<bool, 2>(sizes.G, U);
    for (Index t = 0; t < sizes.T; ++t) {
        for (Index s = 0; s < sizes.S; ++s) {
            const Index g = views.groups(t, s), r = candidates.row(t, s), u = candidates.column(t, s);
            if (g < 0) continue;
            some.array()(g, u) = true;
            for (Index k = 0; k < sizes.K; ++k) {
                const Index top = run.y + candidates.down(r, k);
                if (top >= 0 && (top < sizes.H - 1 || (top == sizes.H - 1 && candidates.fy(r, k) == 0))) having.array()(g, u, k) += 1;
            }
        }
    }
    for (Index x = run.begin; x < run.end; ++x) {
        std::fill_n(counts.at(x - run.begin), counts.shape[1], 0.0f);
        for (Index g = 0; g < sizes.G; ++g) {
            float *number = counts.at(x - run.begin, g * width);
            for (Index u = 0; u < U; ++u) {
                if (!some.array()(g, u)) continue;
                const auto *left = candidates.across.at(u);
                const float *fx = candidates.fx.at(u), *of_column = having.array().at(g, u);
                for (Index k = 0; k < sizes.K; ++k) {
                    const bool inside = x + left[k] >= 0 && x + left[k] < (fx[k] == 0 ? sizes.W : sizes.W - 1);
                    number[k] += inside ? of_column[k] : 0.0f;
                }
            }
        }
    }
}

// count_views of views that do not show all of the picture.
template <class Colour>
void count_shown(const ViewStack<Colour> &views, const Candidates &candidates, Run run, Array<float, 2> counts) {
    const Sizes<Colour> sizes(views, candidates);
    const Index width = counts.shape[1] / sizes.G;
    for (Index x = 0; x < run.end - run.begin; ++x) std::fill_n(counts.at(x), counts.shape[1], 0.0f);
    for (Index t = 0; t < sizes.T; ++t) {
        for (Index s = 0; s < sizes.S; ++s) {
            const Index g = views.groups(t, s), r = candidates.row(t, s), c = candidates.column(t, s);
            if (g < 0) continue;
            for (Index k = 0; k < sizes.K; ++k) {
                const Index top = upper_row(run.y, candidates.down(r, k), candidates.fy(r, k), sizes.H).top;
                const auto [first, last] = seen_run(views.shown[t][s], sizes.W, run, top, candidates.across(c, k), candidates.fx(c, k));
                if (top < 0 || top > sizes.H - 2) continue;
                for (Index x = first; x < last; ++x) counts(x - run.begin, g * width + k) += 1;
            }
        }
    }
}

// Weights of the windows of a run of pixels, summing to one, into weights (size, size, n); zero outside.
void window_weights(const Window &window, Run run, Array<float, 3> weights) {
    const Index H = window.guide.shape[1], W = window.guide.shape[2], size = weights.shape[0], n = run.end - run.begin;
    const auto totals = zeros<float, 1>(n);
    float *total = totals.array().data;
    std::fill_n(weights.data, size * size * n, 0.0f);
    const float falloff = -0.5f / window.variance;
    for (Index i = 0; i < size; ++i) {
        const Index row = run.y + i - window.radius;
        if (row < 0 || row >= H) continue;
        for (Index j = 0; j < size; ++j) {
            const Index dx = j - window.radius;
            const Index first = std::max(run.begin, -dx), last = std::min(run.end, W - dx);
            float *weight = weights.at(i, j, first - run.begin), *sums = total + first - run.begin;
            for (Index c = 0; c < 3; ++c) {
                const float *here = window.guide.at(c, run.y, first), *there = window.guide.at(c, row, first + dx);
                for (Index x = 0; x < last - first; ++x) {
                    const float e = here[x] - there[x];
                    weight[x] += e * e;
                }
            }
            for (Index x = 0; x < last - first; ++x) weight[x] = std::exp(falloff * weight[x]);
            for (Index x = 0; x < last - first; ++x) sums[x] += weight[x];
        }
    }
    for (Index i = 0; i < size; ++i)
        for (Index j = 0; j < size; ++j) {
            float *weight = weights.at(i, j);
            for (Index x = 0; x < n; ++x) weight[x] /= total[x];
        }
}

// Weighted sum over the window of pixel (y, x), of all groups and candidates at once, into sums (G K').
// ring (size, n, G K') is one of Rows, weights (size, size, n) are those of window_weights.
void aggregate(Array<const float, 3> ring, Index y, Index x, Index H, Array<const float, 3> weights, float *__restrict sums) {
    const Index size = weights.shape[0], number = ring.shape[2], step = weights.strides[1];
    std::fill_n(sums, number, 0.0f);
    for (Index i = 0; i < size; ++i) {
        const Index row = y + i - size / 2;
        if (row < 0 || row >= H) continue;
        const float *source = ring.at(row % size, x), *w = weights.at(i, 0, x);
        if (size == 7) {
            // the usual window, a row of it at once: sums are loaded and stored once only
            const float w0 = w[0], w1 = w[step], w2 = w[2 * step], w3 = w[3 * step], w4 = w[4 * step], w5 = w[5 * step], w6 = w[6 * step];
            const float *a = source;
            for (Index k = 0; k < number; ++k)
                sums[k] += (w0 * a[k] + w1 * a[number + k]) + (w2 * a[2 * number + k] + w3 * a[3 * number + k]) +
                           (w4 * a[4 * number + k] + w5 * a[5 * number + k]) + w6 * a[6 * number + k];
        } else {
            for (Index j = 0; j < size; ++j)
                for (Index k = 0; k < number; ++k) sums[k] += w[j * step] * source[j * number + k];
        }
    }
}

struct Best {
    float disparity, cost, mean;
};

// Of one pixel and all groups: sums of the costs of its window, and of the views that have them, (G, K'); where
// all_seen, all candidates have the samples of the first.
struct Aggregated {
    Array<const float, 2> sums, counts;
    bool all_seen;

    // Mean cost of the candidates from k on over the views of one subset of groups.
    Float8 mean(const bool *subset, Index k) const {
        Float8 total{}, number{};
        for (Index g = 0; g < sums.shape[0]; ++g) {
            if (!subset[g]) continue;
            total = total + load(sums.at(g, k));
            number = number + (all_seen ? spread(counts(g, 0)) : load(counts.at(g, k)));
        }
        // a candidate that no view of the subset sees is no match
        return number <= Float8{} ? spread(1) : total / number;
    }
};

// What noise takes of the costs of a pixel: moments of a subset of views (K'), times weights of the pixel.
struct TakenByNoise {
    const float *first, *second;
    float first_weight, second_weight;

    Float8 at(Index k) const { return fma(spread(second_weight), load(second + k), spread(first_weight) * load(first + k)); }
};

// Disparity at the lowest of the costs, refined below the disparity sampling; that cost; the mean of all. costs (K') is
// scratch.
Best best_candidate(const Aggregated &found, const bool *subset, const TakenByNoise &noise, Array<const float, 1> disparities, float *costs) {
    const Index K = disparities.shape[0];
    constexpr float MOST = 1e9f;
    Float8 all_least = spread(MOST), sum{};
    const Float8 one = spread(1);
    for (Index k = 0; k < K; k += LANES) {
        const Float8 mean = found.mean(subset, k), taken = noise.at(k);
        const Float8 cost = fma(mean - one, taken / (one - taken), mean);
        store(costs + k, cost);
        all_least = smaller(all_least, first_lanes(cost, K - k, MOST));
        sum = sum + first_lanes(cost, K - k, 0);
    }
    const float lowest = least_of(all_least);
    Index best = 0;
    while (best < K - 1 && costs[best] != lowest) ++best;
    double offset = 0;
    // a perfect match needs no parabola, and the ends of the range allow none
    if (lowest != 0 && 0 < best && best < K - 1) {
        const float before = costs[best - 1], after = costs[best + 1];
        const double curvature = before - 2 * double(lowest) + after;
        if (curvature > 0) offset = 0.5f * (before - after) / curvature;
    }
    const float sampling = (disparities(K - 1) - disparities(0)) / float(K - 1);
    return {float(disparities(best) + offset * sampling), lowest, sum_of(sum) / float(K)};
}

// Runs of columns of a row that windows of the mask's pixels touch, into runs, and how many. A short gap does not end a
// run.
Index needed_runs(Array<const bool, 2> mask, Index row, const Tile &tile, Index radius, Span *runs) {
    const Index H = mask.shape[0], W = mask.shape[1];
    Index number = 0;
    for (Index x = tile.begin; x < tile.end; ++x) {
        bool needed = false;
        for (Index y = std::max<Index>(0, row - radius); y < std::min(H, row + radius + 1); ++y) needed |= mask(y, x);
        if (!needed) continue;
        const Index first = std::max<Index>(0, x - radius), last = std::min(W, x + radius + 1);
        if (number && first - runs[number - 1].end < SHORTEST_GAP) {
            runs[number - 1].end = last;
        } else {
            runs[number++] = {first, last};
        }
    }
    return number;
}

// The first columns of costs (G, K', n), and some zeros after them, as target (n, G K').
void transpose_costs(Array<const float, 3> costs, Index columns, Array<float, 2> target) {
    const Index G = costs.shape[0], K = costs.shape[1];
    for (Index x = 0; x < columns; x += LANES)
        for (Index g = 0; g < G; ++g)
            for (Index k = 0; k < K; k += LANES) {
                Float8 rows[LANES];
                for (Index i = 0; i < LANES; ++i) rows[i] = load(costs.at(g, k + i, x));
                transpose(rows);
                for (Index i = 0; i < LANES; ++i) store(target.at(x + i, g * K + k), rows[i]);
            }
}

template <class Colour>
class TileSweep {
  public:
    TileSweep(const ViewStack<Colour> &views, const Candidates &candidates, const Window &window, const ExpectedCosts &expected, Array<const bool, 2> mask,
              const Tile &tile, const BestMaps &maps)
        : views_(views), candidates_(candidates), window_(window), expected_(expected), mask_(mask), tile_(tile), maps_(maps) {}

    // Sweep the pixels of the tile that are in the mask.
    void run() {
        for (Index g, t = 0; t < views_.groups.shape[0]; ++t)
            for (Index s = 0; s < views_.groups.shape[1]; ++s)
                if ((g = views_.groups(t, s)) >= 0)
                    for (Index k = 0; k < padded_; ++k) all_of_group_.array()(g, k) += 1;
        Index done = -1;  // last row whose costs are in the ring
        for (Index y = tile_.top; y < tile_.bottom; ++y) {
            const bool *wanted = mask_.at(y, 0);
            if (std::none_of(wanted + tile_.begin, wanted + tile_.end, [](bool each) { return each; })) continue;
            const Index reached = std::min(mask_.shape[0], y + window_.radius + 1);
            for (Index row = std::max({Index(0), y - window_.radius, done + 1}); row < reached; ++row) fill_row(row), done = row;
            window_weights(window_, {y, tile_.begin, tile_.end}, weights_.array());
            sweep_row(y);
        }
    }

  private:
    // Costs of one row where they are needed, and near the border the number of views that see it.
    void fill_row(Index row) {
        const Index H = mask_.shape[0], W = mask_.shape[1], radius = window_.radius, origin = tile_.begin - radius;
        const auto from = [&](const Scratch<float, 3> &rows, Index column) {
            auto part = rows.array()[row % size_];
            part.data = part.at(column - origin);
            return part;
        };
        const Index number = needed_runs(mask_, row, tile_, radius, runs_.array().data);
        for (Index r = 0; r < number; ++r) {
            const auto [first, last] = runs_.array()(r);
            cost_row(views_, candidates_, {row, first, last}, distances_.array().data, costs_.array());
            transpose_costs(costs_.array(), last - first, from(ring_, first));
            // windows of pixels near the border reach this far
            const Index inner = tile_.margin + radius;
            Index left = last, right = last;
            if (inner <= row && row < H - inner) {
                left = std::min(last, inner);
                right = std::max({first, left, W - inner});
            }
            for (const auto [begin, end] : {Span{first, left}, Span{right, last}}) {
                if (begin >= end) continue;
                if (views_.shown.shape[2] > 0) {
                    count_shown(views_, candidates_, {row, begin, end}, from(counts_, begin));
                } else {
                    count_views(views_, candidates_, {row, begin, end}, from(counts_, begin));
                }
            }
        }
    }

    // Best candidates of the pixels of a row that are in the mask.
    void sweep_row(Index y) {
        const Index H = mask_.shape[0], W = mask_.shape[1];
        const auto sums = sums_.array(), numbers = numbers_.array();
        const auto weights = weights_.array();
        for (Index x = tile_.begin; x < tile_.end; ++x) {
            if (!mask_(y, x)) continue;
            aggregate(ring_.array(), y, x - tile_.begin, H, weights, sums.data);
            // away from the border every view sees every pixel of the window: nothing to count
            const bool all_seen = tile_.margin <= y && y < H - tile_.margin && tile_.margin <= x && x < W - tile_.margin;
            if (!all_seen) aggregate(counts_.array(), y, x - tile_.begin, H, weights, numbers.data);
            const Aggregated found{sums, all_seen ? all_of_group_.array() : numbers, all_seen};
            for (Index n = 0; n < views_.subsets.shape[0]; ++n) {
                const TakenByNoise noise{expected_.moments.at(0, n), expected_.moments.at(1, n), expected_.weights(0, y, x), expected_.weights(1, y, x)};
                const Best best = best_candidate(found, views_.subsets.at(n), noise, candidates_.disparities, pixel_costs_.array().data);
                maps_.disparity(n, y, x) = best.disparity;
                maps_.cost(n, y, x) = best.cost;
                maps_.mean(n, y, x) = best.mean;
            }
        }
    }

    const ViewStack<Colour> &views_;
    const Candidates &candidates_;
    const Window &window_;
    const ExpectedCosts &expected_;
    const Array<const bool, 2> mask_;
    const Tile tile_;
    const BestMaps &maps_;

    const Index groups_ = views_.subsets.shape[1], padded_ = (candidates_.number() + LANES - 1) / LANES * LANES;
    const Index size_ = 2 * window_.radius + 1, width_ = tile_.end - tile_.begin;
    // with the columns of the windows at both ends
    const Index columns_ = width_ + 2 * window_.radius + LANES;
    // rows of a window: row r at r % size, column x - radius of the tile at x; zero outside the picture
    const Scratch<float, 3> ring_ = zeros<float, 3>(size_, columns_, groups_ * padded_), counts_ = zeros<float, 3>(size_, columns_, groups_ * padded_);
    const Scratch<float, 3> costs_{groups_, padded_, columns_}, weights_{size_, size_, width_};
    const Scratch<float, 2> sums_{groups_, padded_}, numbers_{groups_, padded_}, all_of_group_ = zeros<float, 2>(groups_, padded_);
    const Scratch<float, 1> pixel_costs_{padded_}, distances_{candidates_.number()};
    const Scratch<Span, 1> runs_{width_ / SHORTEST_GAP + 2};
};

// The channels of a row of pixels, each by itself.
template <class Colour, class Step, class Next>
void split_channels(const Colour *pixels, Step step, Next next, Index W, Colour *__restrict red, Colour *__restrict green, Colour *__restrict blue) {
    for (Index x = 0; x < W; ++x) red[x] = pixels[x * step], green[x] = pixels[x * step + next], blue[x] = pixels[x * step + 2 * next];
}

}  // namespace

template <class Colour>
void planes_of(Strided<const Colour, 5> views, Array<Colour, 5> planes) {
    const Index S = views.shape[1], H = views.shape[2], W = views.shape[3];
    const auto fill = [&](auto step, auto next) {
        parallel_for(0, views.shape[0] * S, [&](Index view) {
            const Index t = view / S, s = view % S;
            for (Index y = 0; y < H; ++y)
                split_channels(views.at(t, s, y), step, next, W, planes.at(t, s, 0, y), planes.at(t, s, 1, y), planes.at(t, s, 2, y));
        });
    };
    if (views.strides[3] == 3 && views.strides[4] == 1) {
        // known when this is compiled: several pixels at once
        fill(std::integral_constant<Index, 3>(), std::integral_constant<Index, 1>());
    } else {
        fill(views.strides[3], views.strides[4]);
    }
}

template <class Colour>
void sweep_plane_rows(const ViewStack<Colour> &views, const Candidates &candidates, const Window &window, const ExpectedCosts &expected,
                      Array<const bool, 2> mask, Index begin, Index end, Index height, Index width, const BestMaps &maps) {
    const Index H = mask.shape[0], W = mask.shape[1];
    // where a view may show less than the picture, all pixels are as those near its border
    const Index margin = views.shown.shape[2] > 0 ? H + W : Index(std::ceil(candidates.reach)) + window.radius + 1;
    parallel_for(0, (end - begin + height - 1) / height, [&](Index task) {
        const Index top = begin + task * height;
        for (Index left = 0; left < W; left += width) {
            const Tile tile{top, std::min(end, top + height), left, std::min(W, left + width), margin};
            TileSweep<Colour>(views, candidates, window, expected, mask, tile, maps).run();
        }
    });
}

#define INSTANTIATE(Colour)                                                                                                  \
    template void planes_of(Strided<const Colour, 5>, Array<Colour, 5>);                                                     \
    template void sweep_plane_rows(const ViewStack<Colour> &, const Candidates &, const Window &, const ExpectedCosts &,      \
                                   Array<const bool, 2>, Index, Index, Index, Index, const BestMaps &);
INSTANTIATE(std::uint8_t)
INSTANTIATE(std::uint16_t)
INSTANTIATE(float)
#undef INSTANTIATE

}  // namespace sepi
