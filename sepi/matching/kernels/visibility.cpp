// The visibility sweep: z-buffers of every view, and costs over the views that see a pixel.
#include "kernels/arguments.hpp"
#include "pixels.hpp"
#include "sweep_arrays.hpp"

namespace sepi {
namespace {

constexpr float EMPTY = -1e9f;   // in a z-buffer where no pixel of the reference view falls: nothing is nearer
constexpr float MISSING = 1e9f;  // where the view shows nothing: not even a view that hides a pixel counts less

// Colours and detail of all views: the fields of sepi.matching.base_detail.BaseDetail, in their order.
struct BaseDetail {
    Views colours;  // (T, S, H, W, 3): grey views have three equal channels
    float colour_unit;
    Array<const std::int16_t, 4> detail;  // (T, S, n or 0, W)
    float detail_unit;
    Index low;                       // first row of the detail
    Array<const bool, 2> present;    // (T, S)
    Index t0, s0;
    double noise;
    Strided<const float, 3> guide;                   // (H, W, 3)
    Array<const std::int16_t, 2> reference_detail;  // (n or 0, W)
    double edge;

    auto fields() {
        return std::tie(colours, colour_unit, detail, detail_unit, low, present, t0, s0, noise, guide, reference_detail, edge);
    }
};

// In which views a pixel is seen.
struct Visibility {
    Array<const float, 4> nearest;  // (T, S, n, W) or (T, S, n, 0), and LANES numbers behind it; rows as those of the detail
    float occlusion_margin, occluded_view_weight;

    auto fields() { return std::tie(nearest, occlusion_margin, occluded_view_weight); }
};

constexpr float ROUNDING = 1.0f / 512;  // how far a position is from the same in single precision, at most, pixels
constexpr float COLOUR_STEPS = 20000;   // from black to white, of colours as whole numbers of 16 bits
constexpr std::int64_t ONE = 1 << 14;   // the sum of a sample's weights, which are whole numbers of 16 bits

// Add a row of the reference view, W pixels at y, to what is nearest of the pixels whose square begins at a position of a
// view. Pixels of a smooth surface lie side by side in the view, too: eight at once.
void add_row(const float *row, Index W, Index y, double down, double across, Array<float, 2> begun) {
    const auto top_of = [=](Index x) { return Index(std::floor(double(y) - row[x] * down)); };
    const auto left_of = [=](Index x) { return Index(std::floor(double(x + 1) - row[x] * across)); };
    for (Index begin = 0; begin < W; begin += LANES) {
        const Index end = std::min(W, begin + LANES), top = top_of(begin), left = left_of(begin);
        if (begin + LANES <= W && 0 <= top && top < begun.shape[0] && 0 <= left && left + LANES <= begun.shape[1]) {
            // how far beyond where the first begins, of 0..1 if they lie side by side
            const Float8 d = load(row + begin), dy = float(y - top) - d * float(down), dx = float(begin + 1 - left) - d * float(across);
            if (least_of(smaller(smaller(dy, 1.0f - dy), smaller(dx, 1.0f - dx))) > ROUNDING) {
                float *place = begun.at(top, left);
                store(place, larger(load(place), d));
                continue;
            }
        }
        for (Index x = begin; x < end; ++x)
            if (const Index i = top_of(x), j = left_of(x); 0 <= i && i < begun.shape[0] && 0 <= j && j < begun.shape[1])
                begun(i, j) = std::max(begun(i, j), row[x]);
    }
}

// What a row of the reference view is compared with, and what comes of it.
struct VisibleRow {
    const BaseDetail &views;
    const Visibility &visibility;
    const Array<const float, 1> scales2, shares;
    const Candidates &candidates;
    const Array<float, 3> cost;

    const Index K = cost.shape[0], H = cost.shape[1], W = cost.shape[2], width = W + LANES;
    // in steps of the whole numbers; the detail counts as three equal channels
    const double colour_steps = double(COLOUR_STEPS) * ONE, detail_steps = ONE / double(views.detail_unit);
    const float colour_scale2 = float(scales2(0) * (colour_steps * colour_steps));
    const float detail_scale2 = float(scales2(1) * (detail_steps * detail_steps) / 3);
    // of the rows of the view; where there is no detail it is 0, and fits
    const Scratch<std::int32_t, 3> view_pairs = zeros<std::int32_t, 3>(height(), 4, width);
    const Scratch<float, 2> own = zeros<float, 2>(4, width);
    const Scratch<float, 3> sums = zeros<float, 3>(K, 2, width);  // of the costs, and of their weights

