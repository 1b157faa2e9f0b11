// Base-detail decomposition: the difference from a bilateral filter.
//
// The weight exp(-q) of a difference is computed as (1 - q / 32)^32, which differs by at most 0.01, reaches 0, and needs
// only multiplications. The weight of each pair of pixels is computed once for both.
#include "pixels.hpp"

namespace sepi::base_detail {
// its loops are faster if Clang knows that no other source calls it
namespace {

// Rows of a turn of a thread, for which rows of the windows are converted once.
constexpr Index ROWS_AT_ONCE = 32;

// Least root of a weight: its 32nd power vanishes in any sum, and is not a slow subnormal number.
constexpr float LEAST = 0.125f;

// Weights and means of a row of pixels for dx = 0, and stride to those for the next dx.
struct Neighbours {
    const float *weights;
    Index next_weights;
    const float *means;
    Index next_means;
};

// Some rows of a view, and the rows above and below that their windows reach.
struct Stretch {
    const Array<const float, 2> nearness;
    const float falloff;
    const Index number, width;

    const Index radius = nearness.shape[0] - 1, step = width + 2 * (radius + LANES);
    // the channels and their mean; weights need twice the radius beyond the ends
    const Scratch<float, 3> rows = zeros<float, 3>(4, number + 2 * radius, width + 4 * radius + LANES);
    // weights of the pixel dx across, at dx + radius; sums of weighted differences, and of weights
    const Scratch<float, 2> all_pairs = zeros<float, 2>(2 * radius + 1, step);
    const Scratch<float, 3> sums = zeros<float, 3>(2, number, width + LANES);

    // The channels, and their mean, mirrored at both ends.
    void load_channels(const Views &views, Index t, Index s, Index first, float unit) {
        Array<float, 3> inner = rows.array();
        inner.data += 2 * radius;
        load_rows(views, t, s, first - radius, inner, [=](auto colour) { return colour * unit; });
        for (Index y = 0; y < inner.shape[1]; ++y) {
            float *channels[] = {inner.at(0, y), inner.at(1, y), inner.at(2, y)}, *mean = inner.at(3, y);
            for (float *channel : channels) mirror_ends(channel, width, 2 * radius);
            const float *red = channels[0], *green = channels[1], *blue = channels[2];
            for (Index x = -2 * radius; x < width + 2 * radius; ++x) mean[x] = (red[x] + green[x] + blue[x]) * float(1 / 3.0);
        }
    }

    void filter() {
        // the pixel itself
        for (Index y = 0; y < number; ++y) std::fill_n(sums.array().at(1, y), width, 1.0f);
        for (Index y = -radius; y < number; ++y) {
            for (Index dy = std::max<Index>(0, -y); dy <= radius; ++dy) {
                Index half = radius;
                while (dy * dy + half * half > radius * radius) --half;
                weigh(y, dy, dy == 0 ? 1 : -half, half);
                const Neighbours there{pairs(), step, row(y + dy, 3), 1}, here{pairs(), step - 1, row(y, 3), -1};
                if (dy == 0) {
                    add_weighted(y, 1, half, there, here);
                } else {
                    if (y >= 0) add_weighted(y, -half, half, there);
                    if (y + dy < number) add_weighted(y + dy, -half, half, here);
                }
            }
        }
    }

    void store_detail(Index y, float unit, std::int16_t *out) const {
        const float *total = sums.array().at(0, y), *weight = sums.array().at(1, y);
        for (Index x = 0; x < width; ++x) out[x] = std::int16_t(rounded(-total[x] / weight[x] / unit));
    }

    float *row(Index y, Index channel) const { return rows.array().at(channel, y + radius, 2 * radius); }
    float *pairs() const { return all_pairs.array().at(radius, radius); }

    // Weights of the pixels of row y, and of radius pixels beyond its ends, with those dy below and first..last across.
    void weigh(Index y, Index dy, Index first, Index last) {
        const float *const own[] = {row(y, 0), row(y, 1), row(y, 2)}, *const others[] = {row(y + dy, 0), row(y + dy, 1), row(y + dy, 2)};
        const float *near = nearness.at(dy), rate = falloff;
        float *out = pairs();
        for (Index x = -radius, end = width + radius, pitch = step; x < end; x += LANES) {
            const Float8 colours[] = {load(own[0] + x), load(own[1] + x), load(own[2] + x)};
            for (Index dx = first; dx <= last; ++dx) {
                Float8 difference{};
                for (int c = 0; c < 3; ++c) difference += magnitude(colours[c] - load(others[c] + x + dx));
                Float8 w = larger(1.0f - rate * difference * difference, spread(LEAST));
                for (int power = 2; power <= 16; power *= 2) w *= w;
                store(out + dx * pitch + x, w * (w * near[std::abs(dx)]));
            }
        }
    }

    // Add weighted pixels of the window to every pixel of row y, in the order of dx, as differences, which round less.
    template <class... Rows>
    void add_weighted(Index y, Index first, Index last, Rows... neighbours) {
        float *totals = sums.array().at(0, y), *weights = sums.array().at(1, y);
        for (Index x = 0, end = width; x < end; x += LANES) {
            Float8 total = load(totals + x), weight = load(weights + x);
            const Float8 middle = load(row(y, 3) + x);
            const auto add = [&](const Neighbours &of, Index dx) {
                const Float8 w = load(of.weights + dx * of.next_weights + x);
                total += w * (load(of.means + dx * of.next_means + x) - middle);
                weight += w;
            };
            for (Index dx = first; dx <= last; ++dx) (add(neighbours, dx), ...);
            store(totals + x, total);
            store(weights + x, weight);
        }
    }
};

// Mean of the channels minus its edge-preserving mean, in detail_unit, of rows from low on of the present views:
// views (T, S, H, W, 3), times unit in 0..1, out (T, S, n, W). Other views stay unchanged. The window is a disc with
// weights nearness (radius + 1, radius + 1) by distance; weights by colour fall by 1 / (64 s^2), where s is the sum of
// RGB differences at an edge.
void detail_of_views(const Views &views, float unit, Array<const bool, 2> present, Index low, Array<const float, 2> nearness, float falloff,
                     float detail_unit, Array<std::int16_t, 4> out) {
    over_stretches(present.shape, out.shape[2], ROWS_AT_ONCE, [&](Index t, Index s, Index first, Index number) {
        if (!present(t, s)) return;
        Stretch stretch{nearness, falloff, number, out.shape[3]};
        stretch.load_channels(views, t, s, low + first, unit);
        stretch.filter();
        for (Index y = 0; y < number; ++y) stretch.store_detail(y, detail_unit, out.at(t, s, first + y));
    });
}

const Submodule submodule("base_detail", {{"detail_of_views", &detail_of_views}});

}  // namespace
}  // namespace sepi::base_detail
