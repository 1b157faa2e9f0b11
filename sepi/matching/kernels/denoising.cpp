// Denoising: the detail of each view, kept as far as it exceeds the noise.
#include "pixels.hpp"

namespace sepi::denoising {

// Views that are written to, (T, S, H, W, C).
using NewViews = std::variant<Array<std::uint8_t, 5>, Array<std::uint16_t, 5>, Array<float, 5>>;

constexpr Index ROWS_AT_ONCE = 32;  // rows of a view for a turn of a thread
constexpr float SHARE = 0.640625f;  // share of white noise's variance in the detail
constexpr Index REACH = 2;          // radius of the window over which the detail's energy is averaged
constexpr Index SIDE = 1 + REACH;   // rows needed beyond a turn

// Variance at a brightness, from the last line that begins below it.
Float8 variance_at(Float8 level, Array<const float, 2> lines) {
    Float8 line[] = {spread(lines(0, 0)), spread(lines(0, 1)), spread(lines(0, 2)), spread(lines(0, 3))};
    for (Index n = 1; n < lines.shape[0]; ++n) {
        const Int8 above = level >= spread(lines(n, 0));
        for (Index k = 0; k < 4; ++k) line[k] = above ? spread(lines(n, k)) : line[k];
    }
    return line[2] + (level - line[0]) / line[1] * line[3];
}

// Mean of three lines of n by 1 2 1.
void binomial_mean(const float *before, const float *here, const float *after, Index n, float *__restrict out) {
    for (Index x = 0; x < n; ++x) out[x] = 0.5f * here[x] + 0.25f * (before[x] + after[x]);
}

// Some rows of a view, and SIDE above and below: their mean by 1 2 1 along both axes, mirrored at the borders, and the
// detail, the difference from it, of all but the first and last row.
class Stretch {
  public:
    Stretch(const Views &views, Index t, Index s, Index first, Index number, float full)
        : width_(shape_of(views)[3]), channels_(shape_of(views)[4]), n_(number + 2 * SIDE) {
        Array<float, 3> rows = detail_.array();
        ++rows.data;
        load_rows(views, t, s, first - SIDE, rows, [=](auto colour) { return colour / full; });
        const Scratch<float, 2> across(n_, width_);
        for (Index c = 0; c < channels_; ++c) {
            for (Index i = 0; i < n_; ++i) {
                float *row = detail(c, i);
                mirror_ends(row, width_, 1);
                binomial_mean(row - 1, row, row + 1, width_, across.array().at(i));
            }
            for (Index i = 1; i < n_ - 1; ++i) {
                binomial_mean(across.array().at(i - 1), across.array().at(i), across.array().at(i + 1), width_, mean(c, i));
                std::transform(detail(c, i), detail(c, i) + width_, mean(c, i), detail(c, i), std::minus());
            }
        }
    }

    // Row i, denoised, as out (C, W or more).
    void denoise(Index i, Array<const float, 2> noise, const float *least, Array<float, 2> out) const {
        const float *least_here = std::copy_n(least, width_, least_.array().data) - width_;
        float *energies = std::fill_n(energies_.array().at(REACH), width_, 0.0f) - width_;
        for (Index k = i - REACH; k <= i + REACH; ++k)
            for (Index c = 0; c < 3; ++c)
                std::transform(energies, energies + width_, detail(c, k), energies, [](float sum, float value) { return sum + value * value; });
        mirror_ends(energies, width_, REACH);
        for (Index x = 0; x < width_; x += LANES) {
            const Float8 level = (load(mean(0, i) + x) + load(mean(1, i) + x) + load(mean(2, i) + x)) / 3.0f;
            const Float8 of_noise = load(least_here + x) * SHARE * variance_at(level, noise) * float((2 * REACH + 1) * (2 * REACH + 1) * 3);
            Float8 total{};
            for (Index k = -REACH; k <= REACH; ++k) total += load(energies + x + k);
            const Float8 gain = total > of_noise ? (total - of_noise) / total : Float8{};
            for (Index c = 0; c < channels_; ++c) store(out.at(c, x), load(mean(c, i) + x) + gain * load(detail(c, i) + x));
        }
    }

  private:
    // grey counts as three equal channels, to the last bit
    float *detail(Index c, Index i) const { return detail_.array().at(std::min(c, channels_ - 1), i, 1); }
    float *mean(Index c, Index i) const { return mean_.array().at(std::min(c, channels_ - 1), i); }

    const Index width_, channels_, n_;
    const Scratch<float, 3> detail_ = zeros<float, 3>(channels_, n_, width_ + 2 + LANES), mean_ = zeros<float, 3>(channels_, n_, width_ + LANES);
    const Scratch<float, 1> energies_ = zeros<float, 1>(width_ + 2 * REACH + LANES), least_ = zeros<float, 1>(width_ + LANES);
};

// Present views (T, S, H, W, C) without detail that noise alone explains, into out, of the same type. full is the value
// of white. A row of noise (N, 4) holds from brightness noise[0] on, rising from row to row: the noise of one channel has
// the variance noise[2] + (brightness - noise[0]) / noise[1] * noise[3]. Detail stays as far as its energy exceeds least
// (H, W) times this. Integers are rounded and clipped at black and white.
void denoise_views(const Views &views, Array<const bool, 2> present, float full, Array<const float, 2> noise, Array<const float, 2> least,
                   const NewViews &out) {
    const Index H = shape_of(views)[2], W = shape_of(views)[3], C = shape_of(views)[4];
    over_stretches(present.shape, H, ROWS_AT_ONCE, [&](Index t, Index s, Index first, Index number) {
        if (!present(t, s)) return;
        const Stretch stretch(views, t, s, first, number, full);
        const Scratch<float, 2> row(C, W + LANES);
        for (Index y = 0; y < number; ++y) {
            stretch.denoise(SIDE + y, noise, least.at(first + y), row.array());
            std::visit(
                [&](const auto &some) {
                    using Colour = std::remove_reference_t<decltype(*some.data)>;
                    const auto colour = [=](float value) {
                        if constexpr (std::is_integral_v<Colour>) value = std::nearbyint(std::min(std::max(value, 0.0f), 1.0f) * full);
                        return Colour(value);
                    };
                    Colour *place = some.at(t, s, first + y);
                    const float *from = row.array().data;
                    C == 3 ? store_interleaved<3>(from, W + LANES, W, place, colour) : store_interleaved<1>(from, W + LANES, W, place, colour);
                },
                out);
        }
    });
}

const Submodule submodule("denoising", {{"denoise_views", &denoise_views}});

}  // namespace sepi::denoising
