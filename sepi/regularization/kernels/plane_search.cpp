#include "plane_search.hpp"

#include <cmath>

#include "kernels/parallel.hpp"

namespace sepi {

void support_of(Array<const double, 2> positions, Array<const double, 1> values, Array<const double, 2> planes, double tolerance, double behind_penalty,
                Array<double, 1> out) {
    const double *x = positions.at(1), *y = positions.at(2), *value = values.data;
    parallel_for(0, planes.shape[0], [&](Index p) {
        const double a = planes(p, 0), b = planes(p, 1), c = planes(p, 2);
        Index agreeing = 0, behind = 0;
        for (Index i = 0; i < values.shape[0]; ++i) {
            // as residuals of single planes are rounded
            const double residual = value[i] - (a + b * x[i] + c * y[i]);
            agreeing += std::abs(residual) < tolerance;
            behind += residual < -tolerance;
        }
        out(p) = double(agreeing) - behind_penalty * double(behind);
    });
}

}  // namespace sepi
