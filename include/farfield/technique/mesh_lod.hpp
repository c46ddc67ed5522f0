#pragma once

#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/math/view.hpp>
#include <farfield/metric/pixel_conversion.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/technique/culled_geometry.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace farfield {

/// A coarser stand-in of an item: an item of the geometry source as well, which no hierarchy holds.
struct ItemLevel {
    ItemId item = kNone<ItemId>; ///< drawn instead
    /// [m] in the world: every point of the item's surface has one of the level's this near, which
    /// stands for it. What is finer than that, leaves or railings, may be gone altogether.
    float error_m = 0.0F;
    std::uint32_t primitives = 0;
};

/// An item and its levels.
struct LodItem {
    /// World [m], around the item; finite where there are levels. Of where the item is when the
    /// technique is made: once it moves, its box in the hierarchy counts.
    Box3d bounds;
    std::uint64_t primitives = 0;
    std::uint32_t first_level = 0; ///< into `LodTable::levels`
    std::uint32_t level_count = 0; ///< [0, 255]
};

/// The levels of detail of all items. Plain data: `io::add_levels_of_detail` makes one for a
/// `Scene`, an engine fills it in for its own.
struct LodTable {
    std::vector<LodItem> items; ///< by `ItemId`
    /// Those of an item from fine to coarse: errors never fall, primitives fall from the item's own
    /// to the last level's.
    std::vector<ItemLevel> levels;
};

/// Checks all that `LodTable` says of itself.
/// @return an error that names the item, the level, the field and the value
[[nodiscard]] Result<void> validate(const LodTable& table);

/// How a `MeshLod` decides.
struct MeshLodOptions {
    double error_px = 2.0; ///< [px] largest displacement of what a level shows. > 0, finite
    PixelConversion conversion = PixelConversion::bound;
    /// A level coarser than the one last shown has to be within `error_px` less this share; a level
    /// that is shown stays until it exceeds `error_px`. [0, 1); 0.1 to 0.3 stop levels from
    /// changing back and forth; 0: the plan depends on the view alone
    double hysteresis = 0.0;
    GeometryOrder order = GeometryOrder::front_to_back;
};

/// What the last plan drew; triangles of levels, items and split surfaces.
struct MeshLodStatistics {
    std::uint64_t triangles = 0;
    std::uint64_t full_triangles = 0; ///< what plain geometry would have drawn
};

/// Discrete levels of detail, the second baseline: culled geometry in which every item is drawn by
/// the coarsest of its levels whose error stays under a threshold.
///
///     auto tree = partition::build_bsp(objects, {}, primitive_bounds);
///     auto table = io::add_levels_of_detail(scene);
///     auto technique = MeshLod::create(*tree, *table, {.error_px = 2});
///     const FramePlan& plan = technique->plan(view);
///
/// A level is good at distance d of the eye from the item's box where
///
///     error_m <= d sin(theta),   theta = the angle of `error_px`
///
/// since two points that are `error_m` apart, one of them in the box, are seen within theta of each
/// other. With `PixelConversion::bound` no point of an item is then shown more than `error_px` from
/// its place, anywhere on the image, as far as `error_m` is true.
///
/// Split surfaces (`Hierarchy::pieces`) are drawn at full resolution: a coarser piece would part
/// from its neighbours. Items that move (partition/changes.hpp) are drawn by the level that is good
/// for their box of the moment; the geometry source has to move the levels with them. What scales
/// an item scales the errors of its levels too, which the table does not know.
///
/// Blind spots: an error in metres says where surfaces are, not how much of them is left. A crown
/// that loses half of its leaves is thin, and dark or light by what shows through it, long before
/// the leaf nearest to a lost one is far away; nor does the error see colours and normals.
class MeshLod {
  public:
    /// @param hierarchy over the items of the table, not over their levels; must outlive the
    /// technique
    /// @param table copied
    /// @return an error that names the option, or the item, and its value
    [[nodiscard]] static Result<MeshLod>
    create(const Hierarchy& hierarchy, const LodTable& table, const MeshLodOptions& options = {});

    /// The plan of one frame; valid until the next call. That of `CulledGeometry` with items
    /// replaced by levels; where none are, it is the same. Allocates nothing once warm.
    /// @pre validate(view)
    /// @par Cost that of `CulledGeometry`, and a distance to a box for every item seen
    [[nodiscard]] const FramePlan& plan(const View& view) noexcept;

    /// Of the last plan.
    [[nodiscard]] const MeshLodStatistics& statistics() const noexcept { return statistics_; }

    /// How many items the last plan drew by each level; 0 counts items drawn as they are.
    [[nodiscard]] std::span<const std::uint32_t> items_per_level() const noexcept {
        return items_per_level_;
    }

  private:
    struct Item {
        Box3f box; ///< relative to the hierarchy's origin, rounded outwards
        std::uint32_t first_level = 0;
        std::uint8_t level_count = 0;
        std::uint8_t level = 0; ///< last shown; 0: the item itself
        std::uint64_t primitives = 0;
    };

    MeshLod(const Hierarchy& hierarchy, const LodTable& table, const MeshLodOptions& options);

    [[nodiscard]] Box3f box_of(ItemId id) const noexcept;
    [[nodiscard]] std::uint8_t coarsest(const Item& item, double error_m) const noexcept;
    void replace(ItemId& id, const glm::dvec3& eye, double sine) noexcept;

    const Hierarchy* hierarchy_;
    MeshLodOptions options_;
    std::vector<Item> items_;
    std::vector<Box3f> built_boxes_; ///< by item: what the hierarchy said at first
    std::uint32_t built_version_;    ///< of the root, at first
    bool moved_ = false;             ///< something in the hierarchy has changed since
    std::vector<ItemLevel> levels_;
    std::vector<std::uint32_t> items_per_level_;
    MeshLodStatistics statistics_;
    FramePlan plan_;
};

} // namespace farfield
