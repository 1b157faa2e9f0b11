#include "surface_windows.hpp"

#include <array>

#include "kernels/lanes.hpp"
#include "kernels/parallel.hpp"

namespace sepi {
namespace {

// Rows that a thread does at a stretch.
constexpr Index ROWS_AT_ONCE = 32;

// Differences of disparity and of colour over which pixels count less and less, and what one of the same disparity counts at least.
struct Widths {
    float disparity, colour, least;
};

// How far two things are alike, 1 up to half a width from each other, 0 from one and a half on.
Float8 alike(Float8 apart, float width) { return smaller(larger(1.5f - apart / width, Float8{}), spread(1)); }

// Gradient, curvature, disparity and, perhaps, colours of rows, with margins of radius and more columns: what lies beyond the
// picture has no gradient and no curvature, and adds nothing.
class PaddedRows {
  public:
    PaddedRows(const Array<const float, 2> (&pictures)[6], Index number, Index begin, Index end, Index radius)
        : radius_(radius), rows_(number, end - begin, pictures[0].shape[1] + 2 * radius + LANES) {
        const Index W = pictures[0].shape[1];
        for (Index n = 0; n < number; ++n) {
            for (Index row = begin; row < end; ++row) {
                float *place = std::fill_n(rows_.array().at(n, row - begin), radius, 0.0f);
                std::fill_n(std::copy_n(pictures[n].at(row), W, place), radius + LANES, 0.0f);
            }
        }
    }

    // Sums of gradient and curvature of the rows begin..end of the windows of eight pixels from x on of a row.
    template <bool coloured>
    std::array<Float8, 2> sums(Index begin, Index end, Index y, Index x, Widths widths) const {
        const auto own = [&](Index n) { return load(rows_.array().at(n, y, x + radius_)); };
        const Float8 disparity = own(2);
        std::array<Float8, 3> colours;
        if constexpr (coloured) colours = {own(3), own(4), own(5)};
        Float8 gradient{}, curvature{};
        for (Index row = begin; row < end; ++row) {
            const float *others[6];
            for (Index n = 0; n < (coloured ? 6 : 3); ++n) others[n] = rows_.array().at(n, row, x);
            for (Index step = 0; step <= 2 * radius_; ++step) {
                Float8 share = alike(magnitude(load(others[2] + step) - disparity), widths.disparity);
                if constexpr (coloured) {
                    const Float8 r = load(others[3] + step) - colours[0], g = load(others[4] + step) - colours[1], b = load(others[5] + step) - colours[2];
                    share *= widths.least + (1.0f - widths.least) * alike(root(r * r + g * g + b * b), widths.colour);
                }
                gradient += share * load(others[0] + step);
                curvature += share * load(others[1] + step);
            }
        }
        return {gradient, curvature};
    }

  private:
    Index radius_;
    Scratch<float, 3> rows_;
};

}  // namespace

void sums_of_surface(Array<const float, 2> gradient, Array<const float, 2> curvature, Array<const float, 2> disparity, Array<const float, 3> colours,
                     Index radius, float width, float colour_width, float least, Array<float, 3> sums) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const bool coloured = colours.shape[1] > 0;
    const Array<const float, 2> pictures[] = {gradient, curvature, disparity, colours[0], colours[1], colours[2]};
    const Widths widths{width, colour_width, least};
    parallel_for(0, (H + ROWS_AT_ONCE - 1) / ROWS_AT_ONCE, [&](Index block) {
        const Index begin = block * ROWS_AT_ONCE, end = std::min(H, begin + ROWS_AT_ONCE);
        const Index top = std::max<Index>(0, begin - radius), bottom = std::min(H, end + radius);
        const PaddedRows rows(pictures, coloured ? 6 : 3, top, bottom, radius);
        for (Index y = begin; y < end; ++y) {
            const Index first = std::max<Index>(0, y - radius) - top, last = std::min(H, y + radius + 1) - top;
            for (Index x = 0; x < W; x += LANES) {
                const auto found = coloured ? rows.sums<true>(first, last, y - top, x, widths) : rows.sums<false>(first, last, y - top, x, widths);
                for (Index n = 0; n < 2; ++n) store_first(sums.at(n, y, x), found[n], std::min<Index>(LANES, W - x));
            }
        }
    });
}

}  // namespace sepi
