#include "visibility.hpp"

#include <cmath>

#include "kernels/lanes.hpp"
#include "kernels/parallel.hpp"
#include "pixels.hpp"
#include "sample_polynomials.hpp"

namespace sepi {
namespace {

constexpr float ROUNDING = 1.0f / 512;  // how far a position is from the same in single precision, at most, pixels
constexpr float COLOUR_STEPS = 20000;   // from black to white, of colours as whole numbers of 16 bits
constexpr std::int64_t ONE = 1 << 14;   // the sum of a sample's weights, which are whole numbers of 16 bits

// What is nearest of the pixels whose square begins at a position of a view, of rows from low on.
class BegunPixels {
  public:
    BegunPixels(Array<float, 2> begun, Index low, double v, double u) : begun_(begun), low_(low), v_(v), u_(u) {}

    // Add a row of the reference view. Pixels of a smooth surface lie side by side in the view, too: eight at once.
    void add_row(Array<const float, 2> disparity, Index y) const {
        const Index W = disparity.shape[1];
        const float *row = disparity.at(y);
        const Float8 down = spread(float(v_)), across = spread(float(u_)), one = spread(1);
        Index x = 0;
        for (; x <= W - LANES; x += LANES) {
            const Float8 d = load(row + x);
            const auto [top, left] = square_of(y, x, row[x]);
            // how far beyond where the first begins, of 0..1 if they lie side by side
            const Float8 dy = spread(float(y + 1 - low_ - top)) - d * down, dx = spread(float(x + 1 - left)) - d * across;
            const bool clear = least_of(smaller(smaller(dy, one - dy), smaller(dx, one - dx))) > ROUNDING;
            if (clear && 0 <= top && top < begun_.shape[0] && left >= 0 && left + LANES <= begun_.shape[1]) {
                float *place = begun_.at(top, left);
                store(place, larger(load(place), d));
            } else {
                add_pixels(row, y, x, x + LANES);
            }
        }
        add_pixels(row, y, x, W);
    }

  private:
    struct Square {
        Index top, left;
    };

    Square square_of(Index y, Index x, float d) const {
        return {Index(std::floor(double(y + 1 - low_) - d * v_)), Index(std::floor(double(x + 1) - d * u_))};
    }

    void add_pixels(const float *row, Index y, Index begin, Index end) const {
        for (Index x = begin; x < end; ++x) {
            const auto [top, left] = square_of(y, x, row[x]);
            if (0 <= top && top < begun_.shape[0] && 0 <= left && left < begun_.shape[1]) {
                float &nearest = begun_(top, left);
                nearest = std::max(nearest, row[x]);
            }
        }
    }

    Array<float, 2> begun_;
    Index low_;
    double v_, u_;
};

// Weights of a sample's neighbours, each a pair of whole numbers of 16 bits: pixel and right neighbour, above and below.
struct BilinearWeights {
    Int8 upper, lower;

    BilinearWeights(double fy, double fx) {
        const auto below = std::int64_t(fy * ONE + 0.5);
        const auto right = std::int64_t((ONE - below) * fx + 0.5), lower_right = std::int64_t(below * fx + 0.5);
        upper = pair_of(ONE - below - right, right);
        lower = pair_of(below - lower_right, lower_right);
    }
};

// What a row of the reference view is compared with, and what comes of it.
template <class Colour>
class VisibleRow {
  public:
    VisibleRow(const BaseDetail<Colour> &views, const Visibility &visibility, const RobustCost &robust, const Candidates &candidates, Index height)
        : views_(views), visibility_(visibility), candidates_(candidates), shares_{robust.shares(0), robust.shares(1)},
          pairs_(zeros<std::int32_t, 3>(height, 4, width_)) {
        // in steps of the whole numbers; the detail counts as three equal channels
        const double colours = double(COLOUR_STEPS) * ONE, detail = ONE / double(views.detail_unit);
        scales2_[0] = float(robust.scales2(0) * (colours * colours));
        scales2_[1] = float(robust.scales2(1) * (detail * detail) / 3);
    }

    // Cost of every candidate in row y, into cost (K, H, W).
    void sweep(Index y, Array<float, 3> cost) {
        load_reference(y);
        for (Index t = 0; t < views_.present.shape[0]; ++t) {
            for (Index s = 0; s < views_.present.shape[1]; ++s) {
                if (!views_.present(t, s) || (t == views_.t0 && s == views_.s0)) continue;
                const Index r = candidates_.row(t, s), K = candidates_.number();
                const auto [low, high] = std::minmax<Index>({y + candidates_.down(r, 0), y + candidates_.down(r, K - 1)});
                const Index first = std::clamp<Index>(low, 0, H_ - 2), last = std::clamp<Index>(high, 0, H_ - 2) + 2;
                load_view(t, s, first, last);
                add_view(t, s, first, y);
            }
        }
        for (Index k = 0; k < candidates_.number(); ++k) {
            const float *sum = sums_.array().at(k, 0), *weight = sums_.array().at(k, 1);
            float *out = cost.at(k, y);
            for (Index x = 0; x < W_; ++x) out[x] = weight[x] > 0 ? sum[x] / weight[x] : 1.0f;
        }
    }

