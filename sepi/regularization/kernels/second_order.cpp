// The matrix of the global optimisation, as a stencil, the hats of its preconditioner, and the weights of second-order smoothing.
//
// Pictures have a margin of MARGIN pixels of zeros on each side, so that loops need no border cases; hats have none.
// Nodes of the finest level lie SPACING apart, from as far before the first pixel to behind the last one, so that mirrored
// pictures take mirrored steps. A coarser level has every other node; each of its hats is one of the finer level plus half
// of each neighbour. Sums add rows in order, so that all numbers of threads give the same bits. Number is float or double.
#include "kernels/kernel.hpp"

namespace sepi::second_order {

constexpr Index MARGIN = 2;   // reach of second differences, pixels
constexpr Index SPACING = 2;  // distance of nodes of the finest hats, pixels

// Some nodes along an axis of n pixels, with hats as high as height(p) at pixels p = 0..2 spacing - 1 about their node, of
// which that of the first begin so many before the first pixel. Nodes lie between two pixels, or on the earlier one.
struct Nodes {
    Index spacing, beyond, before = beyond / 2 + spacing;
    Nodes(Index number, Index apart, Index n) : spacing(apart), beyond(apart * (number - 1) - n) {}
    double height(Index p) const { return std::max(0.0, 1 - std::abs(double(2 * (p - spacing) + 1 + beyond % 2)) / double(2 * spacing)); }
};

// Entries of the stencil, which may have the first of them alone: rows and columns from one pixel to the other.
constexpr Index ENTRIES[7][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 0}, {2, 0}, {1, 1}, {1, -1}};

// Add values, times a factor, to a row.
template <class Number>
void add(Number *__restrict row, Number factor, const Number *values, Index n) {
    for (Index x = 0; x < n; ++x) row[x] += factor * values[x];
}

// Inner product of two rows, in an order that vectorises and is the same on all processors.
template <class Number>
Number dot(const Number *a, const Number *b, Index n) {
    constexpr Index PARTS = 128 / sizeof(Number);
    Number sums[PARTS] = {};
    Index x = 0;
    for (; x <= n - PARTS; x += PARTS)
        for (Index i = 0; i < PARTS; ++i) sums[i] += a[x + i] * b[x + i];
    for (Index i = 0; x + i < n; ++i) sums[i] += a[x + i] * b[x + i];
    for (Index half = PARTS / 2; half > 0; half /= 2)
        for (Index i = 0; i < half; ++i) sums[i] += sums[i + half];
    return sums[0];
}

// Sum of what turn(y) returns for n rows, added in order, whichever thread computed them.
template <class Turn>
double sum_of_rows(Index n, const Turn &turn) {
    std::vector<double> rows(n);
    parallel_for(0, n, [&](Index y) { rows[y] = double(turn(y)); });
    return std::accumulate(rows.begin(), rows.end(), 0.0);
}

// Weights of second differences in one direction; corners (n, 2) and factors (n) are the pixels of a difference, at most four.
void weights_of_differences(Array<const float, 2> disparity, Array<const float, 2> reliability, Array<const float, 2> colour,
                            Array<const std::int64_t, 2> corners, Array<const float, 1> factors, float threshold, float variance,
                            Array<float, 2> out) {
    parallel_for(0, out.shape[0], [&](Index y) {
        const float *values[4], *trusts[4], *changes = colour.at(y);
        float factor[4] = {}, *__restrict target = out.at(y);
        for (Index i = 0; i < 4; ++i) {
            // a fourth of three is the first again, without effect
            const Index n = i < factors.shape[0] ? i : 0;
            values[i] = disparity.at(y + corners(n, 0), corners(n, 1)), trusts[i] = reliability.at(y + corners(n, 0), corners(n, 1));
            factor[i] = i == n ? factors(n) / threshold : 0;
        }
        for (Index x = 0; x < out.shape[1]; ++x) {
            const float difference = factor[0] * values[0][x] + factor[1] * values[1][x] + factor[2] * values[2][x] + factor[3] * values[3][x];
            const float trust = std::min(std::min(trusts[0][x], trusts[1][x]), std::min(trusts[2][x], trusts[3][x]));
            target[x] = exp_of_negative(-std::min(difference * difference * trust + 2 * changes[x] / variance, 30.0f));
        }
    });
}

