#include "specks.hpp"

#include <cmath>
#include <vector>

#include "kernels/parallel.hpp"

namespace sepi {
namespace {

struct Pixel {
    Index row, column;

    bool operator==(const Pixel &) const = default;
};

using Part = std::vector<Pixel>;

bool is_among(const Part &part, Pixel pixel) { return std::find(part.begin(), part.end(), pixel) != part.end(); }

// Whether a test holds for a pixel and all of its neighbours; none is tested after one for which it does not.
template <class Test>
bool all_about(Array<const float, 2> disparity, Pixel pixel, Test test) {
    const Index bottom = std::min(disparity.shape[0], pixel.row + 2), right = std::min(disparity.shape[1], pixel.column + 2);
    for (Index row = std::max<Index>(0, pixel.row - 1); row < bottom; ++row)
        for (Index column = std::max<Index>(0, pixel.column - 1); column < right; ++column)
            if (!test(Pixel{row, column}, disparity(row, column))) return false;
    return true;
}

// Find the part that a pixel belongs to; of one of more than so many pixels, one more.
void find_part(Array<const float, 2> disparity, float difference, Pixel pixel, Index most, Part &part) {
    part.assign(1, pixel);
    for (std::size_t done = 0; done < part.size(); ++done) {
        const Pixel from = part[done];
        const bool fits = all_about(disparity, from, [&, d = disparity(from.row, from.column)](Pixel to, float there) {
            if (!(std::abs(there - d) > difference) && !is_among(part, to)) part.push_back(to);
            return Index(part.size()) <= most;
        });
        if (!fits) return;
    }
}

// Whether all pixels beside a part are nearer.
bool is_hole(Array<const float, 2> disparity, const Part &part) {
    return std::all_of(part.begin(), part.end(), [&](Pixel from) {
        const float d = disparity(from.row, from.column);
        return all_about(disparity, from, [&](Pixel to, float there) { return !(there < d) || is_among(part, to); });
    });
}

}  // namespace

void specks_of(Array<const float, 2> disparity, float difference, Index most_pixels, Index most_of_hole, Array<bool, 2> specks) {
    const Index most = std::max<Index>({most_pixels, most_of_hole, 1});
    parallel_for(0, disparity.shape[0], [&](Index y) {
        Part part;
        for (Index x = 0; x < disparity.shape[1]; ++x) {
            find_part(disparity, difference, {y, x}, most, part);
            const auto n = Index(part.size());
            specks(y, x) = n <= most_pixels || (n <= most_of_hole && is_hole(disparity, part));
        }
    });
}

}  // namespace sepi
