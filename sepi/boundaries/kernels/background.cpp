// Background behind the nearer surfaces beside depth steps, from the views that see it.
#include "view_samples.hpp"

namespace sepi::background {

constexpr Index FEWEST_VIEWS = 3;  // least number of views for the colour of a background
constexpr float UNSEEN = -1;       // variance of a background that fewer views see; negative

constexpr double MOST_DEVIATION2 = 0.01;  // largest squared residual of one view in the background's variance

// Median of n numbers, INFINITE after them, by bisection: counting vectorises, sorting does not.
float median(const float *values, Index n) {
    const auto least_from = [&](float limit) {
        Float8 least = spread(INFINITE);
        for (Index v = 0; v < n; v += LANES) least = load(values + v) >= spread(limit) ? smaller(load(values + v), least) : least;
        return least_of(least);
    };
    const auto most_below = [&](float limit) {
        Float8 most = spread(-INFINITE);
        for (Index v = 0; v < n; v += LANES) most = load(values + v) < spread(limit) ? larger(load(values + v), most) : most;
        return -least_of(-most);
    };
    const int middle = int(n / 2);
    // as many or fewer lie below low, more below high or it is the largest
    float low = least_from(-INFINITE), high = most_below(INFINITE);
    int below = 0;
    for (float half; below != middle && (half = low + (high - low) * 0.5f) > low && half < high;) {
        int found = 0;
        for (Index v = 0; v < n; ++v) found += values[v] < half;
        if (found <= middle) below = found;
        (found <= middle ? low : high) = half;
    }
    // mean of the middle two of an even number
    return n % 2 || below < middle ? least_from(low) : (most_below(low) + least_from(low)) * 0.5f;
}

// Rows begin..end of the farther surfaces, of disparity layer (H, W), where wanted (H, W), also behind nearer ones:
// medians over the views that see them, or over few_views (V,) of these where they are shown (H, W) by the reference view,
// too. Into background (H, W, 4): colours, and variance of the views' colours, mean of the channels, or UNSEEN.
void background_of(const RimViews &views, Array<const float, 2> layer, Array<const bool, 2> wanted, Array<const bool, 2> shown, Array<const bool, 1> few_views, Index begin, Index end, Array<float, 3> background) {
    const Index W = layer.shape[1];
    const ViewSamples samples_of{views};
    parallel_for(begin, end, [&](Index y) {
        std::vector<Index> columns;
        for (Index x = 0; x < W; ++x) {
            background(y, x, 3) = UNSEEN;
            if (wanted(y, x)) columns.push_back(x);
        }
        const auto few = Index(columns.size());
        const auto scratch = Scratch<float, 3>(few, 3, views.number() + LANES).filled(INFINITE);
        const auto samples = scratch.array();
        std::vector<Index> count(few);
        // view by view, since neighbouring pixels are close in memory
        for (Index view = 0; view < views.number(); ++view) {
            for (Index i = 0; i < few; ++i) {
                if (!few_views(view) && shown(y, columns[i])) continue;
                const auto place = samples_of.place_seen(view, layer(y, columns[i]), y, columns[i]);
                if (!place) continue;
                const auto colour = samples_of.sample(view, *place);
                for (Index c = 0; c < 3; ++c) samples(i, c, count[i]) = colour[c];
                ++count[i];
            }
        }
        for (Index i = 0; i < few; ++i) {
            const Index n = count[i];
            if (n < FEWEST_VIEWS) continue;
            double total = 0;
            for (Index c = 0; c < 3; ++c) {
                const float middle = median(samples.at(i, c), n);
                for (Index v = 0; v < n; ++v) {
                    const float apart = samples(i, c, v) - middle;
                    total += std::min(double(apart * apart), MOST_DEVIATION2);
                }
                background(y, columns[i], c) = middle;
            }
            background(y, columns[i], 3) = float(total / double(3 * n));
        }
    });
}

const Submodule submodule("background", {
    {"background_of", &background_of},
    {"FEWEST_VIEWS", FEWEST_VIEWS},
    {"UNSEEN", UNSEEN},
});

}  // namespace sepi::background
