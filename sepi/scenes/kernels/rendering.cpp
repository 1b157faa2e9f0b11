// Exact rendering of the built-in scenes: planar surfaces, and their intersections with rays.
#include "kernels/kernel.hpp"

namespace sepi::rendering {

// Texels after each row of a texture, its periodic continuation for a sample's reach.
constexpr Index BEYOND = 3;

// Surfaces in a view: the fields of sepi.scenes.rendering.Drawing, in their order.
struct Drawing {
    Array<const double, 2> edges;                    // (E, 4): x0, y0, x1, y1
    Array<const std::int64_t, 1> first_edge;         // (P + 1)
    Array<const double, 2> planes;                   // (P, 3): disparity at 0, along x, along y
    Array<const float, 2> texels;                    // (N, 4)
    Array<const std::int64_t, 1> first_texel, side;  // (P)

    bool fields(auto visit) { return visit(edges, first_edge, planes, texels, first_texel, side); }
};

// Margin by which an occluder must be nearer, for the rounding at edges between two faces.
constexpr double TOLERANCE = 1e-9;

// Rays of a turn of a thread.
constexpr Index RAYS_AT_ONCE = 256;

// Whether an edge crosses a row, and where; an outline crosses it an even number of times.
bool crosses(const double *edge, double y) { return (edge[1] <= y) != (edge[3] <= y); }

double crossing(const double *edge, double y) { return edge[0] + (y - edge[1]) * (edge[2] - edge[0]) / (edge[3] - edge[1]); }

// Even-odd rule: whether a ray to the right crosses the outline of a surface an odd number of times.
bool covers(const Drawing &drawing, Array<const double, 2> boxes, Index p, double x, double y) {
    const double *box = boxes.at(p);
    if (!(box[0] <= x && x <= box[2] && box[1] <= y && y <= box[3])) return false;
    bool odd = false;
    for (Index e = drawing.first_edge(p); e < drawing.first_edge(p + 1); ++e)
        if (const double *edge = drawing.edges.at(e); crosses(edge, y) && crossing(edge, y) > x) odd = !odd;
    return odd;
}

// Centre of a sample along a line, in pixels.
double place_of(Index i, Index samples) { return (double(i) + 0.5) / double(samples) - 0.5; }

// Nearest disparity and its surface at the samples of one row at height y. Even-odd rule; intervals are closed on the left
// and open on the right, so that neighbours leave no gap.
void fill_row(const Drawing &drawing, double y, Index samples, Index width, double *__restrict depth, std::int64_t *__restrict owner) {
    std::vector<double> crossings;
    std::fill_n(depth, width, -INFINITE);
    std::fill_n(owner, width, -1);
    const auto sample = [&](double x) { return Index(std::ceil((x + 0.5) * double(samples) - 0.5)); };
    for (Index p = 0; p < drawing.planes.shape[0]; ++p) {
        crossings.clear();
        for (Index e = drawing.first_edge(p); e < drawing.first_edge(p + 1); ++e)
            if (const double *edge = drawing.edges.at(e); crosses(edge, y)) crossings.push_back(crossing(edge, y));
        std::sort(crossings.begin(), crossings.end());
        const double at_zero = drawing.planes(p, 0) + drawing.planes(p, 2) * y, slope = drawing.planes(p, 1);
        for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) {
            const Index first = std::max<Index>(0, sample(std::max(crossings[i], -1.0)));
            const Index last = std::min(width, sample(std::min(crossings[i + 1], double(width))));
            for (Index column = first; column < last; ++column) {
                const double d = at_zero + slope * place_of(column, samples);
                const bool nearer = d > depth[column];
                depth[column] = nearer ? d : depth[column];
                owner[column] = nearer ? p : owner[column];
            }
        }
    }
}

// The first of four texels, and their cubic B-spline weights.
struct Spline {
    Index first;
    float weights[4];

    explicit Spline(double position) {
        const double base = std::floor(position);
        const float f = float(position - base), g = 1 - f, sixth = float(1.0 / 6), most = float(2.0 / 3);
        first = Index(base) - 1;
        weights[0] = g * g * g * sixth;
        weights[1] = most - 0.5f * f * f * (1 + g);
        weights[2] = most - 0.5f * g * g * (1 + f);
        weights[3] = f * f * f * sixth;
    }
};

// Two numbers, four times each.
Float8 halves(float low, float high) { return __builtin_shufflevector(spread(low), spread(high), 0, 1, 2, 3, 12, 13, 14, 15); }

// Add a sample of a surface's periodic texture to a vector; its colours are the sum of both halves.
Float8 add_sample(const Drawing &drawing, Index p, double x, double y, Float8 total) {
    const Spline across(x), down(y);
    const Index side = drawing.side(p), column = ((across.first % side) + side) % side;
    Index row = ((down.first % side) + side) % side;
    // two texels at once, each of four numbers
    Float8 left{}, right{};
    for (const float weight : down.weights) {
        const float *here = drawing.texels.at(drawing.first_texel(p) + row * (side + BEYOND) + column);
        left = fma(spread(weight), load(here), left);
        right = fma(spread(weight), load(here + LANES), right);
        row = row + 1 < side ? row + 1 : 0;
    }
    total = fma(halves(across.weights[0], across.weights[1]), left, total);
    return fma(halves(across.weights[2], across.weights[3]), right, total);
}

