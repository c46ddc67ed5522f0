#pragma once

#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/frustum.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/technique/image_cache.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace farfield::support {

/// What an image shows, found out from the plan that made it.
struct ReplayedImage {
    std::uint32_t node = 0;
    std::uint64_t frame = 0;           ///< plan that made it
    View view;                         ///< of the frame that made it
    View pass_view;                    ///< of the pass that made it
    std::uint32_t content_version = 0; ///< of the node, and of what else may be in it, when made
    std::uint32_t surface_version = 0;
    std::uint64_t appearance = 0;
    glm::vec3 viewpoint{0.0F};         ///< eye relative to the hierarchy's origin
    std::vector<std::uint32_t> items;  ///< leaves whose items it shows, in order
    std::vector<std::uint32_t> pieces; ///< leaves whose pieces it shows, in order
    std::vector<std::shared_ptr<const ReplayedImage>> nested;
    double baked_rad = 0.0; ///< largest error of the nested ones at the viewpoint
    float copy_near = 0.0F; ///< as of the pass: what the depths kept of its texels stand for [m]
    float copy_far = 0.0F;
};

/// Executes plans on paper: follows what every texel of every page holds and what the frame shows,
/// and throws a std::runtime_error, which fails the test, where a plan breaks its contract:
///
/// - pages exist when they are used, and never take more bytes together than the budget;
/// - passes of one batch are disjoint, batches follow each other, the frame is the last one alone;
/// - every image sampled is one that was made, as a whole, in an earlier batch or plan for
///   the same lens and resolution, or has texels that fit, and is still there when the plan is
///   over;
/// - an image shows all of one node and nothing else, behind the surfaces among its contents;
/// - images and geometry are drawn back to front, in the frame and in images;
/// - what is in the frustum is shown exactly once, and nothing is shown twice;
/// - no image is shown of what has changed since it was made;
/// - images that keep depth keep it of all that they show, are shown with what they kept, and write
///   the depths of exactly the images shown;
/// - what moves is drawn once where it is in the frustum, is in no image, and passes through no
///   image that has no depth inside.
///
/// The hierarchy may change between plans.
class PlanReplay {
  public:
    struct Options {
        std::uint64_t budget_bytes = UINT64_MAX;
        SurfacePlacement surfaces = SurfacePlacement::first;
        QuadDepth quad_depth = QuadDepth::none;
    };
    PlanReplay(const Hierarchy& hierarchy, const Options& options);

    /// @param appearance the number that the technique was told, for what changes with the light
    void execute(const FramePlan& plan, std::uint64_t appearance = 0);

    /// Images in the last frame, back to front.
    [[nodiscard]] const std::vector<std::shared_ptr<const ReplayedImage>>& shown() const {
        return shown_;
    }
    /// The newest image made of a node, unless something has been written over it; or nothing.
    [[nodiscard]] std::shared_ptr<const ReplayedImage> image_of(std::uint32_t node) const;

    /// Error of an image seen from `eye`: the corner estimate for its own contents plus what nested
    /// images brought with them, in double. Exact where surfaces do not overlap. [rad]
    [[nodiscard]] double error_rad(const ReplayedImage& image, const glm::vec3& eye) const;

    /// The same without nested images.
    [[nodiscard]] double own_error_rad(const ReplayedImage& image, const glm::vec3& eye) const;

    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
    [[nodiscard]] std::uint64_t plans() const { return plans_; }

  private:
    using ImagePtr = std::shared_ptr<const ReplayedImage>;
    using Place = std::tuple<std::size_t, std::int32_t, std::int32_t, std::int32_t, std::int32_t>;

    /// What one pass draws.
    struct Contents {
        std::vector<std::uint32_t> items;
        std::vector<std::uint32_t> pieces;
        std::vector<ImagePtr> images;
        std::vector<ItemId> movers;
    };

    [[noreturn]] void broken(const std::string& what) const;
    void find_places();
    void update_pages(const FramePlan& plan);
    [[nodiscard]] Contents read(const FramePlan& plan, const Pass& pass);
    void read_pieces(
        const FramePlan& plan, const Command& command, std::vector<std::uint32_t>& leaves
    ) const;
    /// The leaf whose surfaces, all that reach into it, a command draws within its clip box; none
    /// where it draws an overlap.
    [[nodiscard]] std::optional<std::uint32_t>
    clipped_leaf(const FramePlan& plan, const Pass& pass, const Command& command) const;
    void check_current(const ReplayedImage& image) const;
    void check_movers(const Frustum& frustum, const Contents& contents) const;
    void check_source(const Place& place, const Region& source) const;
    void check_kept(const ReplayedImage& image) const;
    void check_depths(const ReplayedImage& image, const ImageQuad& quad) const;
    void check_mask(const HierarchyNode& node, const std::vector<std::uint32_t>& masked) const;
    void make_image(const FramePlan& plan, const Pass& pass, Contents contents);
    void check_frame(const FramePlan& plan, const Pass& pass, const Contents& contents) const;
    [[nodiscard]] std::uint32_t common_node(const Contents& contents) const;
    void rank_leaves(std::uint32_t node, const glm::vec3& eye, std::uint32_t& next);
    [[nodiscard]] Box3f contents_box(std::uint32_t node) const;
    /// Sizes of an image's texels in the middle of another view.
    [[nodiscard]] glm::dvec2 texel_px(const ReplayedImage& image, const View& view) const;

    const Hierarchy* hierarchy_;
    Options options_;
    static constexpr std::uint32_t kMoves = UINT32_MAX;
    std::vector<std::uint32_t> leaf_of_item_;      ///< or `kMoves`
    std::vector<std::uint32_t> leaf_of_primitive_; ///< by position in `Hierarchy::primitives`
    std::vector<std::uint32_t> ranks_;             ///< of leaves, back to front; least of a node
    std::vector<std::uint32_t> last_ranks_;        ///< greatest of a node
    std::map<std::size_t, PageUpdate> pages_;
    std::map<Place, ImagePtr> images_;
    std::map<std::uint32_t, Place> place_of_node_;
    std::vector<std::pair<Place, ImagePtr>> sampled_;
    std::vector<ImagePtr> shown_;
    std::uint32_t known_version_ = 0; ///< of the root, for which `leaf_of_item_` is right
    std::uint64_t appearance_ = 0;
    std::uint64_t bytes_ = 0;
    std::uint64_t plans_ = 0;
};

} // namespace farfield::support
