#pragma once

#include "gpu/drawing.hpp"
#include "gpu/layered_scene.hpp"
#include "support/random.hpp"
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/image/picture.hpp>
#include <farfield/math/view.hpp>

#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

/// What layered depth images look like, worked out one sample after the other from where it stands
/// in the world, without the terms that drawing uses.
namespace farfield::support {

/// Places of squares are floats of some hundred pixels that come out of a dozen operations: off by
/// less than a thousandth. [px]
inline constexpr double kLayeredRoundingPx = 1e-3;
/// Depths likewise, of their own value.
inline constexpr double kLayeredRoundingDepth = 1e-5;

/// Of a pixel or texel in an array of rows.
inline std::size_t place_in_rows(int x, int y, int width) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
}

/// A square on the target.
struct LayeredSquare {
    double x = 0.0; ///< [px] its middle, from the lower left
    double y = 0.0;
    double side = 0.0;  ///< [px]
    double depth = 0.0; ///< [m] along the view direction
};

/// The point of a sample in the world.
inline glm::dvec3 layered_point(const LayeredDepthImage& image, const LayeredSample& sample) {
    const View& view = image.view;
    const Lens& lens = view.lens;
    const double u = sample.x / 16.0 / view.width;
    const double v = sample.y / 16.0 / view.height;
    const glm::dvec3 ray(
        lens.left + u * (lens.right - lens.left), lens.bottom + v * (lens.top - lens.bottom), -1.0
    );
    return view.eye + view.camera_to_world * (ray * layered_distance(image, sample.depth));
}

/// Length of the square's sides in the world.
inline double layered_side_m(const LayeredDepthImage& image, const LayeredSample& sample) {
    const Lens& lens = image.view.lens;
    return sample.extent / 256.0 * layered_distance(image, sample.depth) *
           (lens.top - lens.bottom) / image.view.height;
}

inline LayeredSquare
layered_square(const LayeredDepthImage& image, const LayeredSample& sample, const View& view) {
    const glm::dvec3 point =
        glm::transpose(view.camera_to_world) * (layered_point(image, sample) - view.eye);
    const Lens& lens = view.lens;
    LayeredSquare square;
    square.depth = -point.z;
    square.x = (point.x / square.depth - lens.left) / (lens.right - lens.left) * view.width;
    square.y = (point.y / square.depth - lens.bottom) / (lens.top - lens.bottom) * view.height;
    square.side = layered_side_m(image, sample) / square.depth * focal_length_px(view);
    return square;
}

/// What a frame must show.
struct LayeredTruth {
    struct Pixel {
        std::vector<std::uint32_t> covering; ///< samples whose squares hold its centre
        std::uint32_t nearest = UINT32_MAX;  ///< of those; none
        bool sure = true;         ///< no edge is so near to its centre that rounding decides
        bool nearest_sure = true; ///< nor is another sample so near in depth
    };
    std::vector<Pixel> pixels; ///< rows from the top
    std::vector<double> sides; ///< [px] of all samples
};

inline LayeredTruth layered_truth(const LayeredDepthImage& image, const View& view) {
    LayeredTruth truth;
    truth.pixels.resize(place_in_rows(0, view.height, view.width));
    std::vector<double> depths;
    for (std::size_t i = 0; i < image.samples.size(); ++i) {
        const LayeredSquare square = layered_square(image, image.samples[i], view);
        truth.sides.push_back(square.side);
        depths.push_back(square.depth);
        const double slack = kLayeredRoundingDepth * square.depth;
        if (square.depth < view.lens.near_distance - slack ||
            square.depth > view.lens.far_distance + slack) {
            continue;
        }
        const bool at_end = square.depth < view.lens.near_distance + slack ||
                            square.depth > view.lens.far_distance - slack;
        const double half = 0.5 * square.side;
        const auto whole = [](double value, int most) {
            return static_cast<int>(std::clamp(std::floor(value), 0.0, static_cast<double>(most)));
        };
        for (int y = whole(square.y - half - 1.0, view.height);
             y < whole(square.y + half + 2.0, view.height);
             ++y) {
            for (int x = whole(square.x - half - 1.0, view.width);
                 x < whole(square.x + half + 2.0, view.width);
                 ++x) {
                const double off_x = std::abs(x + 0.5 - square.x) - half;
                const double off_y = std::abs(y + 0.5 - square.y) - half;
                LayeredTruth::Pixel& pixel =
                    truth.pixels[place_in_rows(x, view.height - 1 - y, view.width)];
                const double off = std::max(off_x, off_y);
                if (std::abs(off) < kLayeredRoundingPx || (at_end && off < 0.0)) {
                    pixel.sure = false;
                } else if (off < 0.0) {
                    pixel.covering.push_back(static_cast<std::uint32_t>(i));
                }
            }
        }
    }
    for (LayeredTruth::Pixel& pixel : truth.pixels) {
        for (const std::uint32_t sample : pixel.covering) {
            if (pixel.nearest == UINT32_MAX || depths[sample] < depths[pixel.nearest]) {
                pixel.nearest = sample;
            }
        }
        for (const std::uint32_t sample : pixel.covering) {
            const double apart = depths[sample] - depths[pixel.nearest];
            const bool close = apart < 2.0 * kLayeredRoundingDepth * depths[sample];
            pixel.nearest_sure = pixel.nearest_sure && (sample == pixel.nearest || !close);
        }
    }
    return truth;
}

