// Maps of all views, made from maps of a few.
#include "matching/kernels/carried_map.hpp"

namespace sepi::all_views {

using namespace carried_map;

constexpr float LEAST_WEIGHT = 0.05f;   // vote of a map with confidence 0: where maps differ, beside depth steps, all confidences are low

// The maps that are carried: the fields of sepi.extensions.views.all_views.Sources, in their order.
struct Sources {
    Array<const float, 3> disparity;   // (N, H, W)
    Array<const float, 4> told;        // (N, H, W, C): the confidence first
    Array<const float, 4> corners;     // (N, H, W, 4)
    Array<const double, 2> baselines;  // (N, 2)

    bool fields(auto visit) { return visit(disparity, told, corners, baselines); }
};

constexpr float FARTHER = 1e9f;     // above all disparities

// Maps warped to a view at v down and u across from the reference view, and their fusion.
struct Fusion {
    const Sources &sources;
    const double v, u;

    // A map's disparity at a pixel of the view, and what it tells of it, if anything.
    struct Shown {
        float disparity, weight;
        const float *told;
    };

    const Index N = sources.told.shape[0], H = sources.told.shape[1], W = sources.told.shape[2], C = sources.told.shape[3];
    const Scratch<float, 3> nearest{N, H, W};
    const Scratch<std::int32_t, 3> origin{N, H, W};
    std::vector<Shown> maps = std::vector<Shown>(N);
    std::vector<float> closeness = std::vector<float>(N);

    double down(Index n) const { return v - sources.baselines(n, 0); }
    double across(Index n) const { return u - sources.baselines(n, 1); }

    // EMPTY where none shows anything.
    void fuse(Array<float, 2> disparity, Array<float, 3> told) {
        for (Index n = 0; n < N; ++n) {
            closeness[n] = float(1 / (1 + std::hypot(down(n), across(n))));
            carry(sources.disparity[n], sources.corners[n], down(n), across(n), nearest.array()[n], origin.array()[n]);
        }
        for (Index y = 0; y < H; ++y) {
            for (Index x = 0; x < W; ++x) {
                for (Index n = 0; n < N; ++n) maps[n] = shown(n, y, x);
                const float best = best_disparity(y, x);
                // mean of the maps that agree with the best
                float total = 0, weight = 0, *sums = std::fill_n(told.at(y, x), C, 0.0f) - C;
                for (const Shown &map : maps) {
                    if (!(map.disparity > EMPTY) || std::abs(map.disparity - best) > TOLERANCE) continue;
                    total += map.weight * (map.disparity - best);
                    weight += map.weight;
                    // errors of one light field's maps are correlated, so the mean is no surer than each map
                    for (Index k = 0; k < C; ++k) sums[k] += map.weight * map.told[k];
                }
                disparity(y, x) = weight > 0 ? best + total / weight : EMPTY;
                for (Index k = 0; k < C; ++k) sums[k] = weight > 0 ? sums[k] / weight : 0;
            }
        }
    }

    Shown shown(Index n, Index y, Index x) const {
        const std::int32_t pixel = origin.array()(n, y, x);
        const float *told = pixel >= 0 ? sources.told.at(n, pixel / W, pixel % W) : nullptr;
        return {nearest.array()(n, y, x), closeness[n] * (LEAST_WEIGHT + (told ? *told : 0)), told};
    }

    // The disparity with most votes, if maps differ.
    float best_disparity(Index y, Index x) const {
        float low = FARTHER, high = EMPTY, most = -FARTHER;
        for (const Shown &map : maps)
            if (map.disparity > EMPTY) low = std::min(low, map.disparity), high = std::max(high, map.disparity);
        if (!(high > low + TOLERANCE)) return high;
        float best = high;
        for (const Shown &map : maps) {
            if (!(map.disparity > EMPTY)) continue;
            if (const float found = score(y, x, map.disparity); found > most) best = map.disparity, most = found;
        }
        return best;
    }

    // Sum of the weights of maps that show a surface, minus those of maps that see through it.
    float score(Index y, Index x, float d) const {
        float sum = 0;
        for (Index n = 0; n < N; ++n) {
            if (std::abs(maps[n].disparity - d) <= TOLERANCE) {
                sum += maps[n].weight;
            } else if (maps[n].disparity < d) {
                // it shows the background where it would show the surface
                const auto place = place_within(y + d * down(n), x + d * across(n), H, W);
                const auto is_behind = [&](Index i, Index j) { return sources.disparity(n, i, j) < d - TOLERANCE; };
                if (place && all_about(*place, is_behind)) sum -= maps[n].weight;
            }
        }
        return sum;
    }
};

// Fill EMPTY pixels with the farther of the two surfaces beside them along the view's baseline, along which gaps open.
void extend_background(double v, double u, Array<float, 2> disparity, Array<bool, 2> extended) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const double longest = std::max(std::abs(v), std::abs(u));
    const double down = longest > 0 ? v / longest : 0, across = longest > 0 ? u / longest : 1;
    for (Index y = 0; y < H; ++y)
        for (Index x = 0; x < W; ++x) extended(y, x) = !(disparity(y, x) > EMPTY);
    // the first known disparity in a direction from a pixel, or FARTHER; halves are rounded away from the pixel
    const auto first_along = [&](Index y, Index x, double dy, double dx) {
        for (Index steps = 1;; ++steps) {
            const Index row = y + Index(std::round(steps * dy)), column = x + Index(std::round(steps * dx));
            if (row < 0 || column < 0 || row >= H || column >= W) return FARTHER;
            if (!extended(row, column)) return disparity(row, column);
        }
    };
    for (Index y = 0; y < H; ++y) {
        for (Index x = 0; x < W; ++x) {
            if (!extended(y, x)) continue;
            const auto both = [&](double dy, double dx) { return std::min(first_along(y, x, dy, dx), first_along(y, x, -dy, -dx)); };
            // across the baseline only if there is none along it
            float found = both(down, across);
            if (found == FARTHER) found = both(across, -down);
            disparity(y, x) = found < FARTHER ? found : 0;
        }
    }
}

// Maps (V, H, W) of views with baselines (V, 2), what the sources tell of them (V, H, W, C), and mask of pixels that no
// source shows, filled with the background.
void maps_of_views(const Sources &sources, Array<const double, 2> baselines, Array<float, 3> disparity, Array<float, 4> told, Array<bool, 3> extended) {
    parallel_for(0, baselines.shape[0], [&](Index view) {
        const double v = baselines(view, 0), u = baselines(view, 1);
        Fusion{sources, v, u}.fuse(disparity[view], told[view]);
        // gaps lie along the baseline from the reference view, whose map covers most of the view
        extend_background(v, u, disparity[view], extended[view]);
    });
}

const Submodule submodule("all_views", {{"EMPTY", EMPTY}, {"maps_of_views", &maps_of_views}});

}  // namespace sepi::all_views