  private:
    // Each value and its right neighbour in one number.
    template <class Integer>
    static void pair(const Integer *values, Index number, std::int32_t *__restrict out) {
        for (Index x = 0; x < number; ++x) out[x] = std::int32_t((std::uint32_t(values[x]) & 0xFFFFu) | (std::uint32_t(values[x + 1]) << 16));
    }

    // Rows begin..end of a view, colours and detail, as pairs of neighbours.
    void load_view(Index t, Index s, Index begin, Index end) {
        for (Index row = begin; row < end; ++row) {
            const float scale = views_.colour_unit * COLOUR_STEPS;
            split_channels(views_.colours[t][s][row], channels_.array(), [=](auto colour) { return rounded(colour * scale); });
            for (Index c = 0; c < 3; ++c) pair(channels_.array().at(c), W_, pairs_.array().at(row - begin, c));
            if (views_.detail.shape[2] > 0) {
                const std::int16_t *detail = views_.detail.at(t, s, row - views_.low);
                std::int32_t *out = pairs_.array().at(row - begin, 3);
                pair(detail, W_ - 1, out);
                out[W_ - 1] = detail[W_ - 1];
            }
        }
    }

    // Row y of the reference view, times what the weights of samples sum to.
    void load_reference(Index y) {
        for (Index x = 0; x < W_; ++x) {
            for (Index c = 0; c < 3; ++c) reference_.array()(c, x) = std::nearbyint(views_.guide(y, x, c) * COLOUR_STEPS) * float(ONE);
            if (views_.reference_detail.shape[0] > 0) reference_.array()(3, x) = float(views_.reference_detail(y - views_.low, x) * ONE);
        }
    }

    // Add one view, whose rows from low on are loaded, at every candidate of row y.
    void add_view(Index t, Index s, Index low, Index y) {
        const Index r = candidates_.row(t, s), c = candidates_.column(t, s);
        const auto nearest = visibility_.nearest[t][s];
        const bool some_hide = nearest.shape[1] > 0;
        const Float8 hidden = spread(visibility_.occluded_view_weight);
        for (Index k = 0; k < candidates_.number(); ++k) {
            const auto [top, fy] = upper_row(y, candidates_.down(r, k), candidates_.fy(r, k), H_);
            const Index left = candidates_.across(c, k);
            const float fx = candidates_.fx(c, k);
            // on the last column itself nothing beyond it is read with any weight
            const Index first = std::max<Index>(0, -left), last = std::min(W_, fx == 0 ? W_ - left : W_ - 1 - left);
            if (top < 0 || top > H_ - 2 || last <= first) continue;
            const BilinearWeights weights(fy, fx);
            const Float8 limit = spread(candidates_.disparities(k) + visibility_.occlusion_margin);
            const float *before = some_hide ? nearest.at(top - visibility_.low + (fy > 0.5f), first + left + (fx > 0.5f)) : nullptr;
            const std::int32_t *pairs = pairs_.array().at(top - low, 0, first + left);
            const float *reference = reference_.array().data + first;
            float *sum = sums_.array().at(k, 0, first);
            for (Index rest = last - first; rest > 0; rest -= LANES, pairs += LANES, reference += LANES, sum += LANES) {
                Float8 seen = spread(1);
                if (some_hide) {
                    const Float8 found = load(before);
                    seen = found <= limit ? seen : hidden;
                    if (visibility_.some_missing) seen = spread(MISSING) <= found ? Float8{} : seen;
                    before += LANES;
                }
                // pixels beyond the last add nothing to what others have added
                if (rest < LANES) seen = first_lanes(seen, rest, 0);
                add_pixels(pairs, reference, weights, seen, sum);
            }
        }
    }

    // Add eight pixels of a view at one candidate.
    void add_pixels(const std::int32_t *pairs, const float *reference, const BilinearWeights &weights, Float8 seen, float *sum) {
        const auto residual = [&](Index channel) {
            const Int8 above = load_pairs(pairs + channel * width_), below = load_pairs(pairs + (4 + channel) * width_);
            const Int8 sample = dot_of_pairs(above, weights.upper) + dot_of_pairs(below, weights.lower);
            return __builtin_convertvector(sample, Float8) - load(reference + channel * width_);
        };
        const Float8 red = residual(0), green = residual(1), blue = residual(2), detail = residual(3);
        const Float8 colours2 = fma(blue, blue, fma(green, green, red * red)), detail2 = detail * detail;
        // z / (z + scale) of either, by one division
        const Float8 of_colours = colours2 + spread(scales2_[0]), of_detail = detail2 + spread(scales2_[1]);
        const Float8 both = fma(spread(shares_[0]) * colours2, of_detail, spread(shares_[1]) * detail2 * of_colours);
        store(sum, fma(seen, both / (of_colours * of_detail), load(sum)));
        store(sum + width_, load(sum + width_) + seen);
    }