// Computes the next direction, ahead plus a share of the last one, and the matrix times it, into out; returns the inner
// product of both.
template <class Number>
double bend(Array<const Number, 3> stencil, Array<const Number, 2> ahead, Number share, Array<Number, 2> direction, Array<Number, 2> out) {
    const Index H = direction.shape[0] - 2 * MARGIN, W = direction.shape[1] - 2 * MARGIN;
    parallel_for_pixels(direction.shape[0], direction.shape[1], [&](Index y, Index x) { direction(y, x) = share * direction(y, x) + ahead(y, x); });
    return sum_of_rows(H, [&](Index row) {
        const Index y = row + MARGIN;
        const Number *own = stencil.at(0, y, MARGIN), *here = direction.at(y, MARGIN);
        Number *__restrict target = out.at(y, MARGIN);
        for (Index x = 0; x < W; ++x) target[x] = own[x] * here[x];
        for (Index k = 1; k < stencil.shape[0]; ++k) {
            // one entry and its transpose; few arrays at a time, so that the loop vectorises
            const auto [dy, dx] = ENTRIES[k];
            const Number *forth = stencil.at(k, y, MARGIN), *there = direction.at(y + dy, MARGIN + dx);
            const Number *back = stencil.at(k, y - dy, MARGIN - dx), *before = direction.at(y - dy, MARGIN - dx);
            for (Index x = 0; x < W; ++x) target[x] += forth[x] * there[x] + back[x] * before[x];
        }
        return dot(here, out.at(y, MARGIN), W);
    });
}

// Add a multiple of a direction to the solution, and subtract that of bent, the matrix times it, from the residual;
// returns the squared norm of the residual.
template <class Number>
double step(Number length, Array<const Number, 2> direction, Array<const Number, 2> bent, Array<Number, 2> solution, Array<Number, 2> residual) {
    return sum_of_rows(solution.shape[0], [&, n = solution.shape[1]](Index y) {
        Number *__restrict found = solution.at(y), *__restrict left = residual.at(y);
        const Number *ahead = direction.at(y), *taken = bent.at(y);
        for (Index x = 0; x < n; ++x) {
            found[x] += length * ahead[x];
            left[x] -= length * taken[x];
        }
        return dot(residual.at(y), residual.at(y), n);
    });
}

// Inner products of a picture with the finest hats, out (h, w).
template <class Number>
void onto_finest(Array<const Number, 2> vector, Array<Number, 2> out) {
    const Index H = vector.shape[0] - 2 * MARGIN, W = vector.shape[1] - 2 * MARGIN, w = out.shape[1];
    const Nodes down(out.shape[0], SPACING, H), across(w, SPACING, W);
    const Number h[] = {Number(across.height(0)), Number(across.height(1)), Number(across.height(2)), Number(across.height(3))};
    // with a margin of zeros as wide as the hats' reach
    parallel_for(0, out.shape[0], [&](Index i) {
        const auto lines = zeros<Number, 1>(2 * w + 2);
        Number *line = lines.array().data;
        for (Index n = 0; n < 4; ++n)
            if (const Index y = 2 * i + n - down.before; 0 <= y && y < H) add(line + across.before, Number(down.height(n)), vector.at(y + MARGIN, MARGIN), W);
        Number *__restrict target = out.at(i);
        for (Index j = 0; j < w; ++j) target[j] = h[0] * line[2 * j] + h[1] * line[2 * j + 1] + h[2] * line[2 * j + 2] + h[3] * line[2 * j + 3];
    });
}

// Inner products with hats (h, w) from those with finer hats (2 h - 1, 2 w - 1).
template <class Number>
void onto_coarser(Array<const Number, 2> fine, Array<Number, 2> out) {
    parallel_for(0, out.shape[0], [&](Index i) {
        const auto with_margin = zeros<Number, 1>(fine.shape[1] + 2);
        Number *line = with_margin.array().data + 1;
        for (const Index n : {-1, 1, 0})
            if (0 <= 2 * i + n && 2 * i + n < fine.shape[0]) add(line, Number(n ? 0.5 : 1), fine.at(2 * i + n), fine.shape[1]);
        for (Index j = 0; j < out.shape[1]; ++j) out(i, j) = line[2 * j] + (line[2 * j - 1] + line[2 * j + 1]) / 2;
    });
}