    // Cost of every candidate in row y.
    void sweep(Index y) {
        // the reference view, times what the weights of samples sum to
        const Array<float, 3> reference{own.array().data, {4, 1, W}, {width, 0, 1}};
        load_rows<float>(views.guide, y, reference, [](auto colour) { return whole(colour * COLOUR_STEPS) * float(ONE); });
        for (Index x = 0; x < W && views.reference_detail.shape[0] > 0; ++x)
            reference(3, 0, x) = float(views.reference_detail(y - views.low, x) * ONE);
        for (Index t = 0; t < views.present.shape[0]; ++t) {
            for (Index s = 0; s < views.present.shape[1]; ++s) {
                if (!views.present(t, s) || (t == views.t0 && s == views.s0)) continue;
                const Index r = candidates.row(t, s);
                const auto [low, high] = std::minmax<Index>({y + candidates.down(r, 0), y + candidates.down(r, K - 1)});
                const Index first = std::clamp<Index>(low, 0, H - 2), last = std::clamp<Index>(high, 0, H - 2) + 2;
                load_view(t, s, first, last);
                add_view(t, s, first, y);
            }
        }
        for (Index k = 0; k < K; ++k) {
            const float *sum = sums.array().at(k, 0), *weight = sums.array().at(k, 1);
            float *out = cost.at(k, y);
            for (Index x = 0; x < W; ++x) out[x] = weight[x] > 0 ? sum[x] / weight[x] : 1.0f;
        }
    }

    // Rows begin..end of a view, colours and detail: each value and its right neighbour in one number.
    void load_view(Index t, Index s, Index begin, Index end) {
        for (Index i = 0; i < end - begin; ++i) {
            const Array<std::int32_t, 3> row{view_pairs.array().at(i), {4, 1, W}, {width, 0, 1}};
            const float scale = views.colour_unit * COLOUR_STEPS;
            load_rows(views.colours, t, s, begin + i, row, [=](auto colour) { return rounded(colour * scale); });
            if (views.detail.shape[2] > 0) std::copy_n(views.detail.at(t, s, begin + i - views.low), W, row.at(3));
            for (Index c = 0; c < 4; ++c) {
                std::int32_t *values = row.at(c);
                for (Index x = 0; x < W; ++x) values[x] = (values[x] & 0xFFFF) | values[x + 1] << 16;
            }
        }
    }

    // Add one view, whose rows from low on are loaded, at every candidate of row y.
    void add_view(Index t, Index s, Index low, Index y) {
        const Index r = candidates.row(t, s), c = candidates.column(t, s), pitch = width;
        const auto nearest = visibility.nearest[t][s];
        const bool some_hide = nearest.shape[1] > 0;
        const Float8 hidden = spread(visibility.occluded_view_weight);
        const std::array scale2{colour_scale2, detail_scale2}, share{shares(0), shares(1)};
        for (Index k = 0; k < K; ++k) {
            const auto [top, fy] = upper_row(y, candidates.down(r, k), candidates.fy(r, k), H);
            const Index left = candidates.across(c, k);
            const float fx = candidates.fx(c, k);
            // on the last column itself nothing beyond it is read with any weight
            const Index first = std::max<Index>(0, -left), last = std::min(W, fx == 0 ? W - left : W - 1 - left);
            if (top < 0 || top > H - 2 || last <= first) continue;
            // of neighbours, pairs of whole numbers of 16 bits: pixel and right neighbour, above and below
            const auto below = std::int64_t(double(fy) * ONE + 0.5), right = std::int64_t((ONE - below) * double(fx) + 0.5);
            const auto lower_right = std::int64_t(below * double(fx) + 0.5);
            const Int8 upper = pair_of(ONE - below - right, right), lower = pair_of(below - lower_right, lower_right);
            const Float8 limit = spread(candidates.disparities(k) + visibility.occlusion_margin);
            const float *before = some_hide ? nearest.at(top - views.low + (fy > 0.5f), first + left + (fx > 0.5f)) : nullptr;
            const std::int32_t *pairs = view_pairs.array().at(top - low, 0, first + left);
            const float *reference = own.array().data + first;
            float *sum = sums.array().at(k, 0, first);
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
                    std::memcpy(&above, pairs + channel * pitch, sizeof above);
                    std::memcpy(&under, pairs + (4 + channel) * pitch, sizeof under);
                    const Int8 sample = dot_of_pairs(above, upper) + dot_of_pairs(under, lower);
                    return __builtin_convertvector(sample, Float8) - load(reference + channel * pitch);
                };
                const Float8 red = residual(0), green = residual(1), blue = residual(2), detail = residual(3);
                const Float8 colours2 = fma(blue, blue, fma(green, green, red * red)), detail2 = detail * detail;
                // z / (z + scale) of either, by one division
                const Float8 of_colours = colours2 + scale2[0], of_detail = detail2 + scale2[1];
                const Float8 both = fma(share[0] * colours2, of_detail, share[1] * detail2 * of_colours);
                store(sum, fma(seen, both / (of_colours * of_detail), load(sum)));
                store(sum + pitch, load(sum + pitch) + seen);
            }
        }
    }

