#include "visibility.hpp"

#include "sample_polynomials.hpp"

namespace sepi {
namespace {

constexpr float ROUNDING = 1.0f / 512;  // how far a position is from the same in single precision, at most, pixels
constexpr float COLOUR_STEPS = 20000;   // from black to white, of colours as whole numbers of 16 bits
constexpr std::int64_t ONE = 1 << 14;   // the sum of a sample's weights, which are whole numbers of 16 bits

// Draws the W pixels of a row y of the reference view into a view: what is nearest at the positions that their squares touch,
// two along either axis. Pixels that lie on a position touch the one on this side or on that, as if the grid of views were
// sheared a little: else all views of the reference view's row or column had it on the same side. Pixels of a smooth surface
// lie side by side in the view, too: eight at once.
void add_row(const float *row, Index W, Index y, double down, double across, Array<float, 2> nearest) {
    const bool up = across < 0 || (across == 0 && down < 0), before = down < 0 || (down == 0 && across < 0);
    const auto first_of = [](double position, bool earlier) { return Index(earlier ? std::ceil(position) - 1 : std::floor(position)); };
    // how far beyond where the first begins, of 0..1 if they lie side by side
    const auto between = [](Float8 beyond) { return least_of(smaller(beyond, 1.0f - beyond)) > ROUNDING; };
    const auto square_of = [&](Index x) { return std::pair(first_of(double(y) - row[x] * down, up), first_of(double(x) - row[x] * across, before)); };
    for (Index begin = 0; begin < W; begin += LANES) {
        if (const auto [top, left] = square_of(begin); begin + LANES <= W && 0 <= top && top + 2 <= nearest.shape[0] && 0 <= left && left + 1 + LANES <= W) {
            const Float8 d = load(row + begin);
            if ((down == 0 || between(float(y - top) - d * float(down))) && (across == 0 || between(float(begin - left) - d * float(across)))) {
                for (Index i = top; i < top + 2; ++i)
                    for (Index j = left; j < left + 2; ++j) store(nearest.at(i, j), larger(load(nearest.at(i, j)), d));
                continue;
            }
        }
        for (Index x = begin; x < std::min(W, begin + LANES); ++x) {
            const auto [top, left] = square_of(x);
            for (Index i = std::max<Index>(0, top); i < std::min(nearest.shape[0], top + 2); ++i)
                for (Index j = std::max<Index>(0, left); j < std::min(W, left + 2); ++j) nearest(i, j) = std::max(nearest(i, j), row[x]);
        }
    }
}

// What a row of the reference view is compared with, and what comes of it.
class VisibleRow {
  public:
    VisibleRow(const BaseDetail &views, const Visibility &visibility, const RobustCost &robust, const Candidates &candidates, Array<float, 3> cost)
        : views_(views), visibility_(visibility), candidates_(candidates), cost_(cost), shares_{robust.shares(0), robust.shares(1)} {
        // in steps of the whole numbers; the detail counts as three equal channels
        const double colours = double(COLOUR_STEPS) * ONE, detail = ONE / double(views.detail_unit);
        scales2_[0] = float(robust.scales2(0) * (colours * colours));
        scales2_[1] = float(robust.scales2(1) * (detail * detail) / 3);
    }

    // Cost of every candidate in row y.
    void sweep(Index y) {
        // the reference view, times what the weights of samples sum to
        const Array<float, 3> own{reference_.array().data, {4, 1, W_}, {width_, 0, 1}};
        load_rows<float>(views_.guide, y, own, [](auto colour) { return whole(colour * COLOUR_STEPS) * float(ONE); });
        for (Index x = 0; x < W_ && views_.reference_detail.shape[0] > 0; ++x) own(3, 0, x) = float(views_.reference_detail(y - views_.low, x) * ONE);
        for (Index t = 0; t < views_.present.shape[0]; ++t) {
            for (Index s = 0; s < views_.present.shape[1]; ++s) {
                if (!views_.present(t, s) || (t == views_.t0 && s == views_.s0)) continue;
                const Index r = candidates_.row(t, s);
                const auto [low, high] = std::minmax<Index>({y + candidates_.down(r, 0), y + candidates_.down(r, K_ - 1)});
                const Index first = std::clamp<Index>(low, 0, H_ - 2), last = std::clamp<Index>(high, 0, H_ - 2) + 2;
                load_view(t, s, first, last);
                add_view(t, s, first, y);
            }
        }
        for (Index k = 0; k < K_; ++k) {
            const float *sum = sums_.array().at(k, 0), *weight = sums_.array().at(k, 1);
            float *out = cost_.at(k, y);
            for (Index x = 0; x < W_; ++x) out[x] = weight[x] > 0 ? sum[x] / weight[x] : 1.0f;
        }
    }

