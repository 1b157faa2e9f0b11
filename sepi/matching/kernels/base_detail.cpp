// The weight exp(-q) of a difference is computed as (1 - q / 32)^32, which differs from it by 0.01 at most, ends, and is
// made of multiplications. Each pair of pixels is weighed once, for both.
#include "base_detail.hpp"

#include <cmath>

#include "kernels/parallel.hpp"
#include "kernels/sampling.hpp"
#include "pixels.hpp"

namespace sepi {
namespace {

// Rows that a thread does at a stretch: those of the windows are converted once for all of them.
constexpr Index ROWS_AT_ONCE = 32;

// Least root of a weight: its 32nd power is lost in any sum, and no subnormal number, with which processors are slow.
constexpr float LEAST = 0.125f;

// Some rows of a view, and the rows above and below that their windows reach.
class Stretch {
  public:
    Stretch(BilateralWindow window, Index number, Index width)
        : radius_(window.radius), number_(number), width_(width), falloff_(float(1 / (64 * window.edge * window.edge))) {
        for (Index dy = 0; dy <= radius_; ++dy)
            for (Index dx = 0; dx <= radius_; ++dx)
                nearness_.array()(dy, dx) = float(std::exp(-0.5 * double(dy * dy + dx * dx) / (window.width * window.width)));
    }

    // The channels of a row of a view (W, 3), and their mean, mirrored at both ends; y counts from the first row.
    template <class Colour>
    void load_row(Index y, Array<const Colour, 2> pixels, float unit) {
        const Index beyond = 2 * radius_, end = width_ + beyond;
        const auto channels = rows_.array()[y + radius_];
        split_channels(pixels, {channels.at(0, beyond), {3, width_}, {channels.strides[0], 1}}, [=](auto colour) { return colour * unit; });
        for (Index c = 0; c < 3; ++c) {
            float *channel = row(y, c);
            for (Index x = -beyond; x < 0; ++x) channel[x] = channel[mirrored(x, width_)];
            for (Index x = width_; x < end; ++x) channel[x] = channel[mirrored(x, width_)];
        }
        const float *red = row(y, 0), *green = row(y, 1), *blue = row(y, 2);
        float *mean = row(y, 3);
        for (Index x = -beyond; x < end; ++x) mean[x] = (red[x] + green[x] + blue[x]) * float(1 / 3.0);
    }

    void filter() {
        // the pixel itself
        for (Index y = 0; y < number_; ++y) {
            std::copy_n(row(y, 3), width_, totals_.array().at(y));
            std::fill_n(weights_.array().at(y), width_, 1.0f);
        }
        for (Index y = -radius_; y < number_; ++y) {
            for (Index dy = std::max<Index>(0, -y); dy <= radius_; ++dy) {
                Index half = radius_;
                while (dy * dy + half * half > radius_ * radius_) --half;
                weigh(y, dy, dy == 0 ? 1 : -half, half);
                const Neighbours there{pairs(), step_, row(y + dy, 3), 1}, here{pairs(), step_ - 1, row(y, 3), -1};
                if (dy == 0) {
                    add_weighted(y, 1, half, there, here);
                } else {
                    if (y >= 0) add_weighted(y, -half, half, there);
                    if (y + dy < number_) add_weighted(y + dy, -half, half, here);
                }
            }
        }
    }

    void store_detail(Index y, float unit, std::int16_t *out) const {
        const float *own = row(y, 3), *total = totals_.array().at(y), *weight = weights_.array().at(y);
        for (Index x = 0; x < width_; ++x) out[x] = std::int16_t(std::int32_t(std::nearbyint((own[x] - total[x] / weight[x]) / unit)));
    }

  private:
    // Weights and means that belong to a row of pixels, for dx = 0, and from there to those for the next dx.
    struct Neighbours {
        const float *weights;
        Index next_weights;
        const float *means;
        Index next_means;
    };

    float *row(Index y, Index channel) const { return rows_.array().at(y + radius_, channel, 2 * radius_); }
    float *pairs() const { return pairs_.array().at(radius_, radius_); }

