#include "all_views.hpp"

#include <cmath>

#include "kernels/parallel.hpp"

namespace sepi {
namespace {

constexpr double TOUCHING = -1e-3;  // part of a triangle by which a pixel may miss it: no cracks between neighbours
constexpr double EDGE_ON = 1e-3;    // part of its area in its own view below which a triangle is seen from its edge, or from behind
constexpr float FARTHER = 1e9f;     // than anything is near

// From the middle of a pixel to its corners, clockwise from the top left.
constexpr struct {
    double down, across;
} CORNERS[] = {{-0.5, -0.5}, {-0.5, 0.5}, {0.5, 0.5}, {0.5, -0.5}};

// Slope at pixel i of n, by the neighbour that is nearer in disparity: the other may be across a step.
float slope(const float *here, Index stride, Index i, Index n) {
    const float back = i > 0 ? here[0] - here[-stride] : 0, ahead = i < n - 1 ? here[stride] - here[0] : 0;
    if (i == 0 || i == n - 1) return i == 0 ? ahead : back;
    return std::abs(back) <= std::abs(ahead) ? back : ahead;
}

struct Point {
    double y, x, disparity;
};

// Draw a triangle of a pixel, clockwise in its own view, into a view's maps.
void draw_triangle(Point a, Point b, Point c, double most_area, std::int32_t pixel, Array<float, 2> nearest, Array<std::int32_t, 2> origin) {
    const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (!(0.5 * EDGE_ON < area && area <= most_area)) return;
    const auto first_of = [](double p, double q, double r) { return std::max(0.0, std::ceil(std::min({p, q, r}) - 1e-3)); };
    const auto last_of = [](double p, double q, double r, Index n) { return std::min(double(n - 1), std::floor(std::max({p, q, r}) + 1e-3)); };
    const double left = first_of(a.x, b.x, c.x), right = last_of(a.x, b.x, c.x, nearest.shape[1]), bottom = last_of(a.y, b.y, c.y, nearest.shape[0]);
    // mostly one pixel, or none
    for (double y = first_of(a.y, b.y, c.y); y <= bottom; ++y) {
        for (double x = left; x <= right; ++x) {
            const double of_b = ((x - a.x) * (c.y - a.y) - (y - a.y) * (c.x - a.x)) / area;
            const double of_c = ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) / area;
            if (of_b < TOUCHING || of_c < TOUCHING || of_b + of_c > 1 - TOUCHING) continue;
            const float d = float(a.disparity + of_b * (b.disparity - a.disparity) + of_c * (c.disparity - a.disparity));
            float &shown = nearest(Index(y), Index(x));
            if (d > shown) shown = d, origin(Index(y), Index(x)) = pixel;
        }
    }
}

// Whether a map shows only what is behind a surface of disparity d at a position where it would show it.
bool is_open(Array<const float, 2> disparity, double y, double x, float d, float tolerance) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    if (y < 0 || x < 0 || y > H - 1 || x > W - 1) return false;
    for (Index row = Index(y); row < std::min(Index(y) + 2, H); ++row)
        for (Index column = Index(x); column < std::min(Index(x) + 2, W); ++column)
            if (disparity(row, column) >= d - tolerance) return false;
    return true;
}

// One map of a view, out of all that are carried to it.
class Fusion {
  public:
    Fusion(const Sources &sources, const Rules &rules, double v, double u) : sources_(sources), rules_(rules), v_(v), u_(u) {
        for (Index n = 0; n < N_; ++n) {
            const double down = v - sources.baselines(n, 0), across = u - sources.baselines(n, 1);
            closeness_.array()(n) = float(1 / (1 + std::hypot(down, across)));
            carry(sources.disparity[n], sources.corners[n], down, across, rules.most_stretched, nearest_[n], origin_[n]);
        }
    }

    // EMPTY where none shows anything.
    void fuse(Array<float, 2> disparity, Array<float, 2> confidence, Array<float, 3> bars) const {
        for (Index y = 0; y < H_; ++y) {
            for (Index x = 0; x < W_; ++x) {
                weigh(y, x);
                const float best = best_disparity(y, x);
                // of the maps that agree with the best, the mean
                float total = 0, belief = 0, weight = 0, sums[3] = {};
                for (Index n = 0; n < N_; ++n) {
                    const float d = nearest_(n, y, x);
                    if (!(d > EMPTY) || std::abs(d - best) > rules_.tolerance) continue;
                    total += weights_(n) * (d - best);
                    belief += weights_(n) * believed_(n);
                    weight += weights_(n);
                    if (sources_.bars.shape[0] == 0) continue;
                    // maps of one light field are wrong together: their mean is no surer than they are
                    const float *own = sources_.bars.at(n, row_of(n, y, x), column_of(n, y, x));
                    for (Index k = 0; k < 3; ++k) sums[k] += weights_(n) * own[k];
                }
                disparity(y, x) = weight > 0 ? best + total / weight : EMPTY;
                confidence(y, x) = weight > 0 ? belief / weight : 0;
                if (sources_.bars.shape[0] > 0)
                    for (Index k = 0; k < 3; ++k) bars(y, x, k) = weight > 0 ? sums[k] / weight : 0;
            }
        }
    }

