// Surfaces seen through gaps: farther surfaces of a similar colour, and residuals at both depths.
#include <cmath>
#include <vector>

#include "kernels/arguments.hpp"
#include "pixels.hpp"

namespace sepi::gaps {
namespace {

// Squared residual of a bilinear sample of a view (H, W, 3) from reference (3,), in units of its expectation by noise,
// which interpolation averages. Products of 16 bits and a weight are exact in double precision.
template <class Colour>
auto squared_residual(Array<const Colour, 3> view, float unit, double row, double column, Array<const float, 1> reference) {
    using Number = std::conditional_t<std::is_same_v<Colour, std::uint16_t>, double, float>;
    const Index top = Index(row), left = Index(column);
    const float fy = float(row - double(top)), fx = float(column - double(left));
    const Index down = fy > 0 ? view.strides[0] : 0, right = fx > 0 ? view.strides[1] : 0;
    const Colour *place = view.at(top, left);
    Number total = 0;
    for (Index c = 0; c < 3; ++c, place += view.strides[2]) {
        const Number above = (1 - fx) * Number(place[0]) + fx * Number(place[right]);
        const Number below = (1 - fx) * Number(place[down]) + fx * Number(place[down + right]);
        const Number residual = ((1 - fy) * above + fy * below) * unit - reference(c);
        total += residual * residual;
    }
    return total / (1 + (fx * fx + (1 - fx) * (1 - fx)) * (fy * fy + (1 - fy) * (1 - fy)));
}

// Number of steps, up to most, from i that stay in a line of n.
Index steps_within(Index i, Index direction, Index n, Index most) { return std::min(most, direction < 0 ? i : direction > 0 ? n - 1 - i : most); }

// Disparity (H, W) of the closest farther pixel of a similar colour, along rows, columns and diagonals from each pixel;
// its own if there is none; of two equally close ones the farther. lowest (H, W) is the least disparity within reach
// pixels across and down. Farther means by more than least_step; colours (H, W, 3) are similar below distance2, squared.
void farther_alike(Array<const float, 2> disparity, Array<const float, 2> lowest, Array<const float, 3> colours, Index reach,
                   float least_step, float distance2, Array<float, 2> farther) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    parallel_for_pixels(H, W, [&](Index y, Index x) {
        const float own = disparity(y, x), limit = own - least_step, *here = colours.at(y, x);
        farther(y, x) = own;
        if (lowest(y, x) >= limit) return;
        Index closest = reach;
        for (Index dy = -1; dy <= 1; ++dy) {
            for (Index dx = -1; dx <= 1; ++dx) {
                if (dy == 0 && dx == 0) continue;
                const Index end = steps_within(y, dy, H, steps_within(x, dx, W, closest));
                for (Index step = 1; step <= end; ++step) {
                    const float there = disparity(y + step * dy, x + step * dx);
                    if (there >= limit || squared_distance(here, colours.at(y + step * dy, x + step * dx)) >= distance2) continue;
                    farther(y, x) = step == closest ? std::min(there, farther(y, x)) : there;
                    closest = step;
                    break;
                }
            }
        }
    });
}

// Squared residuals at two depths of the pixels of rows begin..end, in views (T, S, H, W, 3), times unit in 0..1, from
// the reference view (H, W, 3) in 0..1. Adds to sums (3, H, W) the residuals at the farther depth, at the other one, and
// the number of views. asked: views in which nothing hides the farther depth. Pixels with equal depths are left out. The
// residual of one view has an upper limit.
void compare_depths(const Views &views, float unit, Array<const float, 2> disparity, Array<const float, 2> farther, Strided<const float,
                    3> reference, const AskedViews &asked, float most, Index begin, Index end, Array<float, 3> sums) {
    const Index W = disparity.shape[1];
    const double bottom = double(disparity.shape[0] - 1), right = double(W - 1);
    const auto add_view = [&](const auto &view, Array<const float, 2> nearest, double down, double across, Index y, const std::vector<Index> &columns) {
        for (const Index x : columns) {
            const float d = disparity(y, x), f = farther(y, x);
            const double row = double(y) - f * down, column = double(x) - f * across;
            const double own_row = double(y) - d * down, own_column = double(x) - d * across;
            if (std::min(row, own_row) < 0 || std::min(column, own_column) < 0) continue;
            if (std::max(row, own_row) > bottom || std::max(column, own_column) > right) continue;
            const float *above = nearest.at(Index(row) - asked.low, Index(column));
            const float *below = row > std::floor(row) ? above + nearest.strides[0] : above;
            const Index beside = column > std::floor(column);
            if (std::max(std::max(above[0], above[beside]), std::max(below[0], below[beside])) > f + asked.margin) continue;
            const auto colour = reference[y][x];
            sums(0, y, x) += std::min(float(squared_residual(view, unit, row, column, colour)), most);
            sums(1, y, x) += std::min(float(squared_residual(view, unit, own_row, own_column, colour)), most);
            ++sums(2, y, x);
        }
    };
    parallel_for(begin, end, [&](Index y) {
        std::vector<Index> columns;
        for (Index x = 0; x < W; ++x)
            if (disparity(y, x) != farther(y, x)) columns.push_back(x);
        asked.for_each([&](Index t, Index s, double down, double across) {
            std::visit([&](const auto &some) { add_view(some[t][s], asked.nearest[t][s], down, across, y, columns); }, views);
        });
    });
}

const Submodule submodule("gaps", [](nb::module_ &m) {
    m.def("farther_alike", &farther_alike, Unlocked(), "disparity"_a, "lowest"_a, "colours"_a, "reach"_a, "least_step"_a, "distance2"_a,
          "farther"_a);
    m.def("compare_depths", &compare_depths, Unlocked(), "views"_a, "unit"_a, "disparity"_a, "farther"_a, "reference"_a, "asked"_a, "most"_a,
          "begin"_a, "end"_a, "sums"_a);
});

}  // namespace
}  // namespace sepi::gaps
