// Planes of superpixels, and of the borders of regions. labels (H W): superpixel of each pixel; design (H W, 3):
// coefficient of each plane parameter there.
#include "kernels/kernel.hpp"

namespace sepi::planes {

// Weighted least squares of each superpixel's data, in the order of the pixels, added to left (N, 3, 3) and
// right (N, 3) of zeros; weight and disparity (H W).
void add_normal_equations(Array<const std::int64_t, 1> labels, Array<const double, 2> design, Array<const float, 1> weight,
                          Array<const float, 1> disparity, Array<double, 3> left, Array<double, 2> right) {
    for (Index i = 0; i < labels.shape[0]; ++i) {
        const double w = weight(i), d = disparity(i), *own = design.at(i);
        double *matrix = left.at(labels(i)), *side = right.at(labels(i));
        for (Index p = 0; p < 3; ++p) {
            side[p] += own[p] * w * d;
            // exactly symmetric
            for (Index q = 0; q < 3; ++q) matrix[3 * p + q] += own[std::min(p, q)] * w * own[std::max(p, q)];
        }
    }
}

// Disparity of every pixel on its superpixel's plane, out (H W); planes (N, 3).
void values_of_planes(Array<const std::int64_t, 1> labels, Array<const double, 2> design, Array<const double, 2> planes, Array<float, 1> out) {
    parallel_for_blocks(0, labels.shape[0], 4096, [&](Index i) {
        const double *own = design.at(i), *plane = planes.at(labels(i));
        out(i) = float(own[0] * plane[0] + own[1] * plane[1] + own[2] * plane[2]);
    });
}

// Number of inliers of each of planes (P, 3), minus behind_penalty for each pixel behind it, out (P);
// positions (3, N) are 1, x and y of pixels, values (N) their disparities.
void support_of(Array<const double, 2> positions, Array<const double, 1> values, Array<const double, 2> planes, double tolerance,
                double behind_penalty, Array<double, 1> out) {
    const double *x = positions.at(1), *y = positions.at(2), *value = values.data;
    parallel_for(0, planes.shape[0], [&](Index p) {
        const double a = planes(p, 0), b = planes(p, 1), c = planes(p, 2);
        Index agreeing = 0, behind = 0;
        for (Index i = 0; i < values.shape[0]; ++i) {
            // with the rounding of a single plane's residuals
            const double residual = value[i] - (a + b * x[i] + c * y[i]);
            agreeing += std::abs(residual) < tolerance;
            behind += residual < -tolerance;
        }
        out(p) = double(agreeing) - behind_penalty * double(behind);
    });
}

const Submodule submodule("planes", {
    {"support_of", &support_of},
    {"add_normal_equations", &add_normal_equations},
    {"values_of_planes", &values_of_planes},
});

}  // namespace sepi::planes
