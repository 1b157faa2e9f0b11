#include "reprojection.hpp"

#include <cmath>
#include <limits>

#include "kernels/parallel.hpp"

namespace sepi {
namespace {

// Where a view shows a pixel's point: row and column, and, where inside, the first of the four pixels round it.
struct Landing {
    double row, column;
    bool inside;
    Index top = 0, left = 0;

    Landing(Index y, Index x, float disparity, const double *baseline, Index H, Index W)
        : row(double(y) - double(disparity) * baseline[0]), column(double(x) - double(disparity) * baseline[1]),
          inside(0 <= row && row <= double(H - 1) && 0 <= column && column <= double(W - 1)) {
        if (inside) top = std::min(Index(row), H - 2), left = std::min(Index(column), W - 2);
    }
};

double squared(double number) { return number * number; }

// Calls body(i, j) for the pixels of a picture within reach of one, rows and columns.
template <class Body>
void for_window(Index y, Index x, Index reach, Index H, Index W, const Body &body) {
    for (Index i = std::max<Index>(y - reach, 0); i < std::min(y + reach + 1, H); ++i)
        for (Index j = std::max<Index>(x - reach, 0); j < std::min(x + reach + 1, W); ++j) body(i, j);
}

// Of three rows of pixels, stride apart: sums of their colours, what chance makes of these, and 1 for those that count.
struct Light {
    const float *grey, *variance, *counts;
    Index stride;
};

// Sums down the three rows of squared differences, and of what is expected of them, where both count.
void find_differences(Light one, Light other, Index n, float *__restrict apart, float *__restrict expected) {
    for (Index x = 0; x < n; ++x) {
        float squares = 0, variances = 0;
        for (Index row = 0; row < 3; ++row) {
            const Index i = row * one.stride + x;
            const float both = one.counts[i] * other.counts[i], difference = one.grey[i] - other.grey[i];
            squares += both * (difference * difference);
            variances += both * (one.variance[i] + other.variance[i]);
        }
        apart[x] = squares;
        expected[x] = variances;
    }
}

// Which pixels of two rows show the same thing, and with those beside them no more than doubt times what is expected.
void find_alike(const float *apart, const float *expected, double doubt, const std::int16_t *one, const std::int16_t *other, Index n,
                std::int32_t *__restrict alike) {
    for (Index x = 0; x < n; ++x) {
        const float difference = apart[x] + apart[x + 1] + apart[x + 2], most = expected[x] + expected[x + 1] + expected[x + 2];
        alike[x] = (double(difference) <= doubt * double(most)) & (one[x] == other[x]);
    }
}

void add_where(const std::int32_t *asked, const float *row, Index n, float *__restrict total) {
    for (Index x = 0; x < n; ++x) total[x] += asked[x] ? row[x] : 0.0f;
}

}  // namespace

void farthest_of_four(Array<const float, 3> disparities, Array<float, 3> out) {
    const Index H = disparities.shape[1], W = disparities.shape[2];
    parallel_for(0, disparities.shape[0] * H, [&](Index row) {
        const float *here = disparities.at(row / H, row % H), *below = here + disparities.strides[1];
        float *__restrict least = out.at(row / H, row % H);
        std::fill_n(least, W, 0.0f);
        if (row % H == H - 1) return;
        for (Index x = 0; x < W - 1; ++x) least[x] = std::min(std::min(here[x], here[x + 1]), std::min(below[x], below[x + 1]));
    });
}

void seen_elsewhere(Array<const float, 2> own, Array<const float, 3> farthest, Array<const double, 2> baselines, Index view, double same,
                    Array<bool, 2> hidden, Array<bool, 2> seen) {
    const Index H = own.shape[0], W = own.shape[1];
    parallel_for(0, H, [&](Index y) {
        std::fill_n(hidden.at(y), W, false);
        std::fill_n(seen.at(y), W, false);
        // view by view: pixels beside each other lie beside each other in all of them
        for (Index other = 0; other < farthest.shape[0]; ++other) {
            if (other == view) continue;
            for (Index x = 0; x < W; ++x) {
                const Landing at(y, x, own(y, x), baselines.at(other), H, W);
                if (!at.inside) continue;
                const bool behind = double(farthest(other, at.top, at.left)) > double(own(y, x)) + same;
                hidden(y, x) |= behind;
                seen(y, x) |= !behind;
            }
        }
    });
}

void one_of_four(Array<const std::int16_t, 3> surface, Array<std::int16_t, 3> out) {
    const Index H = surface.shape[1], W = surface.shape[2];
    parallel_for(0, surface.shape[0] * H, [&](Index row) {
        const std::int16_t *here = surface.at(row / H, row % H), *below = here + surface.strides[1];
        std::int16_t *__restrict one = out.at(row / H, row % H);
        std::fill_n(one, W, -2);
        if (row % H == H - 1) return;
        for (Index x = 0; x < W - 1; ++x) one[x] = ((here[x + 1] == here[x]) & (below[x] == here[x]) & (below[x + 1] == here[x])) ? here[x] : -2;
    });
}

void gathered_light(Array<const float, 4> light, Array<const float, 3> disparities, Array<const std::int16_t, 2> surface, Array<const std::int16_t, 3> around,
                    Array<const double, 2> baselines, Index view, double bend, Array<float, 3> mean, Array<float, 2> variance) {
    const Index H = disparities.shape[1], W = disparities.shape[2];
    parallel_for(0, H, [&](Index y) {
        // of each pixel of the row: views that count, sums of their colours, of the squares of what those sum to
        const auto seen = Scratch<double, 1>(W).filled(1);
        const Scratch<double, 2> totals(W, 3);
        const Scratch<double, 1> squares(W);
        const auto sum_of = [&](const double *total) { return total[0] + total[1] + total[2]; };
        std::copy_n(light.at(view, y), 3 * W, totals.array().data);
        for (Index x = 0; x < W; ++x) squares.array()(x) = squared(sum_of(totals.array().at(x)));
        // view by view: pixels beside each other lie beside each other in all of them
        for (Index other = 0; other < disparities.shape[0]; ++other) {
            if (other == view) continue;
            for (Index x = 0; x < W; ++x) {
                const float own = disparities(view, y, x);
                const Landing at(y, x, own, baselines.at(other), H, W);
                if (!at.inside || surface(y, x) < 0 || around(other, at.top, at.left) != surface(y, x)) continue;
                const float down = float(at.row - double(at.top)), across = float(at.column - double(at.left)), up = 1 - down, left = 1 - across;
                const float a = up * left, b = up * across, c = down * left, d = down * across;
                const float *above = disparities.at(other, at.top, at.left), *below = disparities.at(other, at.top + 1, at.left);
                const float there = a * above[0] + b * above[1] + c * below[0] + d * below[1];
                if (double(std::abs(there - own)) > bend) continue;
                above = light.at(other, at.top, at.left), below = light.at(other, at.top + 1, at.left);
                float grey = 0;
                for (Index k = 0; k < 3; ++k) {
                    const float part = (a * above[k] + b * above[3 + k]) + (c * below[k] + d * below[3 + k]);
                    totals.array()(x, k) += double(part);
                    grey += part;
                }
                squares.array()(x) += double(grey * grey);
                ++seen.array()(x);
            }
        }
        for (Index x = 0; x < W; ++x) {
            const double *total = totals.array().at(x), number = seen.array()(x);
            // equal ones may differ by rounding
            const double between = std::max(squares.array()(x) / number - squared(sum_of(total) / number), 0.0);
            variance(y, x) = number > 1 ? float(between / (number - 1)) : 0.0f;
            for (Index k = 0; k < 3; ++k) mean(y, x, k) = float(total[k] / number);
        }
    });
}

void alike_light(Array<const float, 3> light, Array<const float, 2> variance, Array<const std::int16_t, 2> surface, Index reach, double doubt,
                 Array<float, 3> out) {
    const Index H = surface.shape[0], W = surface.shape[1];
    const Scratch<float, 3> channels(4, H, W);  // of the fourth each pixel has 1
    const auto rows = zeros<float, 3>(3, H + 2, W);  // with one of nothing at either end
    const auto &all = rows.array();
    parallel_for(0, H, [&](Index y) {
        for (Index x = 0; x < W; ++x) {
            for (Index c = 0; c < 4; ++c) channels.array()(c, y, x) = c < 3 ? light(y, x, c) : 1.0f;
            all(0, y + 1, x) = light(y, x, 0) + light(y, x, 1) + light(y, x, 2);
            all(1, y + 1, x) = variance(y, x);
            all(2, y + 1, x) = float(surface(y, x) >= 0);
        }
    });
    // the row above a pixel comes first
    const auto light_from = [&](Index y, Index x) { return Light{all.at(0, y, x), all.at(1, y, x), all.at(2, y, x), W}; };
    parallel_for(0, H, [&](Index y) {
        const auto totals = zeros<float, 2>(4, W), sums = zeros<float, 2>(2, W + 2);
        const Scratch<std::int32_t, 1> alike(W);
        float *apart = sums.array().at(0), *expected = sums.array().at(1);
        for (Index v = std::max<Index>(y - reach, 0); v < std::min(y + reach + 1, H); ++v) {
            for (Index across = std::max(-reach, 1 - W); across <= std::min(reach, W - 1); ++across) {
                // of a row shifted against the other, the pixels that both have; and nothing at either end
                const Index first = std::max<Index>(0, -across), there = std::max<Index>(0, across), n = W - std::abs(across);
                find_differences(light_from(y, first), light_from(v, there), n, apart + 1, expected + 1);
                apart[n + 1] = expected[n + 1] = 0;
                find_alike(apart, expected, doubt, surface.at(y, first), surface.at(v, there), n, alike.array().data);
                for (Index c = 0; c < 4; ++c) add_where(alike.array().data, channels.array().at(c, v, there), n, totals.array().at(c, first));
            }
        }
        for (Index x = 0; x < W; ++x)
            for (Index c = 0; c < 3; ++c) out(y, x, c) = surface(y, x) >= 0 ? totals.array()(c, x) / totals.array()(3, x) : light(y, x, c);
    });
}

void limit_bent(Array<const std::int16_t, 2> things, Array<const bool, 2> whole, Index reach, Array<float, 3> shown) {
    const Index H = whole.shape[0], W = whole.shape[1];
    parallel_for(0, H, [&](Index y) {
        for (Index x = 0; x < W; ++x) {
            const auto same = [&, thing = things(y, x)](Index i, Index j) { return things(i, j) == thing; };
            bool one = !whole(y, x);
            for_window(y, x, 1, H, W, [&](Index i, Index j) { one &= same(i, j); });
            if (!one) continue;
            for (Index c = 0; c < 3; ++c) {
                float low = std::numeric_limits<float>::infinity(), high = 0;
                for_window(y, x, reach, H, W, [&](Index i, Index j) {
                    if (whole(i, j) && same(i, j)) low = std::min(low, shown(i, j, c)), high = std::max(high, shown(i, j, c));
                });
                if (low <= high) shown(y, x, c) = std::min(std::max(shown(y, x, c), low), high);
            }
        }
    });
}

}  // namespace sepi
