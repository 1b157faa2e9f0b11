#include "denoising.hpp"

#include <cmath>

#include "kernels/parallel.hpp"
#include "kernels/sampling.hpp"
#include "pixels.hpp"

namespace sepi {
namespace {

constexpr Index ROWS_AT_ONCE = 32;  // of a view, that a thread does at a stretch
constexpr float SHARE = 0.640625f;  // of white noise's variance, what the binomial mean takes away
constexpr Index REACH = 2;          // of the window over which the detail's energy is averaged
constexpr Index SIDE = 1 + REACH;   // rows beyond a stretch that it needs

// Variance at a brightness, linear between those that are given; beyond the ends, theirs.
struct NoiseCurve {
    Array<const float, 1> levels, variances;

    Float8 at(Float8 level) const {
        const Index last = levels.shape[0] - 1;
        Float8 low = spread(levels(0)), step = spread(1), from = spread(variances(0)), rise{};
        for (Index i = 0; i < last; ++i) {
            const Int8 above = level >= spread(levels(i));
            low = above ? spread(levels(i)) : low;
            step = above ? spread(levels(i + 1) - levels(i)) : step;
            from = above ? spread(variances(i)) : from;
            rise = above ? spread(variances(i + 1) - variances(i)) : rise;
        }
        const Float8 between = from + (level - low) / step * rise;
        const Float8 upper = level >= spread(levels(last)) ? spread(variances(last)) : between;
        return level <= spread(levels(0)) ? spread(variances(0)) : upper;
    }
};

// Some rows of a view, and SIDE above and below.
class Stretch {
  public:
    Stretch(Index number, Index width, Index channels) : n_(number + 2 * SIDE), width_(width), channels_(channels) {}

    // Row of a view (W, C), in 0..1.
    template <class Colour>
    void load_row(Index i, Array<const Colour, 2> pixels, float full) {
        const auto rows = detail_.array();
        split_channels(pixels, {rows.at(0, i), {channels_, width_}, {rows.strides[0], 1}}, [=](auto colour) { return colour / full; });
    }

    // Mean 1 2 1 along both axes, mirrored at the sides, and what it takes away: of all rows but the first and last.
    void split() {
        const auto across_rows = zeros<float, 2>(n_, width_ + LANES);
        const auto across = across_rows.array();
        for (Index c = 0; c < channels_; ++c) {
            for (Index i = 0; i < n_; ++i) {
                const float *row = detail(c, i);
                float *out = across.at(i);
                for (Index x = 1; x < width_ - 1; ++x) out[x] = 0.5f * row[x] + 0.25f * (row[x - 1] + row[x + 1]);
                for (const Index x : {Index(0), width_ - 1}) out[x] = 0.5f * row[x] + 0.25f * (row[mirrored(x - 1, width_)] + row[mirrored(x + 1, width_)]);
            }
            for (Index i = 1; i < n_ - 1; ++i) {
                const float *above = across.at(i - 1), *here = across.at(i), *below = across.at(i + 1);
                float *rough = detail(c, i), *smooth = mean(c, i);
                for (Index x = 0; x < width_; x += LANES) {
                    const Float8 middle = spread(0.5f) * load(here + x) + spread(0.25f) * (load(above + x) + load(below + x));
                    store(smooth + x, middle);
                    store(rough + x, load(rough + x) - middle);
                }
            }
        }
    }

    // Row i, denoised, as out (C, W).
    void denoise(Index i, const NoiseCurve &noise, const float *least, Array<float, 2> out) {
        add_energies(i);
        std::copy_n(least, width_, least_.array().data);
        for (Index x = 0; x < width_; x += LANES) {
            const Float8 level = (load(mean(0, i) + x) + load(mean(channel(1), i) + x) + load(mean(channel(2), i) + x)) / spread(3);
            const Float8 of_noise = load(least_.array().at(x)) * spread(SHARE) * noise.at(level) * spread((2 * REACH + 1) * (2 * REACH + 1) * 3);
            Float8 total{};
            for (Index k = 0; k <= 2 * REACH; ++k) total += load(column_.array().at(x + k));
            const Float8 gain = total > of_noise ? (total - of_noise) / total : Float8{};
            for (Index c = 0; c < channels_; ++c) store(out.at(c, x), load(mean(c, i) + x) + gain * load(detail(c, i) + x));
        }
    }