    // How many rows of a view are looked at, at most.
    Index height() const {
        Index moved = 0;
        for (Index r = 0; r < candidates.down.shape[0]; ++r)
            moved = std::max(moved, std::abs(candidates.down(r, K - 1) - candidates.down(r, 0)));
        return moved + 2;
    }
};

// Disparity map of the reference view as each view sees it, rows low..high: the nearest of the pixels that touch a
// position; out (T, S, high - low, W).
void z_buffers(Array<const float, 2> disparity, Array<const bool, 2> present, Strided<const double, 3> baselines, Index low, Index high,
               Array<float, 4> out) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const auto [least, most] = std::minmax_element(disparity.data, disparity.data + H * W);
    over_stretches(present.shape, 1, 1, [&, least = double(*least), most = double(*most)](Index t, Index s, Index, Index) {
        if (!present(t, s)) return;
        const double v = baselines(t, s, 0), u = baselines(t, s, 1);
        // rows farther away do not get here
        const Index first = std::max<Index>(0, Index(std::floor(low - 1 + std::min(least * v, most * v))));
        const Index last = std::min(H, Index(std::ceil(high + std::max(least * v, most * v))) + 1);
        // of pixels that begin outside, too
        const auto begun = Scratch<float, 2>(high - low + 1, W + 1).filled(EMPTY);
        for (Index y = first; y < last; ++y) add_row(disparity.at(y), W, y + 1 - low, v, u, begun.array());
        for (Index row = 0; row < high - low; ++row) {
            const float *above = begun.array().at(row), *here = begun.array().at(row + 1);
            float *target = out.at(t, s, row);
            for (Index x = 0; x < W; ++x) target[x] = std::max(std::max(above[x], above[x + 1]), std::max(here[x], here[x + 1]));
        }
    });
}

// Pixels that something nearer occludes in one of the views that could see them, of rows begin..end of the map: those of
// out (H, W) that it sets.
void occluded_in_any_view(Array<const float, 2> disparity, const AskedViews &views, Index begin, Index end, Array<bool, 2> out) {
    const double H = double(disparity.shape[0]), W = double(disparity.shape[1]);
    parallel_for(begin, end, [&](Index y) {
        views.for_each([&](Index t, Index s, double down, double across) {
            for (Index x = 0; x < disparity.shape[1]; ++x) {
                const float d = disparity(y, x);
                const double row = double(y) - d * down + 0.5, column = double(x) - d * across + 0.5;
                if (row >= 0 && column >= 0 && row < H && column < W)
                    out(y, x) |= views.nearest(t, s, Index(row) - views.low, Index(column)) > d + views.margin;
            }
        });
    });
}

// Cost of every candidate for rows begin..end, into cost (K, H, W), over the views in which nothing nearer occludes the
// pixel: 0..1; 1 where no view is left. scales2 (2,) and shares (2,) are the square of the robust scale, and the share in
// the cost, of colours and of detail.
void sweep_visible_rows(const BaseDetail &views, const Visibility &visibility, Array<const float, 1> scales2, Array<const float, 1> shares,
                        const Candidates &candidates, Index begin, Index end, Array<float, 3> cost) {
    parallel_for(begin, end, [&](Index y) { VisibleRow{views, visibility, scales2, shares, candidates, cost}.sweep(y); });
}

const Submodule submodule("visibility", [](nb::module_ &m) {
    m.attr("EMPTY") = EMPTY;
    m.attr("MISSING") = MISSING;
    m.def("z_buffers", &z_buffers, Unlocked(), "disparity"_a, "present"_a, "baselines"_a, "low"_a, "high"_a, "out"_a);
    m.def("occluded_in_any_view", &occluded_in_any_view, Unlocked(), "disparity"_a, "views"_a, "begin"_a, "end"_a, "out"_a);
    m.def("sweep_visible_rows", &sweep_visible_rows, Unlocked(), "views"_a, "visibility"_a, "scales2"_a, "shares"_a, "candidates"_a,
          "begin"_a, "end"_a, "cost"_a);
});

}  // namespace
}  // namespace sepi