    // Weights of the pixels of row y, and of radius pixels beyond its ends, with those dy below and first..last across.
    void weigh(Index y, Index dy, Index first, Index last) {
        const float *a0 = row(y, 0), *a1 = row(y, 1), *a2 = row(y, 2), *b0 = row(y + dy, 0), *b1 = row(y + dy, 1), *b2 = row(y + dy, 2);
        const float *nearness = nearness_.array().at(dy);
        float *out = pairs();
        const Index step = step_, end = width_ + radius_;
        const Float8 falloff = spread(falloff_);
        for (Index x = -radius_; x < end; x += LANES) {
            const Float8 red = load(a0 + x), green = load(a1 + x), blue = load(a2 + x);
            for (Index dx = first; dx <= last; ++dx) {
                const Float8 difference = magnitude(red - load(b0 + x + dx)) + magnitude(green - load(b1 + x + dx)) + magnitude(blue - load(b2 + x + dx));
                Float8 w = larger(spread(1) - falloff * difference * difference, spread(LEAST));
                w *= w;
                w *= w;
                w *= w;
                w *= w;
                store(out + dx * step + x, w * (w * nearness[std::abs(dx)]));
            }
        }
    }

    // Add weighted pixels of the window to every pixel of row y, in the order of dx.
    template <class... Rows>
    void add_weighted(Index y, Index first, Index last, Rows... rows) {
        float *totals = totals_.array().at(y), *weights = weights_.array().at(y);
        const Index width = width_;
        for (Index x = 0; x < width; x += LANES) {
            Float8 total = load(totals + x), weight = load(weights + x);
            const auto add = [&](const Neighbours &of, Index dx) {
                const Float8 w = load(of.weights + dx * of.next_weights + x);
                total += w * load(of.means + dx * of.next_means + x);
                weight += w;
            };
            for (Index dx = first; dx <= last; ++dx) (add(rows, dx), ...);
            store(totals + x, total);
            store(weights + x, weight);
        }
    }

    static Float8 magnitude(Float8 a) { return Float8(Int8(a) & (Int8{} + 0x7FFFFFFF)); }

    const Index radius_, number_, width_, step_ = width_ + 2 * (radius_ + LANES);
    const float falloff_;
    // of the pixel dx across, at dx + radius
    const Scratch<float, 2> pairs_ = zeros<float, 2>(2 * radius_ + 1, step_);
    const Scratch<float, 2> nearness_{radius_ + 1, radius_ + 1};
    // the channels and their mean; weights look at twice the radius beyond the ends
    const Scratch<float, 3> rows_ = zeros<float, 3>(number_ + 2 * radius_, 4, width_ + 4 * radius_ + LANES);
    const Scratch<float, 2> totals_ = zeros<float, 2>(number_, width_ + LANES), weights_ = zeros<float, 2>(number_, width_ + LANES);
};

}  // namespace

template <class Colour>
void detail_of_views(Strided<const Colour, 5> colours, float unit, Array<const bool, 2> present, Index low, BilateralWindow window, float detail_unit,
                     Array<std::int16_t, 4> out) {
    const Index S = colours.shape[1], H = colours.shape[2], W = colours.shape[3], n = out.shape[2], pieces = (n + ROWS_AT_ONCE - 1) / ROWS_AT_ONCE;
    parallel_for(0, colours.shape[0] * S * pieces, [&](Index task) {
        const Index t = task / pieces / S, s = task / pieces % S, first = task % pieces * ROWS_AT_ONCE;
        if (!present(t, s)) return;
        const Index number = std::min(ROWS_AT_ONCE, n - first);
        Stretch stretch(window, number, W);
        for (Index y = -window.radius; y < number + window.radius; ++y) stretch.load_row(y, colours[t][s][mirrored(low + first + y, H)], unit);
        stretch.filter();
        for (Index y = 0; y < number; ++y) stretch.store_detail(y, detail_unit, out.at(t, s, first + y));
    });
}

#define INSTANTIATE(Colour) \
    template void detail_of_views(Strided<const Colour, 5>, float, Array<const bool, 2>, Index, BilateralWindow, float, Array<std::int16_t, 4>);
INSTANTIATE(std::uint8_t)
INSTANTIATE(std::uint16_t)
INSTANTIATE(float)
#undef INSTANTIATE

}  // namespace sepi
