// The spinning parallelogram operator: histograms of both sides of a line.
//
// An EPI is processed column by column. A ring keeps the histograms of the columns in reach, so that each column is
// counted once for all parallelograms that contain it.
#include "kernels/kernel.hpp"

namespace sepi::spo {

// The lower of the two bins of a colour, numbered over all channels, and the weight of the upper one.
struct Entry {
    std::int32_t bin;
    float share;
};

// Entries of one EPI (W, N C).
Scratch<Entry, 2> quantised(Array<const float, 4> lines, Index y, Index bins) {
    const Index N = lines.shape[0], C = lines.shape[1], W = lines.shape[3];
    Scratch<Entry, 2> found(W, N * C);
    for (Index n = 0; n < N; ++n) {
        for (Index c = 0; c < C; ++c) {
            const float *row = lines.at(n, c, y);
            for (Index x = 0; x < W; ++x) {
                const float place = std::clamp(row[x] * float(bins) - 0.5f, 0.0f, float(bins - 1));
                const std::int32_t lower = std::min(std::int32_t(place), std::int32_t(bins - 2));
                found.array()(x, n * C + c) = {std::int32_t(c * bins) + lower, place - float(lower)};
            }
        }
    }
    return found;
}

// Histogram of column x of an EPI, in place of that of an earlier column.
void count(Array<Entry, 2> epi, Index x, Index earlier, float *__restrict histogram) {
    for (Index i = 0; i < epi.shape[1]; ++i) histogram[epi(earlier, i).bin] = histogram[epi(earlier, i).bin + 1] = 0;
    for (Index i = 0; i < epi.shape[1]; ++i) {
        const auto [bin, share] = epi(x, i);
        histogram[bin] += 1 - share;
        histogram[bin + 1] += share;
    }
}

// Histograms of both sides of a column.
void halves(Array<const float, 2> ring, Index centre, Array<const float, 1> shares, float *__restrict left, float *__restrict right) {
    const Index size = ring.shape[0], bins = ring.shape[1];
    std::fill_n(left, bins, 0.0f);
    std::fill_n(right, bins, 0.0f);
    for (Index k = 0; k < shares.shape[0]; ++k) {
        const float *before = ring.at((centre + size - 1 - k) % size), *after = ring.at((centre + 1 + k) % size), share = shares(k);
        for (Index b = 0; b < bins; ++b) left[b] += share * before[b], right[b] += share * after[b];
    }
}

// Sum over the bins of all C channels of g h / (g + h); what left held is lost.
float common(float *__restrict left, const float *right, Index C, Index bins) {
    for (Index b = 0; b < C * bins; ++b) left[b] = left[b] * right[b] / (left[b] + right[b] + 1e-20f);
    // over the channels first, since a sum over bins is a chain of additions that cannot run side by side
    for (Index c = 1; c < C; ++c)
        for (Index b = 0; b < bins; ++b) left[b] += left[c * bins + b];
    float even = 0, odd = 0;
    for (Index b = 0; b < bins - 1; b += 2) even += left[b], odd += left[b + 1];
    if (bins % 2) even += left[bins - 1];
    return even + odd;
}

// Distance between the halves of a parallelogram round every pixel: chi-square distance of their two histograms, each of
// sum 1, mean over the channels; out (H, W), 0..1.
// lines (N, C, H, W): EPIs sheared by a candidate, so that its lines are columns; row y of view n is row n of EPI y.
// Colours in 0..1, each of which counts for the two of so many bins between whose middles it lies; what lies beyond the
// middle of the first or last bin counts for that. Columns beyond the ends are like the last ones.
// shares (R): weights of a view's column at distances 1..R from the line; those of all views add up to 1.
void half_distances(Array<const float, 4> lines, Array<const float, 1> shares, Index bins, Array<float, 2> out) {
    const Index C = lines.shape[1], W = lines.shape[3], R = shares.shape[0], size = 2 * R + 1;
    parallel_for(0, lines.shape[2], [&](Index y) {
        const auto epi = quantised(lines, y, bins);
        const auto ring = zeros<float, 2>(size, C * bins);
        const Scratch<float, 2> sides(2, C * bins);
        float *left = sides.array().at(0), *right = sides.array().at(1);
        for (Index x = -R; x < W + R; ++x) {
            count(epi.array(), clamped(x, W), clamped(x - size, W), ring.array().at((x + size) % size));
            const Index centre = x - R;
            if (centre < 0) continue;
            halves(ring.array(), centre, shares, left, right);
            // with sums of 1, half the sum of (g - h)^2 / (g + h) is 1 less twice that of g h / (g + h)
            out(y, centre) = std::max(1 - 2 * common(left, right, C, bins) / float(C), 0.0f);
        }
    });
}

const Submodule submodule("spo", {{"half_distances", &half_distances}});

}  // namespace sepi::spo
