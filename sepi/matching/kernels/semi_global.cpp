// Semi-global smoothing of a cost volume, after averaging over pixels of similar colour. Both volumes are 16-bit integers:
// the candidates of a pixel are contiguous, padded to whole vectors, and pixel follows pixel.
#include <atomic>

#include "pixels.hpp"

namespace sepi::semi_global {

constexpr int PATHS = 4;       // of one scan
constexpr Index STRETCH = 64;  // pixels of a row after which the next row goes on

constexpr float ONE = 65535;           // an averaged cost of 1
constexpr Index AT_ONCE = 2 * LANES;   // candidates
constexpr Index ACROSS = 8 * LANES;    // columns of a row that are averaged together
constexpr std::uint16_t MOST = 0x7FFC;  // largest cost of a path, in its own steps; a quarter of eight of them fits in 16 bits

// Where in a volume the costs of each pixel's candidates are: the fields of sepi.matching.semi_global.Places, in their order.
struct Places {
    Array<const std::int32_t, 2> first, beyond;  // (H, W): a pixel's first candidate, and what follows its last
    Array<const std::int64_t, 2> origin;         // (H, W): where its candidate 0 is, or would be
    Index count;                                 // candidates of a pixel that has all

    bool fields(auto visit) { return visit(first, beyond, origin, count); }

    bool has_all(Index y, Index x) const { return beyond(y, x) - first(y, x) == count; }
};

// Two scans over the picture, down and up again. Each follows four paths: along the row, and from three pixels of the row
// before. A scan counts rows and columns from where it begins. Rows are on several threads, each behind the row before.
struct Scan {
    Array<const std::uint16_t, 1> cost;
    const Places &places;
    Array<const float, 3> guide;
    double small, large, weakening;
    bool down;
    Array<std::uint16_t, 1> out;

    const Index K = places.count, H = guide.shape[1], W = guide.shape[2];

    // Steps of the averaged costs per step of a path, as a power of 2, so that penalty and cost together stay below MOST.
    const int shift = [this] {
        int bits = 1;
        while (bits < 8 && (1 + std::max(1.5 * small, large)) * ONE / double(1 << bits) > 0x8000) ++bits;
        return bits;
    }();

    // Of rows on the way, at most one for each stretch and the row before: the paths' costs, their least, and the penalties
    // of a change from the pixel before.
    const Index rows = std::min({Index(thread_count()), H, W / STRETCH + 1}) + 1;
    const Scratch<std::uint16_t, 4> paths = Scratch<std::uint16_t, 4>(rows, W, PATHS, K + 2).filled(MOST);
    const Scratch<std::uint16_t, 3> least = Scratch<std::uint16_t, 3>(rows, W, PATHS), penalties = Scratch<std::uint16_t, 3>(rows, PATHS, W);
    const Scratch<std::uint16_t, 1> none = zeros<std::uint16_t, 1>(K + 2);

    std::uint16_t in_steps(double penalty) const { return std::uint16_t(std::min<double>(MOST, penalty * (ONE / double(1 << shift)) + 0.5)); }

    Index row(Index i) const { return down ? i : H - 1 - i; }
    Index column(Index j) const { return down ? j : W - 1 - j; }

    // By how many columns the pixel before is to the right, in the same row (path 0) or in the one before.
    static Index beside(int path) { return path ? path - 2 : -1; }

    // Penalties of row i, reduced where colours change.
    void weigh(Index i) const {
        for (int path = 0; path < (i > 0 ? PATHS : 1); ++path) {
            const Index y = row(i), v = row(path ? i - 1 : i), first = beside(path), right = down ? first : -first;
            std::uint16_t *penalty = penalties.array().at(i % rows, path);
            for (Index x = std::max<Index>(0, -right); x < std::min(W, W - right); ++x) {
                float change = 0;
                for (Index c = 0; c < 3; ++c) change += std::abs(guide(c, y, x) - guide(c, v, x + right));
                penalty[x] = in_steps(std::max(small * 1.5, large / (1 + double(change) * weakening)));
            }
        }
    }

