#include "view_noise.hpp"

#include <limits>

#include "kernels/parallel.hpp"
#include "pixels.hpp"

namespace sepi {
namespace {

static_assert(BLOCK == LANES);

// The channels of rows y.. of a view (H, W, 3) into out (1 or 3, BLOCK, W): of grey views they are the same.
template <class Colour>
void load_rows(Array<const Colour, 3> view, Index y, Array<float, 3> out) {
    view.shape[2] = out.shape[0];
    for (Index k = 0; k < BLOCK; ++k)
        split_channels(view[y + k], {out.at(0, k), {out.shape[0], out.shape[2]}, {out.strides[0], 1}}, [](auto colour) { return colour; });
}

float in_order(Float8 lanes) {
    float sum = 0;
    for (int i = 0; i < LANES; ++i) sum += lanes[i];
    return sum;
}

// Energy of the differences between a block of one channel and another, without their mean.
float energy_of(const float *own, const float *other, Index next_row) {
    Float8 squares{}, sums{};
    for (Index k = 0; k < BLOCK; ++k) {
        const Float8 e = load(other + k * next_row) - load(own + k * next_row);
        squares += e * e;
        sums += e;
    }
    const float sum = in_order(sums);
    return in_order(squares) - sum * sum / float(BLOCK * BLOCK);
}

}  // namespace

template <class Colour>
void least_differences(Strided<const Colour, 5> colours, Index t0, Index s0, Array<const std::int64_t, 2> moves, Array<float, 2> least) {
    const Index H = colours.shape[2], W = colours.shape[3], channels = colours.strides[4] == 0 ? 1 : 3;
    parallel_for(0, least.shape[0], [&](Index i) {
        const Index y = i * BLOCK, columns = least.shape[1];
        const Scratch<float, 3> own_rows(channels, BLOCK, W), other_rows(channels, BLOCK, W);
        const auto own = own_rows.array(), other = other_rows.array();
        load_rows(colours[t0][s0], y, own);
        float *found = least.at(i);
        std::fill_n(found, columns, std::numeric_limits<float>::infinity());
        for (Index n = 0; n < moves.shape[0]; ++n) {
            const Index row = y + moves(n, 2), across = moves(n, 3);
            if (row < 0 || row + BLOCK > H) continue;
            load_rows(colours[moves(n, 0)][moves(n, 1)], row, other);
            for (Index j = 0; j < columns; ++j) {
                const Index x = j * BLOCK;
                if (x + across < 0 || x + across + BLOCK > W) continue;
                const auto energy = [&](Index c) { return energy_of(own.at(c, 0, x), other.at(c, 0, x + across), W); };
                const float first = energy(0);
                found[j] = std::min(found[j], channels == 1 ? first + first + first : first + energy(1) + energy(2));
            }
        }
        // less one degree of freedom: the mean, which exposure may change from view to view
        for (Index j = 0; j < columns; ++j) found[j] /= float(3 * (BLOCK * BLOCK - 1));
    });
}

#define INSTANTIATE(Colour) template void least_differences(Strided<const Colour, 5>, Index, Index, Array<const std::int64_t, 2>, Array<float, 2>);
INSTANTIATE(std::uint8_t)
INSTANTIATE(std::uint16_t)
INSTANTIATE(float)
#undef INSTANTIATE

}  // namespace sepi
