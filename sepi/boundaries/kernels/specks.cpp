// Specks of a map.
#include "kernels/kernel.hpp"

namespace sepi::specks {

// Pixels of small parts of a map (H, W): of at most most_pixels, or most_of_hole with only nearer pixels around. A part
// consists of eight-connected pixels that differ by at most difference.
void specks_of(Array<const float, 2> disparity, float difference, Index most_pixels, Index most_of_hole, Array<bool, 2> specks) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const float *d = disparity.data;
    // union-find: parent of each pixel in its part; the root is its own
    std::vector<std::int32_t> another(H * W);
    std::iota(another.begin(), another.end(), 0);
    const auto part_of = [&](std::int32_t pixel) {
        while (another[pixel] != pixel) pixel = another[pixel] = another[another[pixel]];
        return pixel;
    };
    const auto for_neighbours = [&](const auto &body) {
        constexpr std::array<std::array<Index, 2>, 4> BEFORE{{{-1, -1}, {-1, 0}, {-1, 1}, {0, -1}}};
        for (Index y = 0; y < H; ++y)
            for (Index x = 0; x < W; ++x)
                for (const auto [down, across] : BEFORE)
                    if (y + down >= 0 && x + across >= 0 && x + across < W) body(y * W + x, (y + down) * W + x + across);
    };
    for_neighbours([&](Index one, Index other) {
        if (!(std::abs(d[one] - d[other]) > difference)) another[part_of(one)] = part_of(other);
    });
    std::vector<std::int32_t> pixels(H * W);
    std::vector<bool> beside_farther(H * W);
    for (Index i = 0; i < H * W; ++i) ++pixels[part_of(i)];
    for_neighbours([&](Index one, Index other) {
        if (d[one] != d[other] && part_of(one) != part_of(other)) beside_farther[part_of(d[one] > d[other] ? one : other)] = true;
    });
    for (Index i = 0; i < H * W; ++i) {
        const std::int32_t part = part_of(i);
        specks.data[i] = pixels[part] <= most_pixels || (pixels[part] <= most_of_hole && !beside_farther[part]);
    }
}

const Submodule submodule("specks", {{"specks_of", &specks_of}});

}  // namespace sepi::specks
