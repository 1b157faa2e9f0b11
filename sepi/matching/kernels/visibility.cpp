// The visibility sweep: z-buffers of every view, and costs over the views that see a pixel.
#include "pixels.hpp"
#include "sweep_arrays.hpp"

namespace sepi::visibility {
// its loops are faster if Clang knows that no other source calls it
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

    bool fields(auto visit) {
        return visit(colours, colour_unit, detail, detail_unit, low, present, t0, s0, noise, guide, reference_detail, edge);
    }
};

// Which views see a pixel, and which candidates each view compares.
struct Visibility {
    Array<const float, 3> nearest;  // (V, n, W) or (V, n, 0) of the present views, then LANES numbers; rows of the detail
    float occlusion_margin, occluded_view_weight;
    Array<const bool, 2> searched;        // (T, S): the views that compare all candidates; others compare the likely ones
    Array<const std::int32_t, 3> likely;  // (2, H or 0, W): first and last likely candidate

    bool fields(auto visit) { return visit(nearest, occlusion_margin, occluded_view_weight, searched, likely); }
};

using Columns = std::vector<std::pair<Index, Index>>;  // intervals of a row: first column, and the one after the last

constexpr float ROUNDING = 1.0f / 512;  // largest rounding error of a position in single precision, pixels
constexpr float LEAST_MARGIN = 1e-6f;   // least margin of an occluder
constexpr float COLOUR_STEPS = 20000;   // steps from black to white of colours as 16-bit integers
constexpr std::int64_t ONE = 1 << 14;   // sum of a sample's weights, which are 16-bit integers
constexpr float LEAST_BEND = 0.05f;     // second difference of a colour that is interpolated well; colours in 0..1

// z-buffer of a view: a pixel covers the positions around the point where it falls, two along either axis, or a single
// one along an axis on which it falls exactly. Squares are stored by their first position, also outside the view.
struct NearestInView {
    const double down, across;
    const Array<float, 2> nearest;  // rows are set only if drawn
    const Index H = nearest.shape[0], W = nearest.shape[1];
    const Scratch<float, 2> squares = Scratch<float, 2>(H + 2, W + 1).filled(EMPTY);
    std::vector<bool> drawn = std::vector<bool>(H);

    // Add pixel x of row y of the reference view, and for the first or last pixel its continuation beyond the border.
    void add(const float *row, Index y, Index x, bool all_before, bool all_beyond) {
        const double i = double(y) - row[x] * down, j = double(x) - row[x] * across;
        const Index top = Index(std::floor(i)), left = Index(std::floor(j));
        const bool on_row = i == double(top), on_column = j == double(left);
        if ((on_row && down != 0) || (on_column && across != 0)) {
            for (Index k = std::max<Index>(0, top); k <= std::min(H - 1, top + !on_row); ++k) {
                if (!drawn[k]) std::fill_n(nearest.at(k), W, EMPTY);
                drawn[k] = true;
                raise(nearest.at(k), all_before ? 0 : left, all_beyond ? W - 1 : std::min(W - 1, left + !on_column), row[x]);
            }
        } else if (0 <= top + 1 && top + 1 <= H) {
            raise(squares.array().at(top + 1), all_before ? 0 : left + 1, all_beyond ? W : std::min(W, left + 1), row[x]);
        }
    }

    // Add a row of the reference view, eight pixels at a time, which on a smooth surface stay adjacent in the view.
    void add_row(const float *row, Index y) {
        for (Index begin = 0; begin < W; begin += LANES) {
            bool exactly = begin + LANES > W;
            // whole pixels of the first one's shift, and whether any pixel falls exactly on a position
            const auto moved = [&](double step) {
                const Float8 by = step == 0 ? Float8{} : load(row + begin) * float(-step);
                const Int8 whole_pixels = rounded(step == 0 ? by : by - 0.5f);
                const Float8 rest = by - __builtin_convertvector(whole_pixels, Float8);
                exactly |= step != 0 && least_of(smaller(rest, 1.0f - rest)) <= ROUNDING;
                return whole_pixels;
            };
            const Int8 top = exactly ? RISING : moved(down) + std::int32_t(y + 1), left = exactly ? RISING : moved(across) + std::int32_t(begin + 1) + RISING;
            if (exactly) {
                for (Index x = begin; x < std::min(W, begin + LANES); ++x) add(row, y, x, false, false);
            } else if (0 <= top[0] && top[0] <= H && 0 <= left[0] && left[0] + LANES <= W + 1 && !any((top != top[0]) | (left - RISING != left[0]))) {
                float *place = squares.array().at(top[0], left[0]);
                store(place, larger(load(place), load(row + begin)));
            } else {
                // those outside have a place behind the last
                const std::int32_t pitch = std::int32_t(W + 1), height = std::int32_t(H + 1);
                const Int8 inside = (top >= 0) & (top < height) & (left >= 0) & (left < pitch), place = inside ? top * pitch + left : Int8{} + height * pitch;
                for (Index n = 0; n < LANES; ++n) {
                    float &there = squares.array().data[place[n]];
                    there = std::max(there, row[begin + n]);
                }
            }
        }
        add(row, y, 0, true, false);
        add(row, y, W - 1, false, true);
    }