  private:
    Index row_of(Index n, Index y, Index x) const { return origin_(n, y, x) / std::int32_t(W_); }
    Index column_of(Index n, Index y, Index x) const { return origin_(n, y, x) % std::int32_t(W_); }

    // How much each map counts at a pixel.
    void weigh(Index y, Index x) const {
        for (Index n = 0; n < N_; ++n) {
            believed_(n) = origin_(n, y, x) >= 0 ? sources_.confidence(n, row_of(n, y, x), column_of(n, y, x)) : 0;
            weights_(n) = closeness_.array()(n) * (rules_.least_weight + believed_(n));
        }
    }

    // The disparity that most maps are for, if they differ.
    float best_disparity(Index y, Index x) const {
        float low = FARTHER, high = EMPTY, most = -FARTHER;
        for (Index n = 0; n < N_; ++n) {
            const float d = nearest_(n, y, x);
            if (d > EMPTY) low = std::min(low, d), high = std::max(high, d);
        }
        if (!(high > low + rules_.tolerance)) return high;
        float best = high;
        for (Index n = 0; n < N_; ++n) {
            const float d = nearest_(n, y, x);
            if (!(d > EMPTY)) continue;
            const float found = score(y, x, d);
            if (found > most) best = d, most = found;
        }
        return best;
    }

    // Sum of the weights of the maps that show a surface, less that of those that see through it.
    float score(Index y, Index x, float d) const {
        float sum = 0;
        for (Index n = 0; n < N_; ++n) {
            const float shown = nearest_(n, y, x);
            if (std::abs(shown - d) <= rules_.tolerance) {
                sum += weights_(n);
            } else if (shown < d) {
                const double down = v_ - sources_.baselines(n, 0), across = u_ - sources_.baselines(n, 1);
                if (is_open(sources_.disparity[n], y + d * down, x + d * across, d, rules_.tolerance)) sum -= weights_(n);
            }
        }
        return sum;
    }

    const Sources &sources_;
    const Rules &rules_;
    const double v_, u_;
    const Index N_ = sources_.disparity.shape[0], H_ = sources_.disparity.shape[1], W_ = sources_.disparity.shape[2];
    const Scratch<float, 3> carried_{N_, H_, W_};
    const Scratch<std::int32_t, 3> origins_{N_, H_, W_};
    const Scratch<float, 2> of_pixel_{2, N_};
    const Scratch<float, 1> closeness_{N_};
    const Array<float, 3> nearest_ = carried_.array();
    const Array<std::int32_t, 3> origin_ = origins_.array();
    const Array<float, 1> weights_ = of_pixel_.array()[0], believed_ = of_pixel_.array()[1];
};

// The first known disparity on the way from a pixel, EMPTY where there is none.
float walk(Array<const float, 2> disparity, Index y, Index x, double down, double across) {
    for (Index steps = 1;; ++steps) {
        const auto row = Index(std::nearbyint(y + steps * down)), column = Index(std::nearbyint(x + steps * across));
        if (row < 0 || column < 0 || row >= disparity.shape[0] || column >= disparity.shape[1]) return EMPTY;
        if (disparity(row, column) > EMPTY) return disparity(row, column);
    }
}

// Fill what is EMPTY with the farther of the two surfaces beside it, along the way that the view has moved: gaps open
// along it.
void extend_background(double v, double u, Array<float, 2> disparity, Array<bool, 2> extended) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const double longest = std::max(std::abs(v), std::abs(u));
    const double down = longest > 0 ? v / longest : 0, across = longest > 0 ? u / longest : 1;
    const Scratch<float, 2> before(H, W);
    const auto known = before.array();
    for (Index y = 0; y < H; ++y) std::copy_n(disparity.at(y), W, known.at(y));
    for (Index y = 0; y < H; ++y) {
        for (Index x = 0; x < W; ++x) {
            extended(y, x) = !(known(y, x) > EMPTY);
            if (!extended(y, x)) continue;
            float best = FARTHER;
            const auto look = [&](double dy, double dx) {
                for (const double sign : {1.0, -1.0})
                    if (const float d = walk(known, y, x, sign * dy, sign * dx); d > EMPTY) best = std::min(best, d);
            };
            look(down, across);
            // across it only where nothing lies along it
            if (best == FARTHER) look(across, -down);
            disparity(y, x) = best < FARTHER ? best : 0;
        }
    }
}

}  // namespace