  private:
    // Energy of the detail, over the rows of the window of row i, of every column and those beyond the ends.
    void add_energies(Index i) {
        float *inner = column_.array().at(REACH);
        for (Index x = 0; x < width_; x += LANES) {
            Float8 energy{};
            for (Index k = i - REACH; k <= i + REACH; ++k) {
                for (Index c = 0; c < 3; ++c) {
                    const Float8 value = load(detail(channel(c), k) + x);
                    energy += value * value;
                }
            }
            store(inner + x, energy);
        }
        for (Index x = 0; x < REACH; ++x) {
            inner[x - REACH] = inner[mirrored(x - REACH, width_)];
            inner[width_ + x] = inner[mirrored(width_ + x, width_)];
        }
    }

    float *detail(Index c, Index i) const { return detail_.array().at(c, i); }
    float *mean(Index c, Index i) const { return mean_.array().at(c, i); }
    // grey counts as three equal channels, to the last bit
    Index channel(Index c) const { return std::min(c, channels_ - 1); }

    const Index n_, width_, channels_;
    const Scratch<float, 3> detail_ = zeros<float, 3>(channels_, n_, width_ + LANES), mean_ = zeros<float, 3>(channels_, n_, width_ + LANES);
    const Scratch<float, 1> column_ = zeros<float, 1>(width_ + 2 * REACH + LANES), least_ = zeros<float, 1>(width_ + LANES);
};

// A row (C, W) into out (W, C).
template <class Colour>
void store_row(Array<const float, 2> row, Index width, float full, Colour *__restrict out) {
    const auto interleave = [&](auto channels) {
        for (Index x = 0; x < width; ++x) {
            for (Index c = 0; c < channels; ++c) {
                float value = row(c, x);
                if constexpr (std::is_integral_v<Colour>) value = std::nearbyint(std::min(std::max(value, 0.0f), 1.0f) * full);
                out[x * channels + c] = Colour(value);
            }
        }
    };
    // a number that is known beforehand makes vectors of it
    row.shape[0] == 3 ? interleave(std::integral_constant<Index, 3>()) : interleave(row.shape[0]);
}

}  // namespace

template <class Colour>
void denoise_views(Array<const Colour, 5> views, Array<const bool, 2> present, float full, Strided<const float, 1> levels, Strided<const float, 1> variances,
                   Array<const float, 2> least, Array<Colour, 5> out) {
    const Index S = views.shape[1], H = views.shape[2], W = views.shape[3], C = views.shape[4], pieces = (H + ROWS_AT_ONCE - 1) / ROWS_AT_ONCE;
    const NoiseCurve noise{levels, variances};
    parallel_for(0, views.shape[0] * S * pieces, [&](Index task) {
        const Index t = task / pieces / S, s = task / pieces % S, first = task % pieces * ROWS_AT_ONCE;
        if (!present(t, s)) return;
        const Index number = std::min(ROWS_AT_ONCE, H - first);
        Stretch stretch(number, W, C);
        for (Index i = 0; i < number + 2 * SIDE; ++i) stretch.load_row(i, views[t][s][mirrored(first - SIDE + i, H)], full);
        stretch.split();
        const Scratch<float, 2> row(C, W + LANES);
        for (Index y = 0; y < number; ++y) {
            stretch.denoise(SIDE + y, noise, least.at(first + y), row.array());
            store_row<Colour>(row.array(), W, full, out.at(t, s, first + y));
        }
    });
}

#define INSTANTIATE(Colour)                                                                                                            \
    template void denoise_views(Array<const Colour, 5>, Array<const bool, 2>, float, Strided<const float, 1>, Strided<const float, 1>, \
                                Array<const float, 2>, Array<Colour, 5>);
INSTANTIATE(std::uint8_t)
INSTANTIATE(std::uint16_t)
INSTANTIATE(float)
#undef INSTANTIATE

}  // namespace sepi
