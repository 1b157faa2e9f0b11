// Tree-reweighted message passing, on one thread, since each pixel depends on the one before it.
//
// messages (4, H, W, K): to a pixel from its neighbour at the left, above, at the right, below; costs (H, W, K) of its
// labels; across and down (H, W): weights of the edges to the next pixels.
#include "kernels/kernel.hpp"

namespace sepi::message_passing {

enum Side { LEFT, ABOVE, RIGHT, BELOW };

// Message over an edge: lower envelope of truncated cones on half the belief minus the opposite message.
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

// Belief of a pixel: data cost plus all messages from its neighbours.
void believe(const float *cost, Array<const float, 4> messages, Index y, Index x, float *__restrict out) {
    const float *left = messages.at(LEFT, y, x), *above = messages.at(ABOVE, y, x), *right = messages.at(RIGHT, y, x), *below = messages.at(BELOW, y, x);
    for (Index k = 0; k < messages.shape[3]; ++k) out[k] = cost[k] + left[k] + above[k] + right[k] + below[k];
}

// One pass to the right and down, and one back.
void pass_messages(Array<const float, 3> costs, Array<const float, 2> across, Array<const float, 2> down, float truncation, Array<float, 4> messages) {
    const Index H = costs.shape[0], W = costs.shape[1], K = costs.shape[2];
    const Scratch<float, 1> beliefs(K);
    float *belief = beliefs.array().data;
    // messages to the right and down, or to the left and up
    for (const Index step : {1, -1}) {
        for (Index n = step > 0 ? 0 : H * W - 1; 0 <= n && n < H * W; n += step) {
            const Index y = n / W, x = n % W, to_y = y + step, to_x = x + step;
            believe(costs.at(y, x), messages, y, x, belief);
            const auto send_on = [&](float weight, Side back, Side out, Index i, Index j) {
                send(belief, messages.at(step > 0 ? back : out, y, x), weight, truncation, messages.at(step > 0 ? out : back, i, j), K);
            };
            if (0 <= to_x && to_x < W) send_on(across(y, std::min(x, to_x)), RIGHT, LEFT, y, to_x);
            if (0 <= to_y && to_y < H) send_on(down(std::min(y, to_y), x), BELOW, ABOVE, to_y, x);
        }
    }
}

// Label of each pixel in turn, given the labels of pixels before it and the messages of those after it.
void decode(Array<const float, 3> costs, Array<const float, 2> across, Array<const float, 2> down, float truncation, Array<const float, 4> messages,
            Array<std::int64_t, 2> labels) {
    for (Index y = 0; y < costs.shape[0]; ++y) {
        for (Index x = 0; x < costs.shape[1]; ++x) {
            const float *cost = costs.at(y, x), *right = messages.at(RIGHT, y, x), *below = messages.at(BELOW, y, x);
            // weight 0 without a pixel before
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

const Submodule submodule("message_passing", {{"pass_messages", &pass_messages}, {"decode", &decode}});

}  // namespace sepi::message_passing
