#pragma once

#include "support/random.hpp"
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/math/view.hpp>

#include <glm/vec4.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace farfield::support {

[[nodiscard]] inline std::size_t pixel_count(const View& view) {
    return static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
}

/// The place of a pixel among those of a view, in rows of its width.
[[nodiscard]] inline std::size_t pixel_at(const View& view, int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) +
           static_cast<std::size_t>(x);
}

/// The view of a layered image, or onto one: at the origin, along -z.
inline View straight_view(int width, int height, double fov_y = 1.0) {
    View view;
    const double aspect = static_cast<double>(width) / static_cast<double>(height);
    view.lens = perspective_lens(fov_y, aspect, 0.05, 1e4);
    view.width = width;
    view.height = height;
    return view;
}

/// Of each texel, samples that a function adds; sorted near to far here.
inline LayeredDepthImage layered_image(
    const View& view,
    double near_depth,
    double far_depth,
    const std::function<void(int column, int row, std::vector<LayeredSample>& samples)>& fill
) {
    LayeredDepthImage image;
    image.view = view;
    image.near_depth = near_depth;
    image.far_depth = far_depth;
    image.rows.push_back(0);
    std::vector<LayeredSample> texel;
    for (int row = 0; row < view.height; ++row) {
        for (int column = 0; column < view.width; ++column) {
            texel.clear();
            fill(column, row, texel);
            std::stable_sort(texel.begin(), texel.end(), [](const auto& a, const auto& b) {
                return a.depth > b.depth;
            });
            image.counts.push_back(static_cast<std::uint8_t>(texel.size()));
            image.samples.insert(image.samples.end(), texel.begin(), texel.end());
        }
        image.rows.push_back(static_cast<std::uint32_t>(image.samples.size()));
    }
    return image;
}

/// A sample somewhere in a texel; by default in its middle and as large as it.
inline LayeredSample
sample_in(int column, int row, unsigned depth, unsigned x = 8, unsigned y = 8) {
    LayeredSample sample;
    sample.x = static_cast<std::uint16_t>(static_cast<unsigned>(column * kLayeredSteps) + x);
    sample.y = static_cast<std::uint16_t>(static_cast<unsigned>(row * kLayeredSteps) + y);
    sample.depth = static_cast<std::uint16_t>(depth);
    sample.color = {1, 2, 3, 255};
    return sample;
}

inline glm::vec<4, std::uint8_t> random_color(Random& random) {
    const auto channel = [&] { return static_cast<std::uint8_t>(random.below(256)); };
    return {channel(), channel(), channel(), std::uint8_t{255}};
}

/// Up to `most` samples a texel at any depths, of any sizes up to 2.3 texels, half of the texels
/// with all of theirs in the middle.
inline LayeredDepthImage random_layers(
    Random& random, const View& view, double near_depth, double far_depth, unsigned most
) {
    const auto fill = [&](int column, int row, std::vector<LayeredSample>& samples) {
        const bool is_centered = random.below(2) == 0;
        for (unsigned left = random.below(most + 1); left > 0; --left) {
            LayeredSample sample = sample_in(column, row, random.below(65536));
            if (!is_centered) {
                sample = sample_in(
                    column,
                    row,
                    sample.depth,
                    random.below(kLayeredSteps),
                    random.below(kLayeredSteps)
                );
            }
            sample.extent = static_cast<std::uint16_t>(1 + random.below(600));
            sample.color = random_color(random);
            samples.push_back(sample);
        }
    };
    return layered_image(view, near_depth, far_depth, fill);
}

} // namespace farfield::support