    void finish() {
        for (Index y = 0; y < H; ++y) {
            const float *above = squares.array().at(y + (down == 0)), *here = squares.array().at(y + 1);
            float *found = nearest.at(y);
            for (Index x = 0, left = across == 0; x < W; ++x) {
                const float value = std::max(std::max(above[x + left], above[x + 1]), std::max(here[x + left], here[x + 1]));
                found[x] = drawn[y] ? std::max(found[x], value) : value;
            }
        }
    }

  private:
    static void raise(float *line, Index first, Index last, float value) {
        for (Index j = std::max<Index>(0, first); j <= last; ++j) line[j] = std::max(line[j], value);
    }
};

// Comparison of a row of the reference view with the views.
struct VisibleRow {
    const BaseDetail &views;
    const Visibility &visibility;
    const Array<const float, 1> scales2, shares;
    const Candidates &candidates;
    const Array<float, 3> cost;

    const Index K = cost.shape[0], H = views.guide.shape[0], W = cost.shape[2], width = W + LANES;
    // in steps of the integers; the detail counts as three equal channels
    const double colour_steps = double(COLOUR_STEPS) * ONE, detail_steps = ONE / double(views.detail_unit);
    const float colour_scale2 = float(scales2(0) * (colour_steps * colour_steps));
    const float detail_scale2 = float(scales2(1) * (detail_steps * detail_steps) / 3);
    // rows of the view; missing detail is 0, and matches
    const Scratch<std::int32_t, 3> view_pairs = zeros<std::int32_t, 3>(height(), 4, width);
    const Scratch<float, 2> own = zeros<float, 2>(6, width);  // colours, detail, and the first and the last likely candidate
    // second differences of colours beyond the least, a quarter of them, across and down in one number; whether a pixel or
    // the next ones that a vector takes have any
    const Scratch<std::int32_t, 2> bends = zeros<std::int32_t, 2>(3, width);
    const Scratch<bool, 1> bent = zeros<bool, 1>(width);
    const Scratch<float, 3> sums = zeros<float, 3>(K, 2, width);  // of the costs, and of their weights

    // Cost of every candidate in row y, into row n of the costs.
    void sweep(Index y, Index n) {
        // the reference view, times what the weights of samples sum to
        const Array<float, 3> reference{own.array().data, {4, 1, W}, {width, 0, 1}};
        load_rows<float>(views.guide, y, reference, [](auto colour) { return whole(colour * COLOUR_STEPS) * float(ONE); });
        for (Index x = 0; x < W && views.reference_detail.shape[0] > 0; ++x)
            reference(3, 0, x) = float(views.reference_detail(y - views.low, x) * ONE);
        load_bends(y);
        const std::vector<Columns> everywhere(K, {{0, W}}), likely = likely_columns(y);
        for (Index t = 0, number = -1; t < views.present.shape[0]; ++t) {
            for (Index s = 0; s < views.present.shape[1]; ++s) {
                number += views.present(t, s);
                if (!views.present(t, s) || (t == views.t0 && s == views.s0)) continue;
                const auto [low, high] = std::minmax<Index>({y + candidates.down(t, s, 0), y + candidates.down(t, s, K - 1)});
                const Index first = std::clamp<Index>(low, 0, H - 2), last = std::clamp<Index>(high, 0, H - 2) + 2;
                load_view(t, s, first, last);
                add_view(t, s, visibility.nearest[number], first, y, visibility.searched(t, s) ? everywhere : likely);
            }
        }
        for (Index k = 0; k < K; ++k) {
            const float *sum = sums.array().at(k, 0), *weight = sums.array().at(k, 1);
            float *out = cost.at(k, n);
            for (Index x = 0; x < W; ++x) out[x] = weight[x] > 0 ? sum[x] / weight[x] : 1.0f;
        }
    }

    // Second differences of the reference view in row y; 0 at the picture's border.
    void load_bends(Index y) {
        std::fill_n(bent.array().data, width, false);
        for (Index x = 0; x < W; ++x)
            for (Index c = 0; c < 3; ++c) {
                const auto excess = [&](Index dy, Index dx) {
                    const Index above = y - dy, below = y + dy, left = x - dx, right = x + dx;
                    if (above < 0 || below >= H || left < 0 || right >= W) return std::int32_t(0);
                    const float bend = views.guide(above, left, c) + views.guide(below, right, c) - 2 * views.guide(y, x, c);
                    return std::int32_t(std::copysign(std::max(std::abs(bend) - LEAST_BEND, 0.0f), bend) * (COLOUR_STEPS / 4));
                };
                const std::int32_t across = excess(0, 1), down = excess(1, 0);
                bends.array()(c, x) = (across & 0xFFFF) | down << 16;
                if (across != 0 || down != 0) std::fill(bent.array().data + std::max<Index>(0, x - LANES + 1), bent.array().data + x + 1, true);
            }
    }

