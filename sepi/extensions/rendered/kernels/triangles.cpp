// First triangles on the rays of a view's pixels.
#include "kernels/kernel.hpp"

namespace sepi::triangles {

// Rows of rays of a turn of a thread.
constexpr Index BAND = 32;

// Margin for the rounding of corners, pixels.
constexpr double SLACK = 1e-4;

// Triangles of a turn of a thread.
constexpr Index AT_ONCE = 64;

using Vector = std::array<double, 3>;  // right, down, away

Vector cross(const Vector &a, const Vector &b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }

// Rows or columns.
struct Pixels {
    Index first = 0, last = -1;
};

// A triangle in the camera's axes, and the pixels that may meet it.
struct Triangle {
    std::array<Vector, 3> corners;
    Pixels rows, columns;

    void find_pixels(double near, const double *frame, Index size) {
        const auto [nearest, farthest] = std::minmax({corners[0][2], corners[1][2], corners[2][2]});
        if (farthest < near) return;
        // pixels whose middles lie between the corners along an axis; all if a side goes behind the camera
        const auto middles = [&](Index axis, double middle) -> Pixels {
            if (nearest < near) return {0, size - 1};
            const auto [least, most] = std::minmax({corners[0][axis] / corners[0][2], corners[1][axis] / corners[1][2], corners[2][axis] / corners[2][2]});
            const double first = frame[0] * least + middle - 0.5 - SLACK, last = frame[0] * most + middle - 0.5 + SLACK;
            return {Index(std::ceil(std::clamp(first, 0.0, double(size)))), Index(std::floor(std::clamp(last, -1.0, double(size - 1))))};
        };
        rows = middles(1, frame[1]), columns = middles(0, frame[2]);
    }

    // Draw triangle n where it is nearer than earlier ones, at the rays of the rows first..first + rows of depth.
    void meet(Index n, double near, const double *frame, const double *across, Index first, Array<double, 2> depth, Array<std::int32_t, 2> out) const {
        const Index top = std::max(rows.first, first), bottom = std::min(rows.last, first + depth.shape[0] - 1);
        if (top > bottom) return;
        const auto &[a, b, c] = corners;
        // normal of the plane through each side and the camera
        const Vector sides[] = {cross(b, c), cross(c, a), cross(a, b)};
        const double volume = a[0] * sides[0][0] + a[1] * sides[0][1] + a[2] * sides[0][2];
        for (Index row = top; row <= bottom; ++row) {
            const double y = (double(row) + 0.5 - frame[1]) / frame[0];
            double at_zero[3];
            for (Index k = 0; k < 3; ++k) at_zero[k] = sides[k][1] * y + sides[k][2];
            for (Index column = columns.first; column <= columns.last; ++column) {
                const double x = across[column];
                const double u = sides[0][0] * x + at_zero[0], v = sides[1][0] * x + at_zero[1], w = sides[2][0] * x + at_zero[2], total = u + v + w;
                const bool inside = (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
                if (!inside || total == 0) continue;
                double &nearest = depth(row - first, column);
                if (const double away = volume / total; near < away && away < nearest) nearest = away, out(row, column) = std::int32_t(n);
            }
        }
    }
};

// First of the triangles (M, 3, 3) beyond near on the ray through the middle of each pixel, into out (size, size), of
// zeros; triangle 0 means none. origin is the camera's position, rotation is from its axes (right, down, away) to the
// world, frame is its focal length in pixels and the row and column of its axis. No ray passes between triangles with a
// common side, since both compute the same number for it.
void first_met(Array<const double, 3> corners, Array<const double, 1> origin, Array<const double, 2> rotation, Array<const double, 1> frame, double near,
               Array<std::int32_t, 2> out) {
    const Index count = corners.shape[0], size = out.shape[0];
    std::vector<Triangle> triangles(count);
    parallel_for_blocks(1, count, AT_ONCE, [&](Index n) {
        for (Index k = 0; k < 3; ++k) {
            for (Index i = 0; i < 3; ++i) {
                double &total = triangles[n].corners[k][i] = 0;
                for (Index j = 0; j < 3; ++j) total += (corners(n, k, j) - origin(j)) * rotation(j, i);
            }
        }
        triangles[n].find_pixels(near, frame.data, size);
    });
    const Scratch<double, 1> across(size);
    for (Index column = 0; column < size; ++column) across.array()(column) = (double(column) + 0.5 - frame(2)) / frame(0);
    parallel_for(0, (size + BAND - 1) / BAND, [&](Index band) {
        const auto depth = Scratch<double, 2>(std::min(BAND, size - band * BAND), size).filled(INFINITE);
        for (Index n = 1; n < count; ++n) triangles[n].meet(n, near, frame.data, across.array().data, band * BAND, depth.array(), out);
    });
}

const Submodule submodule("triangles", {{"first_met", &first_met}});

}  // namespace sepi::triangles