// Multiply hats (2 h - 1, 2 w - 1) by an inverse, and add coarser hats (h, w).
template <class Number>
void onto_finer(Array<const Number, 2> coarse, Array<const Number, 2> inverse, Array<Number, 2> fine) {
    parallel_for(0, fine.shape[0], [&](Index i) {
        const Number *above = coarse.at(i / 2), *below = coarse.at((i + 1) / 2), *own = inverse.at(i);
        Number *__restrict row = fine.at(i);
        for (Index j = 0; j < fine.shape[1] / 2; ++j) {
            const Number here = above[j] + below[j], next = above[j + 1] + below[j + 1];
            row[2 * j] = own[2 * j] * row[2 * j] + here / 2;
            row[2 * j + 1] = own[2 * j + 1] * row[2 * j + 1] + (here + next) / 4;
        }
        // the last of an odd number
        if (const Index j = fine.shape[1] - 1; j % 2 == 0) row[j] = own[j] * row[j] + (above[j / 2] + below[j / 2]) / 2;
    });
}

// Computes inverse * vector plus the finest hats, into out; returns the inner product of vector and out.
template <class Number>
double diagonal_and_finest(Array<const Number, 2> inverse, Array<const Number, 2> vector, Array<const Number, 2> fine, Array<Number, 2> out) {
    const Index H = vector.shape[0] - 2 * MARGIN, W = vector.shape[1] - 2 * MARGIN, w = fine.shape[1];
    const Nodes down(fine.shape[0], SPACING, H), across(w, SPACING, W);
    const Number h[] = {Number(across.height(0)), Number(across.height(1)), Number(across.height(2)), Number(across.height(3))};
    return sum_of_rows(H, [&](Index y) {
        const Scratch<Number, 1> lines(w), all_hats(2 * w);
        Number *__restrict line = lines.array().data, *__restrict hats = all_hats.array().data;
        const Index i = (y + down.before) / 2, odd = (y + down.before) % 2;
        const Number first = Number(down.height(2 + odd)), second = Number(down.height(odd)), *above = fine.at(i - 1), *below = fine.at(i);
        for (Index j = 0; j < w; ++j) line[j] = first * above[j] + second * below[j];
        for (Index j = 0; j < w - 1; ++j) {
            hats[2 * j] = h[2] * line[j] + h[0] * line[j + 1];
            hats[2 * j + 1] = h[3] * line[j] + h[1] * line[j + 1];
        }
        const Number *row = vector.at(y + MARGIN, MARGIN), *own = inverse.at(y + MARGIN, MARGIN);
        Number *__restrict target = out.at(y + MARGIN, MARGIN);
        for (Index x = 0; x < W; ++x) target[x] = own[x] * row[x] + hats[across.before - SPACING + x];
        return dot<Number>(row, target, W);
    });
}

// Diagonal of the matrix in hats with this spacing, out (h, w).
template <class Number>
void diagonal_of_hats(Array<const Number, 3> stencil, Index spacing, Array<Number, 2> out) {
    const Index H = stencil.shape[1] - 2 * MARGIN, W = stencil.shape[2] - 2 * MARGIN, w = out.shape[1], reach = 2 * spacing;
    const Nodes down(out.shape[0], spacing, H), across(w, spacing, W);
    parallel_for(0, out.shape[0], [&](Index i) {
        const Scratch<Number, 1> lines(spacing * (w + 1));
        Number *line = lines.array().data, *__restrict target = out.at(i);
        std::fill_n(target, w, Number(0));
        for (Index k = 0; k < stencil.shape[0]; ++k) {
            const auto [dy, dx] = ENTRIES[k];
            std::fill_n(line, spacing * (w + 1), Number(0));
            for (Index p = 0; p < reach; ++p) {
                const Index y = spacing * i + p - down.before;
                const auto share = Number(down.height(p) * down.height(p + dy));
                if (0 <= y && y < H && share > 0) add(line + across.before, share, stencil.at(k, y + MARGIN, MARGIN), W);
            }
            for (Index p = 0; p < reach; ++p) {
                // each entry from either of its pixels
                const auto share = Number((k == 0 ? 1 : 2) * across.height(p) * across.height(p + dx));
                if (share > 0)
                    for (Index j = 0; j < w; ++j) target[j] += share * line[spacing * j + p];
            }
        }
    });
}

const Submodule submodule("second_order", {
    {"MARGIN", MARGIN},
    {"SPACING", SPACING},
    {"weights_of_differences", &weights_of_differences},
    {"bend", &bend<float>, &bend<double>},
    {"step", &step<float>, &step<double>},
    {"diagonal_of_hats", &diagonal_of_hats<float>, &diagonal_of_hats<double>},
    {"onto_finest", &onto_finest<float>, &onto_finest<double>},
    {"onto_coarser", &onto_coarser<float>, &onto_coarser<double>},
    {"onto_finer", &onto_finer<float>, &onto_finer<double>},
    {"diagonal_and_finest", &diagonal_and_finest<float>, &diagonal_and_finest<double>},
});

}  // namespace sepi::second_order
