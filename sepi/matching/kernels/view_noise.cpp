// Noise of the views: differences of blocks of the reference view from blocks of others at whole pixels.
#include "pixels.hpp"

namespace sepi::view_noise {

// Width of a block, pixels: a vector of them.
constexpr Index BLOCK = LANES;

// Start of block i of n along an axis; blocks lie side by side from both ends.
Index begin_of(Index i, Index n, Index size) { return 2 * i < n ? i * BLOCK : size - (n - i) * BLOCK; }

// Energy of the differences between two blocks of a channel, without their mean.
float energy_of(const float *own, const float *other, Index next_row) {
    Float8 squares{}, sums{};
    for (Index k = 0; k < BLOCK; ++k) {
        const Float8 e = load(other + k * next_row) - load(own + k * next_row);
        squares += e * e;
        sums += e;
    }
    const float sum = sum_of(sums);
    return sum_of(squares) - sum * sum / float(BLOCK * BLOCK);
}

// Least mean squared difference, in squared units of the colours, of each block of view (t0, s0) from blocks of other
// views moved by whole pixels; infinite if no other view holds the block. Grey counts as three equal channels.
// moves (N, 4): row and column of a view in the grid, pixels down and across; least (H / BLOCK, W / BLOCK).
void least_differences(const Views &views, Index t0, Index s0, Array<const std::int64_t, 2> moves, Array<float, 2> least) {
    const Index H = shape_of(views)[2], W = shape_of(views)[3], C = shape_of(views)[4];
    parallel_for(0, least.shape[0], [&](Index i) {
        const Index y = begin_of(i, least.shape[0], H);
        const Scratch<float, 3> own(C, BLOCK, W), other(C, BLOCK, W);
        load_rows(views, t0, s0, y, own.array());
        float *found = least.at(i);
        std::fill_n(found, least.shape[1], INFINITE);
        for (Index n = 0; n < moves.shape[0]; ++n) {
            const Index row = y + moves(n, 2), across = moves(n, 3);
            if (row < 0 || row + BLOCK > H) continue;
            load_rows(views, moves(n, 0), moves(n, 1), row, other.array());
            for (Index j = 0; j < least.shape[1]; ++j) {
                const Index x = begin_of(j, least.shape[1], W);
                if (x + across < 0 || x + across + BLOCK > W) continue;
                float energy = 0;
                for (Index c = 0; c < C; ++c) energy += energy_of(own.array().at(c, 0, x), other.array().at(c, 0, x + across), W);
                found[j] = std::min(found[j], float(3 / C) * energy);
            }
        }
        // one degree of freedom less, for the mean, which exposure may change from view to view
        for (Index j = 0; j < least.shape[1]; ++j) found[j] /= float(3 * (BLOCK * BLOCK - 1));
    });
}

const Submodule submodule("view_noise", {{"least_differences", &least_differences}, {"BLOCK", BLOCK}});

}  // namespace sepi::view_noise
