#pragma once

#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/build_color_cubes.hpp>
#include <farfield/image/color_cube_model.hpp>
#include <farfield/math/triangle_box.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

/// Scenes of the tests of colour cubes, and a reader of the plans that show them.
namespace farfield::support {

/// How the references of a `CubeWorld` are turned.
enum class Turns : std::uint8_t {
    none,
    quarter, ///< one of the 24 rotations that keep the axes
    any,     ///< scaled as well
};

struct CubeWorldOptions {
    std::size_t references = 40;
    double radius = 60.0; ///< [m] of the disc that they stand on
    std::uint32_t shape_triangles = 400;
    std::uint32_t ground_cells = 12; ///< a side of the ground, two triangles each; 0: none
    std::size_t whole_items = 5;     ///< drawn as they are, 2 m
    Turns turns = Turns::any;
    bool gains = true;
    std::uint64_t seed = 1;
};

/// Two shapes that stand in many places, some whole items and hilly ground. Items are in this
/// order; the colours are random, none of them transparent.
struct CubeWorld {
    std::vector<Object> objects;
    std::vector<std::vector<Triangle3d>> shapes; ///< in their own frames
    std::vector<CubePlacement> placements;
    std::vector<Triangle3d> ground;
    Hierarchy hierarchy;
    ColorCubeModel model;
    std::vector<std::uint64_t> item_primitives;
};

[[nodiscard]] CubeWorld make_cube_world(const CubeWorldOptions& options = {});

/// The rotations that map axes to axes.
[[nodiscard]] std::vector<glm::dmat3> axis_rotations();

/// A model whose scene is one leaf that holds references to shapes of one cell each.
/// @param cell its extent says where the contents of all shapes are, in a cube of edge `edge` about
/// the origin
/// @param placed rotation, scale and translation; the item, the tree and the light set are filled
/// in
[[nodiscard]] ColorCubeModel make_single_cells(
    const std::vector<CubeReference>& placed,
    const CubeCell& cell,
    float edge,
    const ColorCube& colors,
    const std::vector<CubeGain>& gains = {}
);

/// A hierarchy of `count` items around the origin, for models made by hand.
[[nodiscard]] Hierarchy make_item_hierarchy(std::size_t count);

/// Where a cell of a tree is.
struct CellPlace {
    glm::dvec3 lo{0.0}; ///< [m]
    double edge = 0.0;  ///< [m]
    std::uint32_t parent = UINT32_MAX;
    Box3f contents;
    unsigned octant = 0; ///< of the parent
    unsigned depth = 0;
};

/// By cell.
[[nodiscard]] std::vector<CellPlace> places_of(const ColorCubeTree& tree);

/// What a plan of `CubeDrawing::faces` shows: which cells of which trees, and what is drawn.
/// Throws std::runtime_error, which fails the test, where the plan shows something that is not
/// there, or draws anything twice.
class CubePlanReader {
  public:
    /// A cell that a plan shows.
    struct Shown {
        std::uint32_t reference = kScene; ///< or `kScene`
        std::uint32_t cell = 0;
    };
    static constexpr std::uint32_t kScene = UINT32_MAX;

    explicit CubePlanReader(const CubeWorld& world);

    void read(const FramePlan& plan);

    [[nodiscard]] const std::vector<Shown>& shown() const { return shown_; }

    /// Cells shown on the way from the root of a tree to one of its leaves, both included.
    [[nodiscard]] std::size_t covers(std::uint32_t reference, std::uint32_t leaf) const;
    [[nodiscard]] bool draws(ItemId item) const { return items_.count(item) > 0; }
    [[nodiscard]] bool draws(ItemId item, std::uint32_t triangle) const;
    [[nodiscard]] const std::map<ItemId, std::set<std::uint32_t>>& selected() const {
        return selected_;
    }

    [[nodiscard]] const ColorCubeTree& tree_of(std::uint32_t reference) const;
    [[nodiscard]] const std::vector<CellPlace>& places_of(std::uint32_t reference) const;
    /// Leaves of a tree that hold a number.
    [[nodiscard]] const std::vector<std::uint32_t>&
    leaves_with(std::uint32_t reference, std::uint32_t number) const;
    /// The leaf of a tree around a point of its frame, or none: UINT32_MAX.
    [[nodiscard]] std::uint32_t leaf_at(std::uint32_t reference, const glm::dvec3& point) const;
    /// A point of the world as the tree of a reference has it.
    [[nodiscard]] glm::dvec3 to_tree(std::uint32_t reference, const glm::dvec3& point) const;

  private:
    [[nodiscard]] std::size_t tree_index(std::uint32_t reference) const;
    [[nodiscard]] Shown find(const FramePlan& plan, const ShownCube& cube) const;
    [[nodiscard]] std::uint32_t
    find_in(std::uint32_t reference, const FramePlan& plan, const ShownCube& cube) const;

    const CubeWorld* world_;
    std::vector<std::vector<CellPlace>> places_;                   ///< by tree
    std::vector<std::vector<std::vector<std::uint32_t>>> holders_; ///< by tree and number
    std::vector<Shown> shown_;
    std::map<std::uint32_t, std::set<std::uint32_t>> cells_; ///< shown, by reference
    std::set<ItemId> items_;
    std::map<ItemId, std::set<std::uint32_t>> selected_;
};

/// How large the contents of a box are on the screen: the largest distance of two of its corners.
/// [px], infinite where one is beside or behind the eye
/// @param corners of the box in the world
[[nodiscard]] double
diameter_px(const View& view, const std::array<glm::dvec3, 8>& corners) noexcept;

/// The corners of a shown cube in the world.
[[nodiscard]] std::array<glm::dvec3, 8>
corners_of(const FramePlan& plan, const ShownCube& cube) noexcept;

} // namespace farfield::support