void corner_disparities(Array<const float, 2> disparity, float tolerance, Array<float, 3> out) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    const Scratch<float, 3> slopes(2, H, W);
    // what each pixel says of its corners; beyond the border what agrees with nothing
    const auto said = Scratch<float, 3>(4, H + 2, W + 2).filled(NAN);
    parallel_for(0, H, [&](Index y) {
        const float *own = disparity.at(y);
        float *__restrict down = slopes.array().at(0, y), *__restrict across = slopes.array().at(1, y);
        for (Index x = 0; x < W; ++x) {
            down[x] = slope(own + x, disparity.strides[0], y, H);
            across[x] = slope(own + x, 1, x, W);
        }
        for (Index corner = 0; corner < 4; ++corner) {
            const auto [dy, dx] = CORNERS[corner];
            float *__restrict values = said.array().at(corner, y + 1, 1);
            for (Index x = 0; x < W; ++x) values[x] = own[x] + down[x] * float(dy) + across[x] * float(dx);
        }
    });
    parallel_for(0, H, [&](Index y) {
        const float *own = disparity.at(y), *down = slopes.array().at(0, y), *across = slopes.array().at(1, y);
        for (Index corner = 0; corner < 4; ++corner) {
            const auto [dy, dx] = CORNERS[corner];
            const Index row = y + (dy > 0), column = dx > 0;
            // by the rows of the pixels that share the corner: for all of them it adds up alike
            const float *around[] = {said.array().at(2, row, column), said.array().at(3, row, column + 1), said.array().at(1, row + 1, column),
                                     said.array().at(0, row + 1, column + 1)};
            float *target = out.at(y, 0, corner);
            for (Index x = 0; x < W; ++x) {
                const double mine = own[x] + down[x] * dy + across[x] * dx;
                float total = 0, count = 0;
                for (const float *values : around) {
                    const bool agrees = std::abs(values[x] - mine) <= tolerance;
                    total += agrees ? values[x] : 0;
                    count += agrees;
                }
                target[4 * x] = count > 0 ? total / count : float(mine);
            }
        }
    });
}

void carry(Array<const float, 2> disparity, Array<const float, 3> corners, double v, double u, double most_stretched, Array<float, 2> nearest,
           Array<std::int32_t, 2> origin) {
    const Index H = disparity.shape[0], W = disparity.shape[1];
    for (Index y = 0; y < H; ++y) {
        std::fill_n(nearest.at(y), W, EMPTY);
        std::fill_n(origin.at(y), W, -1);
    }
    const auto seen = [&](double y, double x, double d) { return Point{y - d * v, x - d * u, d}; };
    for (Index y = 0; y < H; ++y) {
        for (Index x = 0; x < W; ++x) {
            const Point middle = seen(double(y), double(x), disparity(y, x));
            if (middle.y < -1 || middle.y > H || middle.x < -1 || middle.x > W) continue;
            const auto at = [&](Index corner) { return seen(y + CORNERS[corner].down, x + CORNERS[corner].across, corners(y, x, corner)); };
            Point before = at(3);
            for (Index corner = 0; corner < 4; ++corner) {
                const Point here = at(corner);
                // twice the area of a quarter of a pixel
                draw_triangle(middle, before, here, 0.5 * most_stretched, std::int32_t(y * W + x), nearest, origin);
                before = here;
            }
        }
    }
}

void maps_of_views(const Sources &sources, const Rules &rules, Array<const double, 2> baselines, Array<float, 3> disparity, Array<float, 3> confidence,
                   Array<float, 4> bars, Array<bool, 3> extended) {
    parallel_for(0, baselines.shape[0], [&](Index view) {
        const double v = baselines(view, 0), u = baselines(view, 1);
        Fusion(sources, rules, v, u).fuse(disparity[view], confidence[view], bars[view]);
        // gaps open beside the reference view's surfaces, for it is those that most of the maps are made of
        extend_background(v, u, disparity[view], extended[view]);
    });
}

}  // namespace sepi