float colour_of(Float8 total, Index channel) { return total[channel] + total[4 + channel]; }

// Disparity and index of the nearest surface at the centre of each pixel, (H, W); -1 for none.
void nearest(const Drawing &drawing, Array<double, 2> disparity, Array<std::int64_t, 2> owner) {
    parallel_for(0, disparity.shape[0], [&](Index row) { fill_row(drawing, double(row), 1, disparity.shape[1], disparity.at(row), owner.at(row)); });
}

// Mean of the textures under all samples of each pixel in the view of baseline (v, u); picture (size, size, 3).
void shade(const Drawing &drawing, double v, double u, Index samples, Array<float, 3> picture) {
    const Index size = picture.shape[0], width = size * samples;
    parallel_for(0, size, [&](Index line) {
        const Scratch<double, 1> depth(width);
        const Scratch<std::int64_t, 1> owner(width);
        std::fill_n(picture.at(line), 3 * size, 0.0f);
        for (Index row = line * samples; row < (line + 1) * samples; ++row) {
            const double y = place_of(row, samples);
            fill_row(drawing, y, samples, width, depth.array().data, owner.array().data);
            for (Index pixel = 0; pixel < size; ++pixel) {
                Float8 total{};
                for (Index column = pixel * samples; column < (pixel + 1) * samples; ++column) {
                    const double d = depth.array()(column);
                    if (const Index p = owner.array()(column); p >= 0) total = add_sample(drawing, p, place_of(column, samples) + u * d, y + v * d, total);
                }
                for (Index c = 0; c < 3; ++c) picture(line, pixel, c) += colour_of(total, c);
            }
        }
        for (Index i = 0; i < 3 * size; ++i) picture.at(line)[i] /= float(samples * samples);
    });
}

// Mark the pixels (H, W) whose point is hidden in the view of baseline (v, u), given the view's surfaces and boxes (P, 4)
// round them.
void hide(const Drawing &drawing, Array<const double, 2> boxes, Array<const double, 2> disparity, double v, double u, Array<bool, 2> hidden) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    parallel_for_pixels(H, W, [&](Index row, Index column) {
        const double d = disparity(row, column), x = double(column) - u * d, y = double(row) - v * d;
        if (!(-0.5 <= x && x < double(W) - 0.5 && -0.5 <= y && y < double(H) - 0.5)) return;
        for (Index p = 0; p < drawing.planes.shape[0] && !hidden(row, column); ++p) {
            const double *plane = drawing.planes.at(p);
            hidden(row, column) = plane[0] + plane[1] * x + plane[2] * y > d + TOLERANCE && covers(drawing, boxes, p, x, y);
        }
    });
}

// First intersections of rays (N, 3) from origin (3): depths (N) in lengths of the ray, infinite for none, and colours
// (N, 3) of the textures there, black for none. Surface p is the plane on which normals (P, 3) times a point are 1; edges
// and boxes are in pixels of the view from the world's origin, whose (focal length, x, y) are pinhole.
void cast(const Drawing &drawing, Array<const double, 2> boxes, Array<const double, 2> normals, Array<const double, 1> origin, Array<const double, 2> rays,
          Array<const double, 1> pinhole, Array<double, 1> depth, Array<double, 2> colours) {
    const auto product = [](const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
    parallel_for_blocks(0, rays.shape[0], RAYS_AT_ONCE, [&](Index i) {
        const double *ray = rays.at(i);
        depth(i) = INFINITE;
        Float8 colour{};
        for (Index p = 0; p < normals.shape[0]; ++p) {
            const double along = product(normals.at(p), ray), away = 1 - product(normals.at(p), origin.data);
            if (along * away <= 0) continue;
            const double t = away / along, z = origin(2) + t * ray[2];
            if (t >= depth(i) - TOLERANCE * t || z <= 0) continue;
            const double x = pinhole(1) + pinhole(0) * (origin(0) + t * ray[0]) / z, y = pinhole(2) + pinhole(0) * (origin(1) + t * ray[1]) / z;
            if (!covers(drawing, boxes, p, x, y)) continue;
            depth(i) = t;
            colour = add_sample(drawing, p, x, y, Float8{});
        }
        for (Index c = 0; c < 3; ++c) colours(i, c) = double(colour_of(colour, c));
    });
}

const Submodule submodule("rendering", {
    {"BEYOND", BEYOND},
    {"nearest", &nearest},
    {"shade", &shade},
    {"hide", &hide},
    {"cast", &cast},
});

}  // namespace sepi::rendering
