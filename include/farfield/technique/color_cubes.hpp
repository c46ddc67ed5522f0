#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/color_cube_model.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/policy/cost_model.hpp>
#include <farfield/technique/culled_geometry.hpp>

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace farfield {

/// How a colour cube is drawn.
enum class CubeDrawing : std::uint8_t {
    splats, ///< one square a cell, whose colour is the mean of the faces seen
    faces,  ///< the faces seen, as of the paper: for targets of several samples a pixel
};

/// How cells look that are a part of a surface (`is_sheet`).
enum class CubeSheets : std::uint8_t {
    /// Like all others: where cells of one surface share a pixel, what is behind it shines through.
    blended,
    /// Opaque, and a little larger than what they cover, so that neighbours meet: a surface hides
    /// what is behind it. With splats; faces are blended.
    opaque,
};

/// How `ColorCubes` decides.
struct ColorCubesOptions {
    /// [px] A cell is shown by its colour cube where it is at most so large on the screen: the
    /// bound of its diameter of `metric::sphere_bound_px_unchecked`. > 0, finite
    double cell_px = 1.0;
    CubeDrawing drawing = CubeDrawing::splats;
    CubeSheets sheets = CubeSheets::opaque;
    /// Draws geometry wherever the cost model says that it is no dearer.
    bool never_slower = true;
    /// Counts `ColorCubesStatistics::bytes`; for measuring, it takes time and memory.
    bool count_bytes = false;
    CostModel costs{};
};

/// What the last plan did.
struct ColorCubesStatistics {
    std::uint64_t cells = 0;      ///< visited
    std::uint64_t cubes = 0;      ///< shown
    std::uint64_t leaves = 0;     ///< whose contents are drawn
    std::uint64_t references = 0; ///< visited
    std::uint64_t triangles = 0;  ///< drawn one by one
    std::uint64_t items = 0;      ///< drawn whole
    bool geometry = false;        ///< the plan is that of plain geometry
    /// Of the model, read by the plan, each once however often; with `count_bytes`.
    std::uint64_t bytes = 0;
};

/// An octree whose distant cells are drawn as cubes of one colour a face.
///
///     auto model = build_color_cubes(scene, *sampler, {}, executor);
///     auto technique = ColorCubes::create(*tree, *model, {});
///     const FramePlan& plan = technique->plan(view);
///
/// Cells outside the frustum are left out; those of at most `cell_px` are shown by their colour
/// cube; leaves that are larger draw their contents, each primitive once however many leaves hold
/// it. Contents come first, so that all cubes are tested against them; cubes follow back to front:
/// octant by octant, and where references overlap in the order of their depths.
///
/// Where the cells that a part of the scene would take cost no less than its geometry, it is drawn
/// as geometry; where nothing is left of cubes, the plan is that of `CulledGeometry`.
/// @par Source Chamberlain et al. 1996, section 3. Departures: cells are measured by a bound of
/// their diameter, contents are drawn before all cubes, parts fall back to geometry by cost.
///
/// Blind spots: six colours say nothing of what a surface hides between the six directions; see
/// docs/color-cubes.md for what tears and what it costs to mend it. Colours are those of the world
/// as it was when the model was built: items that move are drawn where they are, but cubes of at
/// most `cell_px` above their leaf still show them where they were.
class ColorCubes {
  public:
    /// @param hierarchy over the same items, for plain geometry and for what moves; must outlive
    /// the technique
    /// @param model one that passed `validate`; must outlive the technique
    /// @return an error that names the option and its value
    [[nodiscard]] static Result<ColorCubes> create(
        const Hierarchy& hierarchy, const ColorCubeModel& model, const ColorCubesOptions& options
    );

    /// The plan of one frame; valid until the next call. Allocates nothing once warm.
    /// @pre validate(view)
    /// @par Cost linear in the cells visited, which are logarithmic in the scene
    [[nodiscard]] const FramePlan& plan(const View& view) noexcept;

    /// Of the last plan.
    [[nodiscard]] const ColorCubesStatistics& statistics() const noexcept { return statistics_; }

  private:
    struct Walk;

    /// A cell that is still to be looked at.
    struct Visit {
        std::uint32_t cell = 0;
        std::uint32_t profile = 0; ///< into `Profiles::cells`; none: UINT32_MAX
        std::uint8_t octant = 0;   ///< of the parent
        std::uint8_t depth = 0;    ///< below the root
        bool inside = false;       ///< of the frustum
    };

    /// Where a cell is, and what it holds.
    struct Place {
        glm::vec3 lo{0.0F};
        float edge = 0.0F;
        Box3f contents;
    };

    /// A leaf of the last tree whose contents are shown, as a link of a list of each reference in
    /// it.
    struct OpenLeaf {
        glm::vec3 lo{0.0F};
        float edge = 0.0F;
        std::uint32_t next = 0; ///< into `open_leaves_`; none: UINT32_MAX
    };
    struct OpenReference {
        std::uint32_t leaves = 0; ///< that have it
        std::uint32_t open_leaves = 0;
        std::uint32_t first_leaf = UINT32_MAX; ///< into `open_leaves_`
    };

    /// What lies one level below the other under one of the upper cells of a tree.
    struct Level {
        std::uint32_t cells = 0;
        float leaf_cost = 0.0F; ///< [triangle] what leaves of this level bear of their contents
        float reference_cost = 0.0F; ///< [triangle] of the references in leaves of this level
    };
    /// To foresee what one of the upper cells of a tree costs.
    struct Profile {
        std::uint32_t first_level = 0; ///< into `Profiles::levels`: the cell itself, then below
        std::uint32_t level_count = 0;
        std::uint32_t first_child = 0; ///< into `Profiles::cells`; 0: those below have none
        float cost = 0.0F;             ///< [triangle] of all that lies under the cell
    };
    struct Profiles {
        std::vector<Profile> cells; ///< the root first, children in the order of their octants
        std::vector<Level> levels;
    };

    ColorCubes(
        const Hierarchy& hierarchy, const ColorCubeModel& model, const ColorCubesOptions& options
    );
    [[nodiscard]] Profiles profiles_of(std::size_t tree) const;
    void find_common_tree();
    template <typename Cell>
    void sort_from_the_back(std::vector<Cell>& cells, std::vector<Cell>& sorted) noexcept;

    const Hierarchy* hierarchy_;
    const ColorCubeModel* model_;
    ColorCubesOptions options_;
    CulledGeometry geometry_;
    std::vector<glm::vec3> level_scales_; ///< by tree
    std::vector<Profiles> profiles_;      ///< by tree
    /// The tree whose references have most of the triangles, and the mean edge of those: what
    /// references are taken to cost before they are looked at.
    std::size_t common_tree_ = 0;
    float common_edge_ = 0.0F;                ///< [m]
    std::array<float, 256> optical_depths_{}; ///< by alpha
    std::array<float, 128> gains_{};          ///< by a byte of `CubeGain`, without its highest bit
    FramePlan plan_;
    ColorCubesStatistics statistics_;
    /// By tree and number of its contents: whether it is drawn already; all false between walks.
    std::vector<std::vector<bool>> drawn_;
    /// By entry of `ColorCubeTree::primitives` of the last tree: triangles to draw.
    std::vector<std::vector<std::uint32_t>> selected_;
    /// By tree and cell, with `count_bytes`: what of it has been read in this frame.
    std::vector<std::vector<std::uint8_t>> read_;
    std::vector<Visit> open_;                    ///< of the walk through a tree
    std::vector<Place> path_;                    ///< on each level the parent of what is there
    std::vector<OpenReference> references_;      ///< by reference; closed between walks
    std::vector<std::uint32_t> open_references_; ///< in the order in which they were met
    std::vector<OpenLeaf> open_leaves_;
    std::vector<float> depths_; ///< of the cells shown [m]
    std::vector<std::uint32_t> step_begins_;
    std::vector<Splat> sorted_splats_;
    std::vector<ShownCube> sorted_cubes_;
};

} // namespace farfield