    // Go on from the pixels before (i, j): a path's cost is cost + best - least, where best is the least of: before at the
    // same candidate, at an adjacent one plus small, and the least of all plus a penalty. Candidates that a pixel does not
    // have, and those at either end, are unreachable. Before the first pixel, all cost 0. here and there are the places of
    // this row and of the one before among the rows on the way.
    void pixel(Index i, Index j, Index here, Index there) const {
        const Index y = row(i), x = column(j);
        std::uint16_t *own = paths.array().at(here, j);
        const std::uint16_t *last[PATHS];
        Word16 whole[PATHS], jump[PATHS], lowest[PATHS];
        const Word16 step = Word16{} + in_steps(small), most = Word16{} + MOST;
        for (int path = 0; path < PATHS; ++path) {
            const Index u = j + beside(path), slot = path ? there : here;
            const bool goes_on = u >= 0 && u < W && (i > 0 || path == 0);
            last[path] = goes_on ? paths.array().at(slot, u, path) : none.array().data;
            const std::uint16_t from = goes_on ? least.array()(slot, u, path) : 0, penalty = goes_on ? penalties.array()(here, path, x) : 0;
            whole[path] = Word16{} + from;
            jump[path] = whole[path] + penalty;
            lowest[path] = most;
        }
        if (!places.has_all(y, x)) std::fill_n(own, PATHS * (K + 2), MOST);
        const std::uint16_t *costs = cost.data + places.origin(y, x);
        std::uint16_t *sums = out.data + places.origin(y, x);
        for (Index k = places.first(y, x); k < places.beyond(y, x); k += AT_ONCE) {
            Word16 sum = down ? Word16{} : load_words(sums + k);
            const Word16 added = load_words(costs + k) >> shift;
            for (int path = 0; path < PATHS; ++path) {
                const std::uint16_t *before = last[path] + k;
                const Word16 adjacent = smaller(load_words(before), load_words(before + 2)) + step;
                const Word16 best = smaller(smaller(load_words(before + 1), jump[path]), adjacent);
                const Word16 value = smaller(added + best - whole[path], most);
                store(own + path * (K + 2) + k + 1, value);
                sum += (value + 2) >> 2;
                lowest[path] = smaller(value, lowest[path]);
            }
            store(sums + k, sum);
        }
        for (int path = 0; path < PATHS; ++path) least.array()(here, j, path) = least_of(lowest[path]);
    }

    void run() const {
        std::vector<std::atomic<Index>> done(H);
        std::atomic<Index> next = 0;
        parallel_for(0, rows - 1, [&](Index) {
            for (Index i; (i = next++) < H;) {
                const Index here = i % rows, there = (i + rows - 1) % rows;
                weigh(i);
                for (Index j = 0; j < W; ++j) {
                    if (i > 0 && j % STRETCH == 0)
                        for (Index so_far; (so_far = done[i - 1]) < std::min(W, j + STRETCH + 1);) done[i - 1].wait(so_far);
                    pixel(i, j, here, there);
                    if ((j + 1) % STRETCH == 0 || j + 1 == W) done[i] = j + 1, done[i].notify_one();
                }
            }
        });
    }
};

// By how much the least cost of other candidates exceeds that of those that belong to the winner's minimum; 0 where
// there is no other.
// Of candidates begin..end, beyond which there is no other, or one of cost 1.
float margin_of(const std::uint16_t *costs, Index begin, Index end, const float *disparities, float found, Index best, float same, bool beyond_is_one) {
    constexpr float NONE = 2 * ONE;
    Float8 own = spread(NONE), other = spread(beyond_is_one ? ONE : NONE);
    Int8 before_best = RISING + std::int32_t(begin - best);
    for (Index k = begin; k < end; k += LANES, before_best += LANES) {
        const Float8 cost = first_lanes(load(costs + k), end - k, NONE), beyond = load(disparities + k) - found;
        const Int8 is_own = (larger(beyond, -beyond) <= same) | (before_best == 0);
        own = smaller(own, is_own ? cost : spread(NONE));
        other = smaller(other, is_own ? spread(NONE) : cost);
    }
    const float least = least_of(other);
    return least < NONE ? (least - least_of(own)) / ONE : 0.0f;
}

// Rows begin..end of the costs' mean over windows weighted by colour, into out. cost (K, n, W), 0..1, are of the rows from
// top on; those beyond the picture are its border's. guide (3, H, W), variance (H, W).
void aggregate(Array<const float, 3> cost, Index top, Array<const float, 3> guide, const Places &places, Index radius, Array<const float, 2> variance,
               Index begin, Index end, Array<std::uint16_t, 1> out) {
    const Index K = cost.shape[0], H = guide.shape[1], W = guide.shape[2], size = 2 * radius + 1;
    parallel_for(begin, end, [&](Index y) {
        const Scratch<float, 2> weights(size * size, W + LANES);
        window_weights(guide, variance, y, 0, W, radius, weights.array());
        // weights beyond the picture are 0, so other rows may be read there, within the memory
        const auto at_ends = zeros<float, 2>(size, W + 2 * radius + LANES);
        const Scratch<const float *, 1> places_of_row(size * size);
        const float *first = cost.data, *last = cost.at(K - 1, cost.shape[1]);
        // a few candidates at a time, so that those of a pixel are written together
        const Scratch<float, 2> total(LANES, W + LANES);
        for (Index few = 0; few < places.count; few += LANES) {
            const auto has = [&](Index x) { return places.first(y, x) <= few && few < places.beyond(y, x); };
            std::vector<Index> blocks;
            for (Index x = 0; x < W; ++x)
                if (has(x) && (blocks.empty() || x >= blocks.back() + ACROSS)) blocks.push_back(x / ACROSS * ACROSS);
            if (few + LANES > K) std::fill_n(total.array().data, LANES * (W + LANES), 1.0f);
            for (Index k = few; k < std::min(K, few + LANES); ++k) {
                for (Index i = 0; i < size; ++i) {
                    const float *row = cost.at(k, clamped(y + i - radius, H) - top);
                    if (row - first < radius || last - row < W + radius + LANES) row = std::copy_n(row, W, at_ends.array().at(i, radius)) - W;
                    for (Index j = 0; j < size; ++j) places_of_row.array()(i * size + j) = row + j - radius;
                }
                for (const Index block : blocks) {
                    const auto add = [weight = weights.array().at(0, block), pitch = W + LANES, place = places_of_row.array().data, block](
                                         Float8 sum, Index n, Index x) { return fma(load(weight + n * pitch + x), load(place[n] + block + x), sum); };
                    const Index number = std::min(ACROSS, W - block);
                    float *sums = total.array().at(k - few, block);
                    radius == 2 ? sum_products(number, std::integral_constant<Index, 25>(), sums, add) : sum_products(number, size * size, sums, add);
                }
            }
            // rows of eight candidates become those of a pixel each
            for (const Index begin_of_block : blocks)
                for (Index x = begin_of_block; x < std::min(W, begin_of_block + ACROSS); x += LANES) {
                    const auto block = transposed(total.array().at(0, x), W + LANES);
                    for (Index i = 0; i < LANES && x + i < W; ++i)
                        if (has(x + i)) store(out.data + places.origin(y, x + i) + few, block[i] * ONE);
                }
        }
    });
}

// Sum of the smoothed costs along eight paths, into out; guide (3, H, W).
void semi_global(Array<const std::uint16_t, 1> cost, Array<const float, 3> guide, const Places &places, double small, double large, double weakening,
                 Array<std::uint16_t, 1> out) {
    for (const bool down : {true, false}) Scan{cost, places, guide, small, large, weakening, down, out}.run();
}

// Winner of each pixel, refined by a parabola, and by how much the averaged cost of other minima exceeds its own:
// negative where another minimum is lower before smoothing, 0 where there is no other. Candidates closer than same to
// the winner belong to its minimum; disparities (K). Candidates that a pixel has not cost 1.
void choose(Array<const std::uint16_t, 1> smoothed, Array<const std::uint16_t, 1> averaged, Array<const float, 1> disparities, const Places &places,
            float same, Array<float, 2> disparity, Array<float, 2> margin) {
    const Index K = disparities.shape[0];
    const auto of_candidates = zeros<float, 1>(places.count);
    std::copy_n(disparities.data, K, of_candidates.array().data);
    const double spacing = double(disparities(K - 1) - disparities(0)) / double(K - 1);
    parallel_for_pixels(disparity.shape[0], disparity.shape[1], [&](Index y, Index x) {
        // the first of equal ones
        const std::uint16_t *costs = smoothed.data + places.origin(y, x);
        const Index begin = places.first(y, x), end = std::min<Index>(K, places.beyond(y, x)), best = std::min_element(costs + begin, costs + end) - costs;
        const double offset = begin < best && best < end - 1 ? vertex(costs + best, 1e-9) : 0;
        const float found = float(disparities(best) + offset * spacing);
        disparity(y, x) = found;
        margin(y, x) = margin_of(averaged.data + places.origin(y, x), begin, end, of_candidates.array().data, found, best, same, !places.has_all(y, x));
    });
}

const Submodule submodule("semi_global", {
    {"AT_ONCE", AT_ONCE},
    {"ONE", ONE},
    {"STRETCH", STRETCH},
    {"aggregate", &aggregate},
    {"semi_global", &semi_global},
    {"choose", &choose},
});

}  // namespace sepi::semi_global