  private:
    // Rows begin..end of a view, colours and detail: each value and its right neighbour in one number.
    void load_view(Index t, Index s, Index begin, Index end) {
        for (Index i = 0; i < end - begin; ++i) {
            const Array<std::int32_t, 3> row{pairs_.array().at(i), {4, 1, W_}, {width_, 0, 1}};
            load_rows(views_.colours, t, s, begin + i, row, [scale = views_.colour_unit * COLOUR_STEPS](auto colour) { return rounded(colour * scale); });
            if (views_.detail.shape[2] > 0) std::copy_n(views_.detail.at(t, s, begin + i - views_.low), W_, row.at(3));
            for (Index c = 0; c < 4; ++c) {
                std::int32_t *values = row.at(c);
                for (Index x = 0; x < W_; ++x) values[x] = (values[x] & 0xFFFF) | values[x + 1] << 16;
            }
        }
    }

    // Whether a position beyond a whole one is nearer to the next; halves go to the even one, from either side.
    static Index is_nearer_next(Index whole, float fraction) { return fraction > 0.5f || (fraction == 0.5f && whole % 2 != 0); }

    // Add one view, whose rows from low on are loaded, at every candidate of row y.
    void add_view(Index t, Index s, Index low, Index y) {
        const Index r = candidates_.row(t, s), c = candidates_.column(t, s), width = width_;
        const auto nearest = visibility_.nearest[t][s];
        const bool some_hide = nearest.shape[1] > 0;
        const Float8 hidden = spread(visibility_.occluded_view_weight);
        const std::array scales2 = scales2_, shares = shares_;
        for (Index k = 0; k < K_; ++k) {
            const auto [top, fy] = upper_row(y, candidates_.down(r, k), candidates_.fy(r, k), H_);
            const Index left = candidates_.across(c, k);
            const float fx = candidates_.fx(c, k);
            // on the last column itself nothing beyond it is read with any weight
            const Index first = std::max<Index>(0, -left), last = std::min(W_, fx == 0 ? W_ - left : W_ - 1 - left);
            if (top < 0 || top > H_ - 2 || last <= first) continue;
            // of neighbours, pairs of whole numbers of 16 bits: pixel and right neighbour, above and below
            const auto below = std::int64_t(double(fy) * ONE + 0.5), right = std::int64_t((ONE - below) * double(fx) + 0.5);
            const auto lower_right = std::int64_t(below * double(fx) + 0.5);
            const Int8 upper = pair_of(ONE - below - right, right), lower = pair_of(below - lower_right, lower_right);
            const Float8 limit = spread(candidates_.disparities(k) + visibility_.occlusion_margin);
            const Index lower_row = top - views_.low + is_nearer_next(candidates_.down(r, k), fy);
            const float *before = some_hide ? nearest.at(lower_row, first + left + is_nearer_next(left, fx)) : nullptr;
            const std::int32_t *pairs = pairs_.array().at(top - low, 0, first + left);
            const float *reference = reference_.array().data + first;
            float *sum = sums_.array().at(k, 0, first);
            for (Index rest = last - first; rest > 0; rest -= LANES, pairs += LANES, reference += LANES, sum += LANES) {
                Float8 seen = spread(1);
                if (some_hide) {
                    const Float8 found = load(before);
                    seen = found <= limit ? seen : found < MISSING ? hidden : Float8{};
                    before += LANES;
                }
                // pixels beyond the last add nothing to what others have added
                if (rest < LANES) seen = first_lanes(seen, rest, 0);
                const auto residual = [&](Index channel) {
                    Int8 above, under;
                    std::memcpy(&above, pairs + channel * width, sizeof above);
                    std::memcpy(&under, pairs + (4 + channel) * width, sizeof under);
                    const Int8 sample = dot_of_pairs(above, upper) + dot_of_pairs(under, lower);
                    return __builtin_convertvector(sample, Float8) - load(reference + channel * width);
                };
                const Float8 red = residual(0), green = residual(1), blue = residual(2), detail = residual(3);
                const Float8 colours2 = fma(blue, blue, fma(green, green, red * red)), detail2 = detail * detail;
                // z / (z + scale) of either, by one division
                const Float8 of_colours = colours2 + scales2[0], of_detail = detail2 + scales2[1];
                const Float8 both = fma(shares[0] * colours2, of_detail, shares[1] * detail2 * of_colours);
                store(sum, fma(seen, both / (of_colours * of_detail), load(sum)));
                store(sum + width, load(sum + width) + seen);
            }
        }
    }

