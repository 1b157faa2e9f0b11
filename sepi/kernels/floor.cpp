// The operations of the plane sweep on a few numbers in the first cache, to measure their time alone.
#include "kernels/kernel.hpp"

namespace sepi::floor {

// A thread adds the results for seven vectors and a weight that changes, as it does from candidate to candidate.
template <class One>
void add_passes(Index passes, Array<const float, 3> data, Array<float, 2> out, const One &one) {
    parallel_for(0, out.shape[0], [=](Index thread) {
        const Index N = out.shape[1];
        const float *given = data.at(thread);
        float *sums = out.at(thread);
        for (Index n = 0; n < passes; ++n) {
            const Float8 weight = spread(1e-6f * float(n));
            for (Index x = 0; x < N; x += LANES) {
                Float8 values[7];
                for (Index k = 0; k < 7; ++k) values[k] = load(given + k * N + x);
                store(sums + x, one(weight, values, load(sums + x)));
            }
        }
    });
}

// Samples, polynomials of their distance, and their robust residuals: so many passes over data (threads, 7, N), added to
// out (threads, N). N is a multiple of LANES.
void samples(Index passes, Array<const float, 3> data, Array<float, 2> out) {
    add_passes(passes, data, out, [](Float8 distance, const Float8 *values, Float8 total) {
        Float8 z = values[4];
        for (int power = 3; power >= 0; --power) z = fma(distance, z, values[power]);
        z = larger(z, Float8{});
        return total + z / (z + spread(0.01f));
    });
}

// Rows of a window, seven multiply-adds each.
void windows(Index passes, Array<const float, 3> data, Array<float, 2> out) {
    add_passes(passes, data, out, [](Float8 weight, const Float8 *values, Float8 total) {
        for (int k = 0; k < 7; ++k) total = fma(weight + spread(0.01f * float(k)), values[k], total);
        return total;
    });
}

const Submodule submodule("floor", {{"samples", &samples}, {"windows", &windows}});

}  // namespace sepi::floor
