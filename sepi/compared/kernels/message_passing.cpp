#include "message_passing.hpp"

#include <limits>

namespace sepi {
namespace {

enum Side { LEFT, ABOVE, RIGHT, BELOW };

constexpr float INFINITE = std::numeric_limits<float>::infinity();

// Message over an edge: the lower envelope of truncated cones that stand on half the belief less what came back.
void send(const float *belief, const float *back, float weight, float truncation, float *__restrict out, Index K) {
    float least = INFINITE, lowest = INFINITE;
    for (Index k = 0; k < K; ++k) out[k] = 0.5f * belief[k] - back[k];
    for (Index k = 0; k < K; ++k) {
        least = std::min(least, out[k]);
        out[k] = lowest = std::min(out[k], lowest + weight);
    }
    for (Index k = K - 2; k >= 0; --k) out[k] = lowest = std::min(out[k], lowest + weight);
    const float most = weight * truncation;
    for (Index k = 0; k < K; ++k) out[k] = std::min(out[k] - least, most);
}

// Data cost of a pixel and all that its neighbours say of it.
void believe(const float *cost, Array<const float, 4> messages, Index y, Index x, float *__restrict out) {
    const float *left = messages.at(LEFT, y, x), *above = messages.at(ABOVE, y, x), *right = messages.at(RIGHT, y, x), *below = messages.at(BELOW, y, x);
    for (Index k = 0; k < messages.shape[3]; ++k) out[k] = cost[k] + left[k] + above[k] + right[k] + below[k];
}

}  // namespace

void pass_messages(Array<const float, 3> costs, Array<const float, 2> across, Array<const float, 2> down, float truncation, Array<float, 4> messages) {
    const Index H = costs.shape[0], W = costs.shape[1], K = costs.shape[2];
    const Scratch<float, 1> beliefs(K);
    float *belief = beliefs.array().data;
    const auto send_on = [&](Side back, Index y, Index x, float weight, Side out, Index to_y, Index to_x) {
        send(belief, messages.at(back, y, x), weight, truncation, messages.at(out, to_y, to_x), K);
    };
    for (Index y = 0; y < H; ++y) {
        for (Index x = 0; x < W; ++x) {
            believe(costs.at(y, x), messages, y, x, belief);
            if (x + 1 < W) send_on(RIGHT, y, x, across(y, x), LEFT, y, x + 1);
            if (y + 1 < H) send_on(BELOW, y, x, down(y, x), ABOVE, y + 1, x);
        }
    }
    for (Index y = H - 1; y >= 0; --y) {
        for (Index x = W - 1; x >= 0; --x) {
            believe(costs.at(y, x), messages, y, x, belief);
            if (x > 0) send_on(LEFT, y, x, across(y, x - 1), RIGHT, y, x - 1);
            if (y > 0) send_on(ABOVE, y, x, down(y - 1, x), BELOW, y - 1, x);
        }
    }
}

void decode(Array<const float, 3> costs, Array<const float, 2> across, Array<const float, 2> down, float truncation, Array<const float, 4> messages,
            Array<std::int64_t, 2> labels) {
    for (Index y = 0; y < costs.shape[0]; ++y) {
        for (Index x = 0; x < costs.shape[1]; ++x) {
            const float *cost = costs.at(y, x), *right = messages.at(RIGHT, y, x), *below = messages.at(BELOW, y, x);
            // no weight where there is no pixel before
            const Index to_left = x > 0 ? labels(y, x - 1) : 0, upwards = y > 0 ? labels(y - 1, x) : 0;
            const float weight_left = x > 0 ? across(y, x - 1) : 0.0f, weight_up = y > 0 ? down(y - 1, x) : 0.0f;
            Index best = 0;
            float least = INFINITE;
            for (Index k = 0; k < costs.shape[2]; ++k) {
                const float step_left = std::min(float(std::abs(k - to_left)), truncation), step_up = std::min(float(std::abs(k - upwards)), truncation);
                const float total = cost[k] + right[k] + below[k] + weight_left * step_left + weight_up * step_up;
                if (total < least) best = k, least = total;
            }
            labels(y, x) = best;
        }
    }
}

}  // namespace sepi
