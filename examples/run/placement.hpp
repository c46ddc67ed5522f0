#pragma once

#include "run/world.hpp"
#include <farfield/core/result.hpp>
#include <farfield/gpu/backend.hpp>
#include <farfield/technique/build_placement.hpp>
#include <farfield/technique/image_placement.hpp>
#include <farfield/technique/layered_image_maker.hpp>

#include <cstdint>
#include <memory>
#include <vector>

namespace farfield::run {

/// How images are placed in a world. The lens, the size and up are the world's own.
struct PlacementSetup {
    PlacementOptions placement;
    LayeredImageMakerOptions making;
};

/// The options as they are for a world.
[[nodiscard]] PlacementOptions placement_options(const World& world, const PlacementSetup& setup);

/// Images of a map in memory: those that were made, and no others.
class MadeImages final : public LayeredImageSource {
  public:
    explicit MadeImages(std::size_t count) : images_(count) {}

    void want(std::span<const std::uint32_t> /*images*/) noexcept override {}
    [[nodiscard]] const LayeredDepthImage* find(std::uint32_t image) noexcept override {
        return images_[image].get();
    }
    void add(std::uint32_t image, LayeredDepthImage&& made) {
        images_[image] = std::make_unique<LayeredDepthImage>(std::move(made));
    }

  private:
    std::vector<std::unique_ptr<LayeredDepthImage>> images_;
};

/// What placing images for a walk took.
struct PlacementWork {
    double place_s = 0.0;
    double make_s = 0.0;
    std::uint32_t images_made = 0; ///< that the walk shows, of all of the map
    std::uint64_t image_bytes = 0; ///< in memory
    double mean_layers = 0.0;      ///< samples of a texel that has any
};

/// A map of a world, and the images that its walk needs.
struct PlacedWorld {
    PlacementMap map;
    std::unique_ptr<MadeImages> images;
    PlacementWork work;
};

/// Places images and makes those that the frames of the walk show. Uses all cores; tells progress.
/// @return errors of the builder and of making
[[nodiscard]] Result<PlacedWorld> place_images(const World& world, const PlacementSetup& setup);

} // namespace farfield::run