    // How many rows of a view are looked at, at most.
    Index height() const {
        Index moved = 0;
        for (Index r = 0; r < candidates_.down.shape[0]; ++r) moved = std::max(moved, std::abs(candidates_.down(r, K_ - 1) - candidates_.down(r, 0)));
        return moved + 2;
    }

    const BaseDetail &views_;
    const Visibility &visibility_;
    const Candidates &candidates_;
    const Array<float, 3> cost_;
    const Index K_ = cost_.shape[0], H_ = cost_.shape[1], W_ = cost_.shape[2], width_ = W_ + LANES;
    std::array<float, 2> scales2_, shares_;

    const Scratch<std::int32_t, 3> pairs_ = zeros<std::int32_t, 3>(height(), 4, width_);  // of the rows of the view; where there is no detail it is 0, and fits
    const Scratch<float, 2> reference_ = zeros<float, 2>(4, width_);
    const Scratch<float, 3> sums_ = zeros<float, 3>(K_, 2, width_);  // of the costs, and of their weights
};

}  // namespace

void z_buffers(Array<const float, 2> disparity, Array<const bool, 2> present, Strided<const double, 3> baselines, Index low, Index high, Array<float, 4> out) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const auto [least, most] = std::minmax_element(disparity.data, disparity.data + H * W);
    over_stretches(present.shape, 1, 1, [&, least = double(*least), most = double(*most)](Index t, Index s, Index, Index) {
        if (!present(t, s)) return;
        const double v = baselines(t, s, 0), u = baselines(t, s, 1);
        // rows farther away do not get here
        const Index first = std::max<Index>(0, Index(std::floor(low - 1 + std::min(least * v, most * v))));
        const Index last = std::min(H, Index(std::ceil(high + std::max(least * v, most * v))) + 1);
        const Array<float, 2> nearest = out[t][s];
        std::fill_n(nearest.data, nearest.shape[0] * W, EMPTY);
        for (Index y = first; y < last; ++y) add_row(disparity.at(y), W, y - low, v, u, nearest);
    });
}

void occluded_in_any_view(Array<const float, 2> disparity, const AskedViews &views, Index begin, Index end, Array<bool, 2> out) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    parallel_for(begin, end, [&](Index y) {
        views.for_each([&](Index t, Index s, double down, double across) {
            for (Index x = 0; x < W; ++x) {
                const float d = disparity(y, x);
                const Index row = y - Index(std::nearbyint(d * down)), column = x - Index(std::nearbyint(d * across));
                if (row >= 0 && column >= 0 && row < H && column < W) out(y, x) |= views.nearest(t, s, row - views.low, column) > d + views.margin;
            }
        });
    });
}

void sweep_visible_rows(const BaseDetail &views, const Visibility &visibility, const RobustCost &robust, const Candidates &candidates, Index begin, Index end,
                        Array<float, 3> cost) {
    parallel_for(begin, end, [&](Index y) { VisibleRow(views, visibility, robust, candidates, cost).sweep(y); });
}

}  // namespace sepi
