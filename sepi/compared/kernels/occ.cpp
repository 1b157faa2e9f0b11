#include "occ.hpp"

#include <array>
#include <limits>

#include "angular_patches.hpp"
#include "kernels/parallel.hpp"

namespace sepi {
namespace {

struct Half {
    float variance, defocus;
    std::array<float, 3> mean;  // from the reference's colour
};

Half half_of(Array<const float, 4> sheared, Array<const float, 3> reference, Index y, Index x, const bool *chosen) {
    Half half{};
    float squares = 0;
    Index count = 0;
    for (Index n = 0; n < sheared.shape[0]; ++n) {
        if (!chosen[n]) continue;
        ++count;
        for (Index c = 0; c < 3; ++c) {
            const float difference = sheared(n, c, y, x) - reference(c, y, x);
            half.mean[c] += difference;
            squares += difference * difference;
        }
    }
    for (float &mean : half.mean) {
        mean /= float(count);
        half.defocus += mean * mean;
    }
    half.variance = std::max(0.0f, squares - float(count) * half.defocus) / float(std::max<Index>(1, count - 1)) / 3.0f;
    half.defocus /= 3.0f;
    return half;
}

}  // namespace

void whole_patch_costs(Array<const float, 4> sheared, Array<const float, 3> reference, Array<float, 2> out) {
    const Index N = sheared.shape[0], W = sheared.shape[3];
    const float third = float(1.0 / 3), count = float(N), freedom = float(std::max<Index>(1, N - 1));
    parallel_for(0, sheared.shape[2], [&](Index y) {
        const auto rows = zeros<float, 2>(4, W);
        float *red = rows.array().at(0), *green = rows.array().at(1), *blue = rows.array().at(2), *squares = rows.array().at(3);
        // counted from the reference's colour, so that the squares keep their digits
        for_differences(sheared, reference, -1, y, [=](Index, Index x, float r, float g, float b) {
            red[x] += r, green[x] += g, blue[x] += b;
            squares[x] = squares[x] + r * r + g * g + b * b;
        });
        for (Index x = 0; x < W; ++x) {
            const float r = red[x] / count, g = green[x] / count, b = blue[x] / count, defocus = r * r + g * g + b * b;
            out(y, x) = (std::max(0.0f, squares[x] - count * defocus) / freedom + defocus) * third;
        }
    });
}

void split_patch_costs(Array<const float, 4> sheared, Array<const float, 3> reference, Strided<const std::int64_t, 2> places, Array<const bool, 3> halves,
                       Array<const float, 3> beside, float tolerance, Array<float, 1> costs, Array<float, 2> cues) {
    parallel_for(0, places.shape[0], [&](Index p) {
        const Index y = places(p, 0), x = places(p, 1), orientation = places(p, 2);
        const Half first = half_of(sheared, reference, y, x, halves.at(orientation, 0)), second = half_of(sheared, reference, y, x, halves.at(orientation, 1));
        const float *one_side = beside.at(p, 0), *other_side = beside.at(p, 1);
        float as_they_are = 0, changed = 0, apart = 0;
        for (Index c = 0; c < 3; ++c) {
            const float a = reference(c, y, x) + first.mean[c], b = reference(c, y, x) + second.mean[c];
            as_they_are += std::abs(a - one_side[c]) + std::abs(b - other_side[c]);
            changed += std::abs(b - one_side[c]) + std::abs(a - other_side[c]);
            apart += std::abs(a - b);
        }
        const Half &better = first.variance <= second.variance ? first : second;
        costs(p) = as_they_are <= changed + 3.0f * tolerance ? better.variance + better.defocus : std::numeric_limits<float>::infinity();
        cues(p, 0) = first.variance, cues(p, 1) = second.variance, cues(p, 2) = apart / 3.0f;
    });
}

}  // namespace sepi
