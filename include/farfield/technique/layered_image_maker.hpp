#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/backend.hpp>
#include <farfield/image/build_layered_image.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/technique/placement_map.hpp>

#include <glm/ext/matrix_double4x3.hpp>

#include <cstdint>
#include <memory>
#include <span>

namespace farfield {

/// How layered images of a map are made.
struct LayeredImageMakerOptions {
    /// Pictures that each is made of: 1, from the middle of the site, or 9, from the corners of its
    /// eyes' box as well, between which all eyes are.
    std::uint32_t views = 9;
    LayeredImageOptions merging;
};

/// Draws layered images of a `PlacementMap`, one at a time.
///
/// The paper's eight construction views stand on the ways from the grid point to the edges of the
/// image and as far behind it (section 4.1), since eyes may be anywhere in a star shape. Eyes of a
/// site are in a box, so its corners see most of what is ever disoccluded.
class LayeredImageMaker {
  public:
    /// @param hierarchy, map, backend, item_frames must outlive the maker
    /// @param backend that keeps positions, over the scene of the hierarchy; draws one sample a
    /// pixel
    /// @param item_frames where points of every item are in the world, as `farfield::item_frames`
    /// @return an error where the backend keeps no positions, the map is not of the hierarchy, or
    /// `views` is neither 1 nor 9
    [[nodiscard]] static Result<LayeredImageMaker> create(
        const Hierarchy& hierarchy,
        const PlacementMap& map,
        Backend& backend,
        std::span<const glm::dmat4x3> item_frames,
        const LayeredImageMakerOptions& options = {}
    );

    LayeredImageMaker(LayeredImageMaker&& other) noexcept;
    LayeredImageMaker& operator=(LayeredImageMaker&& other) noexcept;
    LayeredImageMaker(const LayeredImageMaker&) = delete;
    LayeredImageMaker& operator=(const LayeredImageMaker&) = delete;
    ~LayeredImageMaker();

    /// @param image into `PlacementMap::images`
    /// @return the same on every run and for any order of calls; errors of the backend
    [[nodiscard]] Result<BuiltLayeredImage> make(std::uint32_t image);

  private:
    struct Impl;
    explicit LayeredImageMaker(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield
