// Semi-global smoothing of a cost volume, after averaging over pixels of similar colour. Both volumes are 16-bit integers:
// the candidates of a pixel are contiguous, padded to whole vectors, and pixel follows pixel.
#include "pixels.hpp"

namespace sepi::semi_global {

// Paths from row to row that a thread follows together, with contiguous costs that fit in its cache.
constexpr Index PATHS_AT_ONCE = 32;

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

// Smoothing of costs along paths, into out.
struct Smoothing {
    Array<const std::uint16_t, 1> cost;
    const Places &places;
    Array<const float, 3> guide;
    double small, large, weakening;
    Array<std::uint16_t, 1> out;

    const Index K = places.count, H = guide.shape[1], W = guide.shape[2];

    // Steps of the averaged costs per step of a path, as a power of 2, so that penalty and cost together stay below MOST.
    const int shift = [this] {
        int bits = 1;
        while (bits < 8 && (1 + std::max(1.5 * small, large)) * ONE / double(1 << bits) > 0x8000) ++bits;
        return bits;
    }();

    std::uint16_t in_steps(double penalty) const { return std::uint16_t(std::min<double>(MOST, penalty * (ONE / double(1 << shift)) + 0.5)); }

    // Advance a path from (y - dy, x - dx): path[1:-1] = cost + best - least, which is added to out; returns its least.
    // best is the least of: before at the same candidate, at an adjacent one plus small, and the least of all plus large,
    // reduced where colours change. Candidates that a pixel does not have, and those at either end, are unreachable.
    std::uint16_t next_pixel(Index y, Index x, Index dy, Index dx, std::uint16_t *before, std::uint16_t least, std::uint16_t *path) const {
        const Index row = y - dy, column = x - dx;
        double penalty = 0;
        if (row < 0 || row >= H || column < 0 || column >= W) {
            // before the first pixel, all candidates cost 0
            std::fill_n(before + 1, K, 0);
            least = 0;
        } else {
            float change = 0;
            for (Index c = 0; c < 3; ++c) change += std::abs(guide(c, y, x) - guide(c, row, column));
            penalty = std::max(small * 1.5, large / (1 + double(change) * weakening));
        }
        const Word16 whole = Word16{} + least, jump = whole + in_steps(penalty), step = Word16{} + in_steps(small), most = Word16{} + MOST;
        const std::uint16_t *own = cost.data + places.origin(y, x);
        std::uint16_t *sum = out.data + places.origin(y, x);
        Word16 lowest = most;
        if (!places.has_all(y, x)) std::fill_n(path, K + 2, MOST);
        for (Index k = places.first(y, x); k < places.beyond(y, x); k += AT_ONCE) {
            const Word16 beside = smaller(load_words(before + k), load_words(before + k + 2)) + step;
            const Word16 best = smaller(smaller(load_words(before + k + 1), jump), beside);
            const Word16 value = smaller((load_words(own + k) >> shift) + best - whole, most);
            store(path + k + 1, value);
            store(sum + k, load_words(sum + k) + ((value + 2) >> 2));
            lowest = smaller(value, lowest);
        }
        return least_of(lowest);
    }

    // The paths along row y.
    void along_row(Index y) const {
        const auto paths = Scratch<std::uint16_t, 2>(2, K + 2).filled(MOST);
        for (const Index dx : {1, -1}) {
            std::uint16_t least = 0;
            for (Index i = 0; i < W; ++i) least = next_pixel(y, dx > 0 ? i : W - 1 - i, 0, dx, paths.array().at((i + 1) % 2), least, paths.array().at(i % 2));
        }
    }

    // Paths from row to row in the rows begin..end: those that began in columns from first on.
    // A path that leaves the picture at one side continues as a new one at the other, so that all have a pixel per row.
    // paths (2, n, K' + 2) are their costs in the row before and here, in turn, least (n) the least of the row before.
    void along_lines(Array<std::uint16_t, 3> paths, std::uint16_t *least, Index first, Index begin, Index end, Index dy, Index dx) const {
        for (Index i = begin; i < end; ++i) {
            for (Index line = 0; line < std::min(PATHS_AT_ONCE, W - first); ++line) {
                const Index y = dy > 0 ? i : H - 1 - i, x = ((first + line + dx * i) % W + W) % W;
                least[line] = next_pixel(y, x, dy, dx, paths.at((i + 1) % 2, line), least[line], paths.at(i % 2, line));
            }
        }
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

// Sum of the smoothed costs along eight paths, into out; guide (3, H, W). All paths of a direction go through
// band rows before any goes on, so that costs and sums come from memory once for the paths down and once for those up.
void semi_global(Array<const std::uint16_t, 1> cost, Array<const float, 3> guide, const Places &places, double small, double large, double weakening,
                 Index band, Array<std::uint16_t, 1> out) {
    const Index H = guide.shape[1], W = guide.shape[2], K = places.count;
    const Smoothing smoothing{cost, places, guide, small, large, weakening, out};
    const Index pieces = (W + PATHS_AT_ONCE - 1) / PATHS_AT_ONCE;
    for (const Index dy : {1, -1}) {
        const auto paths = Scratch<std::uint16_t, 4>(3 * pieces, 2, PATHS_AT_ONCE, K + 2).filled(MOST);
        const auto least = zeros<std::uint16_t, 2>(3 * pieces, PATHS_AT_ONCE);
        for (Index begin = 0; begin < H; begin += band) {
            const Index end = std::min(H, begin + band);
            parallel_for(begin, dy > 0 ? end : begin, [&](Index y) {
                for (Index x = 0; x < W; ++x)
                    std::fill(out.data + places.origin(y, x) + places.first(y, x), out.data + places.origin(y, x) + places.beyond(y, x), 0);
                smoothing.along_row(y);
            });
            for (const Index dx : {0, 1, -1}) {
                // paths of one direction have no common pixels
                parallel_for(0, pieces, [&](Index piece) {
                    const Index number = (dx + 1) * pieces + piece;
                    smoothing.along_lines(paths.array()[number], least.array().at(number), piece * PATHS_AT_ONCE, begin, end, dy, dx);
                });
            }
        }
    }
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
    {"PATHS_AT_ONCE", PATHS_AT_ONCE},
    {"aggregate", &aggregate},
    {"semi_global", &semi_global},
    {"choose", &choose},
});

}  // namespace sepi::semi_global