    // Intervals of row y, for each candidate, that contain all pixels for which it is likely.
    std::vector<Columns> likely_columns(Index y) const {
        std::vector<Columns> columns(K);
        for (Index begin = 0; begin < W && visibility.likely.shape[1] > 0; begin += LANES) {
            const Index end = std::min(W, begin + LANES);
            const auto *first = visibility.likely.at(0, y), *last = visibility.likely.at(1, y);
            std::copy(first + begin, first + end, own.array().at(4, begin));
            std::copy(last + begin, last + end, own.array().at(5, begin));
            for (Index k = *std::min_element(first + begin, first + end); k <= *std::max_element(last + begin, last + end); ++k) {
                if (columns[k].empty() || columns[k].back().second < begin) columns[k].emplace_back(begin, 0);
                columns[k].back().second = end;
            }
        }
        return columns;
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

    // Add one view, whose rows from low on are loaded, to row y, in the columns of every candidate.
    void add_view(Index t, Index s, Array<const float, 2> nearest, Index low, Index y, const std::vector<Columns> &columns) {
        const Index pitch = width;
        const bool some_hide = nearest.shape[1] > 0, searched = visibility.searched(t, s);
        const Float8 hidden = spread(visibility.occluded_view_weight);
        const float margin = visibility.occlusion_margin, steepness = 1 / std::max(margin, LEAST_MARGIN);
        const std::array scale2{colour_scale2, detail_scale2}, share{shares(0), shares(1)};
        for (Index k = 0; k < K; ++k) {
            const auto [top, fy] = upper_row(y, candidates.down(t, s, k), candidates.fy(t, s, k), H);
            const Index left = candidates.across(t, s, k);
            const float fx = candidates.fx(t, s, k);
            // on the last column, the next one has weight 0
            const Index within = std::max<Index>(0, -left), beyond = std::min(W, fx == 0 ? W - left : W - 1 - left);
            if (top < 0 || top > H - 2) continue;
            // weights as pairs of 16-bit integers: pixel and right neighbour, above and below
            const auto whole_part = [](double share) { return std::int64_t(share * ONE + 0.5); };
            std::int64_t of[] = {whole_part((1.0 - fy) * (1.0 - fx)), whole_part((1.0 - fy) * fx), whole_part(fy * (1.0 - fx)), whole_part(double(fy) * fx)};
            // the largest has what rounding leaves, so that mirrored and transposed views have the same costs
            *std::max_element(of, of + 4) += ONE - (of[0] + of[1] + of[2] + of[3]);
            const Int8 upper = pair_of(of[0], of[1]), lower = pair_of(of[2], of[3]);
            // between two pixels a straight line is off from a curve through them by its second difference, times
            // f (1 - f) / 2
            const auto bow = [](std::int64_t weight) { return 2 * weight * (ONE - weight) / ONE; };
            const Int8 bows = pair_of(bow(whole_part(fx)), bow(whole_part(fy)));
            // occlusion grows from half a margin to one and a half, since disparities are uncertain
            const Float8 limit = spread(candidates.disparities(k) + 1.5f * margin), number = spread(float(k));
            const Index lower_row = top - views.low + is_nearer_next(candidates.down(t, s, k), fy);
            for (const auto &[begin, end] : columns[k]) {
                const Index first = std::max(begin, within), last = std::min(end, beyond);
                const float *before = some_hide ? nearest.at(lower_row, first + left + is_nearer_next(left, fx)) : nullptr;
                const std::int32_t *pairs = view_pairs.array().at(top - low, 0, first + left);
                const float *reference = own.array().data + first;
                const std::int32_t *bend = bends.array().data + first;
                const bool *is_bent = bent.array().data + first;
                float *sum = sums.array().at(k, 0, first);
                for (Index rest = last - first; rest > 0; rest -= LANES, pairs += LANES, reference += LANES, bend += LANES, is_bent += LANES, sum += LANES) {
                    Float8 seen = spread(1);
                    if (some_hide) {
                        const Float8 found = load(before);
                        seen = found < MISSING ? larger(hidden, smaller(seen, (limit - found) * steepness)) : Float8{};
                        before += LANES;
                    }
                    if (!searched) seen = ((load(reference + 4 * pitch) <= number) & (load(reference + 5 * pitch) >= number)) ? seen : Float8{};
                    // pixels beyond the last add 0
                    if (rest < LANES) seen = first_lanes(seen, rest, 0);
                    const auto residual = [&](Index channel) {
                        const Int8 above = load_as<Int8>(pairs + channel * pitch), under = load_as<Int8>(pairs + (4 + channel) * pitch);
                        const Int8 sample = dot_of_pairs(above, upper) + dot_of_pairs(under, lower);
                        return __builtin_convertvector(sample, Float8) - load(reference + channel * pitch);
                    };
                    Float8 red = residual(0), green = residual(1), blue = residual(2);
                    const Float8 detail = residual(3);
                    if (*is_bent) {
                        // no mismatch that interpolation explains
                        const auto unexplained = [&](Float8 off, Index channel) {
                            const Float8 most = __builtin_convertvector(dot_of_pairs(load_as<Int8>(bend + channel * pitch), bows), Float8);
                            return off - smaller(larger(off, smaller(most, Float8{})), larger(most, Float8{}));
                        };
                        red = unexplained(red, 0), green = unexplained(green, 1), blue = unexplained(blue, 2);
                    }
                    const Float8 colours2 = fma(blue, blue, fma(green, green, red * red)), detail2 = detail * detail;
                    // z / (z + scale) of colours and detail, with one division
                    const Float8 of_colours = colours2 + scale2[0], of_detail = detail2 + scale2[1];
                    const Float8 both = fma(share[0] * colours2, of_detail, share[1] * detail2 * of_colours);
                    store(sum, fma(seen, both / (of_colours * of_detail), load(sum)));
                    store(sum + pitch, load(sum + pitch) + seen);
                }
            }
        }
    }

    // Largest number of rows of a view that are needed.
    Index height() const {
        Index moved = 0;
        for (Index t = 0; t < candidates.down.shape[0]; ++t)
            for (Index s = 0; s < candidates.down.shape[1]; ++s)
                moved = std::max(moved, std::abs(candidates.down(t, s, K - 1) - candidates.down(t, s, 0)));
        return moved + 2;
    }
};

// Disparity map of the reference view as views at baselines (V, 2) see it, rows low..high: the nearest of the pixels that
// touch a position; out (V, high - low, W).
void z_buffers(Array<const float, 2> disparity, Strided<const double, 2> baselines, Index low, Index high, Array<float, 3> out) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const auto [least, most] = std::minmax_element(disparity.data, disparity.data + H * W);
    parallel_for(0, out.shape[0], [&, least = double(*least), most = double(*most)](Index n) {
        const double v = baselines(n, 0), u = baselines(n, 1);
        // only rows that can reach these; the border continues beyond the picture
        const Index first = Index(std::floor(low - 1 + std::min(least * v, most * v))), last = Index(std::ceil(high + std::max(least * v, most * v))) + 1;
        NearestInView view{v, u, out[n]};
        for (Index y = first; y < last; ++y) view.add_row(disparity.at(clamped(y, H)), y - low);
        view.finish();
    });
}

