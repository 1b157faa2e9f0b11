#include "planes.hpp"

#include "kernels/parallel.hpp"

namespace sepi {

void add_normal_equations(Array<const std::int64_t, 1> labels, Array<const double, 2> design, Array<const float, 1> weight, Array<const float, 1> disparity,
                          Array<double, 3> left, Array<double, 2> right) {
    for (Index i = 0; i < labels.shape[0]; ++i) {
        const double w = weight(i), d = disparity(i), *own = design.at(i);
        double *matrix = left.at(labels(i)), *side = right.at(labels(i));
        for (Index p = 0; p < 3; ++p) {
            const double weighted = own[p] * w;
            side[p] += weighted * d;
            for (Index q = p; q < 3; ++q) matrix[3 * p + q] += weighted * own[q];
        }
    }
    for (Index label = 0; label < right.shape[0]; ++label)
        for (Index p = 0; p < 3; ++p)
            for (Index q = 0; q < p; ++q) left(label, p, q) = left(label, q, p);
}

void values_of_planes(Array<const std::int64_t, 1> labels, Array<const double, 2> design, Array<const double, 2> planes, Array<float, 1> out) {
    constexpr Index TOGETHER = 4096;
    const Index n = labels.shape[0];
    parallel_for(0, (n + TOGETHER - 1) / TOGETHER, [&](Index block) {
        for (Index i = block * TOGETHER; i < std::min(n, (block + 1) * TOGETHER); ++i) {
            const double *own = design.at(i), *plane = planes.at(labels(i));
            out(i) = float(own[0] * plane[0] + own[1] * plane[1] + own[2] * plane[2]);
        }
    });
}

}  // namespace sepi