/// Samples are told apart by their colours: their number and 1 more, so that none is black.
inline glm::vec<4, std::uint8_t> color_of_sample(std::size_t sample) {
    const std::size_t number = sample + 1;
    return {number & 0xFFU, number >> 8U & 0xFFU, number >> 16U & 0xFFU, 255};
}

inline std::size_t sample_of(const Color& color) {
    return static_cast<std::size_t>(color[0] + 256 * color[1] + 65536 * color[2]) - 1;
}

/// How a picture agrees with the truth.
struct LayeredTally {
    int sure = 0;           ///< pixels
    int covered = 0;        ///< of those
    int wrong_coverage = 0; ///< of those: nothing where something is, or what is not there
    int not_nearest = 0;    ///< of those: not the nearest, where that is sure
};

/// @param picture of an image whose samples have the colours of `color_of_sample`, over black
inline LayeredTally
tally_layers(const Picture& picture, const LayeredDepthImage& image, const LayeredTruth& truth) {
    LayeredTally tally;
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            const LayeredTruth::Pixel& pixel = truth.pixels[place_in_rows(x, y, picture.width)];
            if (!pixel.sure) {
                continue;
            }
            ++tally.sure;
            const Color color = color_at(picture, x, y);
            const bool shown = color != Color{0, 0, 0, 255};
            if (pixel.covering.empty() || !shown) {
                tally.wrong_coverage += pixel.covering.empty() == shown ? 1 : 0;
                continue;
            }
            ++tally.covered;
            const std::size_t sample = sample_of(color);
            REQUIRE(sample < image.samples.size());
            const bool there =
                std::find(
                    pixel.covering.begin(), pixel.covering.end(), static_cast<std::uint32_t>(sample)
                ) != pixel.covering.end();
            tally.wrong_coverage += there ? 0 : 1;
            tally.not_nearest += pixel.nearest_sure && sample != pixel.nearest ? 1 : 0;
        }
    }
    return tally;
}

/// On other pixels than those of an image, off its axis, turned a little.
inline View random_layered_view(Random& random) {
    const glm::dvec3 eye = random.vector(-1.0, 1.0);
    return look_at(
        glm::dvec3(1000.0, -200.0, 40.0) + eye,
        glm::dvec3(1000.0, -200.0, 30.0) + random.vector(-1.5, 1.5),
        {0.1, 1.0, 0.0},
        {-0.5, 0.7, -0.4, 0.6, 0.5, 60.0},
        120,
        100
    );
}

/// Some 1600 samples in texels before the eye of a view, up to four in each, of sides from a tenth
/// of a texel up to several; in the colours of their numbers.
/// @param variant of 0 the eye is that of the view, and so is the window; of others nearby
inline LayeredDepthImage random_layers(Random& random, const View& view, int variant) {
    LayeredDepthImage image;
    image.view = view;
    if (variant > 0) {
        image.view.eye += random.vector(-1.0, 1.0);
        image.view.lens = {-0.7, 0.8, -0.6, 0.7, 0.5, 60.0};
        image.view.width = 75;
        image.view.height = 65; // square texels, as those of the view are pixels
    }
    image.near_depth = 2.5;
    image.far_depth = 30.0;
    std::vector<LayeredSample> samples;
    constexpr std::size_t kSamples = 1600;
    std::vector<std::uint8_t> taken(place_in_rows(0, image.view.height, image.view.width), 0);
    while (samples.size() < kSamples) {
        const auto below = [&](int most) {
            return static_cast<int>(random.below(static_cast<std::uint32_t>(most)));
        };
        const int column = below(image.view.width);
        const int row = below(image.view.height);
        std::uint8_t& there = taken[place_in_rows(column, row, image.view.width)];
        if (there != 0) {
            continue;
        }
        there = 1;
        for (std::uint32_t i = 0; i < 1 + random.below(4); ++i) {
            samples.push_back(
                {.x = static_cast<std::uint16_t>(column * 16 + below(16)),
                 .y = static_cast<std::uint16_t>(row * 16 + below(16)),
                 .depth = static_cast<std::uint16_t>(random.below(65536)),
                 .extent = static_cast<std::uint16_t>(
                     random.below(4) == 0 ? 25 + random.below(2000) : 25 + random.below(500)
                 ),
                 .color = {}}
            );
        }
    }
    image = make_layers(std::move(image), samples);
    for (std::size_t i = 0; i < image.samples.size(); ++i) {
        image.samples[i].color = color_of_sample(i);
    }
    return image;
}

/// What the samples of an image stand for. The plan's origin must be the eye of the view.
inline std::vector<Splat> splats_of(const LayeredDepthImage& image, const View& view) {
    std::vector<Splat> splats;
    for (const LayeredSample& sample : image.samples) {
        splats.push_back(
            {glm::vec3(layered_point(image, sample) - view.eye),
             static_cast<float>(layered_side_m(image, sample)),
             sample.color}
        );
    }
    return splats;
}

} // namespace farfield::support