    static Int8 load_pairs(const std::int32_t *place) {
        Int8 lanes;
        std::memcpy(&lanes, place, sizeof lanes);
        return lanes;
    }

    const BaseDetail<Colour> &views_;
    const Visibility &visibility_;
    const Candidates &candidates_;
    const Index H_ = views_.colours.shape[2], W_ = views_.colours.shape[3], width_ = W_ + LANES;
    float scales2_[2], shares_[2];

    const Scratch<std::int32_t, 3> pairs_;  // of the rows of the view; where there is no detail it is 0, and fits
    const Scratch<float, 2> reference_ = zeros<float, 2>(4, width_);
    const Scratch<std::int32_t, 2> channels_ = zeros<std::int32_t, 2>(3, width_);
    const Scratch<float, 3> sums_ = zeros<float, 3>(candidates_.number(), 2, width_);  // of the costs, and of their weights
};

}  // namespace

void z_buffers(Array<const float, 2> disparity, Array<const bool, 2> present, Strided<const double, 3> baselines, Index low, Index high, Array<float, 4> out) {
    const Index S = present.shape[1], H = disparity.shape[0], W = disparity.shape[1];
    const auto [least, most] = std::minmax_element(disparity.data, disparity.data + H * W);
    parallel_for(0, present.shape[0] * S, [&, least = double(*least), most = double(*most)](Index view) {
        const Index t = view / S, s = view % S;
        if (!present(t, s)) return;
        const double v = baselines(t, s, 0), u = baselines(t, s, 1);
        // rows farther away do not get here
        const Index first = std::max<Index>(0, Index(std::floor(low - 1 + std::min(least * v, most * v))));
        const Index last = std::min(H, Index(std::ceil(high + std::max(least * v, most * v))) + 1);
        // of pixels that begin outside, too
        const auto begun = Scratch<float, 2>(high - low + 1, W + 1).filled(EMPTY);
        const BegunPixels pixels(begun.array(), low, v, u);
        for (Index y = first; y < last; ++y) pixels.add_row(disparity, y);
        for (Index row = 0; row < high - low; ++row) {
            const float *above = begun.array().at(row), *here = begun.array().at(row + 1);
            float *target = out.at(t, s, row);
            for (Index x = 0; x < W; ++x) target[x] = std::max(std::max(above[x], above[x + 1]), std::max(here[x], here[x + 1]));
        }
    });
}

void occluded_in_any_view(Array<const float, 2> disparity, Array<const bool, 2> present, Strided<const double, 3> baselines, Array<const float, 4> nearest,
                          Index low, float occlusion_margin, Index begin, Index end, Array<bool, 2> out) {
    const Index S = present.shape[1], H = disparity.shape[0], W = disparity.shape[1];
    parallel_for(begin, end, [&](Index y) {
        bool *occluded = out.at(y - begin);
        std::fill_n(occluded, W, false);
        for (Index view = 0; view < present.shape[0] * S; ++view) {
            const Index t = view / S, s = view % S;
            if (!present(t, s)) continue;
            const double v = baselines(t, s, 0), u = baselines(t, s, 1);
            for (Index x = 0; x < W; ++x) {
                const float d = disparity(y, x);
                const double row = double(y) - d * v + 0.5, column = double(x) - d * u + 0.5;
                if (row >= 0 && column >= 0 && row < double(H) && column < double(W))
                    occluded[x] |= nearest(t, s, Index(row) - low, Index(column)) > d + occlusion_margin;
            }
        }
    });
}

template <class Colour>
void sweep_visible_rows(const BaseDetail<Colour> &views, const Visibility &visibility, const RobustCost &robust, const Candidates &candidates, Index begin,
                        Index end, Array<float, 3> cost) {
    const Index K = candidates.number();
    Index height = 2;
    for (Index r = 0; r < candidates.down.shape[0]; ++r) {
        const Index between = candidates.down(r, K - 1) - candidates.down(r, 0);
        height = std::min(views.colours.shape[2], std::max(height, std::abs(between) + 2));
    }
    parallel_for(begin, end, [&](Index y) { VisibleRow<Colour>(views, visibility, robust, candidates, height).sweep(y, cost); });
}

#define INSTANTIATE(Colour)                                                                                                             \
    template void sweep_visible_rows(const BaseDetail<Colour> &, const Visibility &, const RobustCost &, const Candidates &, Index, Index, \
                                     Array<float, 3>);
INSTANTIATE(std::uint8_t)
INSTANTIATE(std::uint16_t)
INSTANTIATE(float)
#undef INSTANTIATE

}  // namespace sepi