// Set pixels of out (H, W), in rows begin..end, that something nearer occludes in at least one view.
void occluded_in_any_view(Array<const float, 2> disparity, const SeenViews &views, Index begin, Index end, Array<bool, 2> out) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    parallel_for(begin, end, [&](Index y) {
        for (Index n = 0; n < views.number(); ++n) {
            const auto nearest = views.nearest[n];
            const double down = views.baselines(n, 0), across = views.baselines(n, 1);
            for (Index x = 0; x < W; ++x) {
                const float d = disparity(y, x);
                const Index row = y - Index(std::nearbyint(d * down)), column = x - Index(std::nearbyint(d * across));
                if (row >= 0 && column >= 0 && row < H && column < W) out(y, x) |= nearest(row - views.low, column) > d + views.margin;
            }
        }
    });
}

// Cost of every candidate for rows begin..end, into cost (K, end - begin, W), over the views in which nothing nearer
// occludes the pixel: 0..1; 1 without views. scales2 (2,) and shares (2,): squared robust scales, and shares in the cost,
// of colours and of detail.
void sweep_visible_rows(const BaseDetail &views, const Visibility &visibility, Array<const float, 1> scales2, Array<const float, 1> shares,
                        const Candidates &candidates, Index begin, Index end, Array<float, 3> cost) {
    parallel_for(begin, end, [&](Index y) { VisibleRow{views, visibility, scales2, shares, candidates, cost}.sweep(y, y - begin); });
}

const Submodule submodule("visibility", {
    {"EMPTY", EMPTY},
    {"MISSING", MISSING},
    {"z_buffers", &z_buffers},
    {"occluded_in_any_view", &occluded_in_any_view},
    {"sweep_visible_rows", &sweep_visible_rows},
});

}  // namespace
}  // namespace sepi::visibility
