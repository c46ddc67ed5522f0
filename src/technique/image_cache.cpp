// Hierarchical image caching: Shade, Lischinski, Salesin, DeRose, Snyder, "Hierarchical Image
// Caching for Accelerated Walkthroughs of Complex Environments", 1996; Schaufler, Stuerzlinger, "A
// Three Dimensional Image Cache for Virtual Reality", 1996. Two walks a frame, as in both: the
// first decides, children before parents, and makes images; the second shows, back to front.
#include "technique/geometry_pass.hpp"
#include "technique/image_camera.hpp"
#include "technique/image_store.hpp"
#include "technique/plan_writer.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/math/frustum.hpp>
#include <farfield/metric/angular_discrepancy.hpp>
#include <farfield/metric/angular_discrepancy_bound.hpp>
#include <farfield/metric/impostor_angles.hpp>
#include <farfield/metric/pixel_angle.hpp>
#include <farfield/metric/safety_zone.hpp>
#include <farfield/policy/amortization.hpp>
#include <farfield/policy/lifespan.hpp>
#include <farfield/technique/image_cache.hpp>

#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace farfield {

namespace {

// Transparent texels around an image. The quad takes in the inner ring, so that bilinear filtering
// fades out instead of smearing the last texel; the outer ring keeps it from what lies beside the
// image in its page.
constexpr std::int32_t kFade = 1;
constexpr std::int32_t kBorder = kFade + 1;
// Surfaces that cost less than this share of the scene are cheaper drawn as geometry in every frame
// than spread over all images, whose boxes they would enlarge.
constexpr double kSmallSurfaceShare = 0.05;
// Overlap of split surfaces beyond the hierarchy's inflation stops at this share of a cell: seen at
// a grazing angle no overlap along the ground is wide enough.
constexpr float kMostOverlap = 0.5F;
// Clip boxes are larger than their contents by this share of their largest side: contents that end
// in a face of the box must not be lost by rounding.
constexpr float kClipSlack = 1e-4F;
// Sizes of texels, in pixels, that are shown after the lens or the resolution has changed: larger
// ones are seen, smaller ones skip what is between them. The slack is for rounding alone.
constexpr float kLargestOtherTexel = 1.001F;
constexpr float kSmallestOtherTexel = 0.5F;

constexpr Box3f kEverywhere{
    glm::vec3(-std::numeric_limits<float>::max()), glm::vec3(std::numeric_limits<float>::max())};

/// What a frame's decisions need to know of the view and the viewer.
struct Frame {
    ImageCamera camera;
    Frustum frustum;
    glm::vec3 velocity{0.0F};
    glm::vec3 acceleration{0.0F};
    FrameCount<float> count;
    float threshold_rad = 0.0F;
    glm::vec2 pixel_rad{0.0F}; ///< the pixel that texels are held against, across and up
    float px_per_rad = 0.0F;
    std::uint64_t number = 0;
    std::uint64_t pixels = 0; ///< counts changes of lens and resolution
};

struct NodeState {
    double draw_s = 0.0;    ///< cost of drawing the node this frame, but for its pixels as geometry
    double pixels_s = 0.0;  ///< cost of the pixels that geometry of the node may cover this frame
    double bake_s = 0.0;    ///< cost of drawing all of it, seen or not, into an image of its parent
    float error_rad = 0.0F; ///< largest error, at the eye, of what would be drawn
    Box3f zone = kEverywhere; ///< where everything that would be drawn is valid
    std::uint32_t level = 0;  ///< passes that must come before one that draws the node
    std::uint32_t image = ImageStore::kNoImage;
    std::uint64_t movers_frame = 0; ///< in which an item that moves was last in the way of images
    std::uint32_t movers_below = 0; ///< items that move and have their centre in the cell, now
    bool seen = false;              ///< touches the frustum
    bool shows_image = false;       ///< draws its image, also where it is culled and only baked
    bool bakes_geometry = false;    ///< baking it would draw primitives, not images alone
};

/// A region that is larger, or smaller, by `texels` on each side.
Region grown(const Region& region, std::int32_t texels) noexcept {
    return {
        region.x - texels,
        region.y - texels,
        region.width + 2 * texels,
        region.height + 2 * texels};
}

/// Where and how an image of a box would be made.
struct ImagePlacement {
    ImageCamera camera;
    ImagePlane<float> plane;
    Box3f box;
    Region rectangle; ///< of the camera's pixels, without border
};

/// How much wider than on the screen a strip along the edge of a surface is: the surface's normal
/// and the edge are two axes, seen along a direction with these components along them.
float stretch(float along_normal, float along_edge) noexcept {
    constexpr float kLeast = 1e-3F;
    return std::sqrt(std::max(1.0F - along_edge * along_edge, 0.0F)) /
           std::max(along_normal, kLeast);
}

/// True when nothing of the first box can hide anything of the second: along some axis the first
/// begins where the second ends, and the eye is on the second's side. Boxes that meet: false.
bool is_behind(const Box3f& first, const Box3f& second, const glm::vec3& eye) noexcept {
    for (int axis = 0; axis < 3; ++axis) {
        const bool above = first.lo[axis] >= second.hi[axis] && eye[axis] <= first.lo[axis];
        const bool below = first.hi[axis] <= second.lo[axis] && eye[axis] >= first.hi[axis];
        if (above || below) {
            return true;
        }
    }
    return false;
}

} // namespace

struct ImageCache::Impl {
    const Hierarchy* hierarchy;
    ImageCacheOptions options;
    SurfacePlacement surfaces = SurfacePlacement::first;
    ImageStore store;
    FramePlan plan;
    PlanWriter writer;
    Frame frame;
    std::vector<NodeState> states;
    std::vector<NodeStatus> statuses;
    std::vector<ImageEvent> events;
    std::vector<std::uint32_t> pass_levels; ///< of the passes written so far
    std::vector<Pass> sorted_passes;
    std::vector<std::uint32_t> movers_way;   ///< nodes whose `movers_below` is not 0
    std::vector<std::uint32_t> mover_leaves; ///< of `Hierarchy::moving`, by their centres
    ImageCacheStatistics statistics;
    std::uint64_t frame_number = 0;
    std::uint64_t appearance = 0;
    bool images_possible = true;

    Impl(const Hierarchy& tree, const ImageCacheOptions& chosen)
        : hierarchy(&tree), options(chosen), store(
                                                 {.budget_bytes = chosen.image_budget_bytes,
                                                  .page_size = chosen.page_size,
                                                  .samples = chosen.image_samples,
                                                  .depth = chosen.quad_depth == QuadDepth::texel}
                                             ),
          writer(plan, tree), states(tree.nodes.size()),
          statuses(tree.nodes.size(), NodeStatus::untouched),
          events(tree.nodes.size(), ImageEvent::none) {}
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    void begin_frame(const View& view, const Motion& motion) noexcept;
    void find_movers() noexcept;
    void block(std::uint32_t index, const Box3f& box) noexcept;
    /// @param overlap of the node's parent with the frustum
    /// @param wanted brought up to date in any case: an image of its parent may be made from it
    void update(std::uint32_t index, Overlap overlap, bool wanted) noexcept;
    void sum_up_children(std::uint32_t index) noexcept;
    [[nodiscard]] bool try_image(std::uint32_t index) noexcept;
    [[nodiscard]] bool is_current(const CachedImage& image, std::uint32_t index) const noexcept;
    [[nodiscard]] bool texels_fit(const CachedImage& image) const noexcept;
    [[nodiscard]] float image_error(
        const ImagePlane<float>& plane, const Box3f& box, const glm::vec3& eye
    ) const noexcept;
    /// Where the node's image would be made; none where it cannot be.
    [[nodiscard]] std::optional<ImagePlacement> place_image(std::uint32_t index) const noexcept;
    void decide(std::uint32_t index, const std::optional<ImagePlacement>& placement) noexcept;
    /// @param zone where the image would be valid, set where that is what tells its life
    [[nodiscard]] bool pays(
        std::uint32_t index, const ImagePlacement& placement, float allowed, Box3f& zone
    ) const noexcept;
    [[nodiscard]] Box3f
    zone_of(std::uint32_t index, const ImagePlacement& placement, float allowed) const noexcept;
    [[nodiscard]] bool make_image(std::uint32_t index, const ImagePlacement& placement) noexcept;
    void write_image_contents(
        std::uint32_t index, const ImagePlacement& placement, const View& view
    ) noexcept;
    /// Calls `use` with the runs of primitives before the node that may reach into its image's box.
    /// @param under_images only those that an image shows, not those drawn as geometry themselves
    template <typename Use>
    void for_overlap(std::uint32_t index, const Box3f& box, bool under_images, const Use& use)
        const noexcept;
    /// The same for the runs below a node.
    template <typename Use>
    void for_blocks(std::uint32_t index, const Box3f& box, bool under_images, const Use& use)
        const noexcept;
    void write_contents(std::uint32_t index, bool baking) noexcept;
    void write_image(std::uint32_t index, bool baking) noexcept;
    /// Everything under a node as geometry.
    void write_whole(std::uint32_t index) noexcept;
    /// The surfaces under a node, where they are drawn with it: whole, or each leaf's within its
    /// clip box.
    void write_surfaces_of(std::uint32_t index) noexcept;
    /// Items that move and have their centre in the cell of a node, in the order of the planes.
    /// @param use called with each
    template <typename Use>
    void for_movers(std::uint32_t index, const Use& use) const noexcept;
    void write_mover(const MovingItem& mover) noexcept;
    void write_frame(const View& view) noexcept;
    void hide_unseen() noexcept;
    /// Takes back what a subtree did, where an image stands for it.
    void leave_untouched(std::uint32_t index) noexcept;
    void order_passes() noexcept;
    void place_in_scratch(Pass& pass, std::uint32_t& batch) noexcept;

    [[nodiscard]] const HierarchyNode& node(std::uint32_t index) const noexcept {
        return hierarchy->nodes[index];
    }
    [[nodiscard]] bool with_surfaces() const noexcept {
        return surfaces == SurfacePlacement::in_images;
    }
    [[nodiscard]] bool clips_leaves() const noexcept {
        return with_surfaces() && hierarchy->clip_leaves;
    }
    [[nodiscard]] bool faces_eye() const noexcept {
        return options.orientation == ImageOrientation::facing_eye;
    }
    /// True where errors of nested images count against the threshold of the images they are in.
    [[nodiscard]] bool counts_nested() const noexcept {
        return options.validity == ImageValidity::angle || options.validity == ImageValidity::bound;
    }
    /// True where items that move are drawn among the images in the order of the planes, rather
    /// than by the depths of texels.
    [[nodiscard]] bool orders_movers() const noexcept {
        return options.quad_depth != QuadDepth::texel;
    }
    /// True when an item that moves is in the way of an image of the node.
    [[nodiscard]] bool is_blocked(std::uint32_t index) const noexcept {
        return states[index].movers_frame == frame.number;
    }
    /// True when the node's own image must reach beyond its cell to hide cracks. Images of children
    /// reach beyond theirs already.
    [[nodiscard]] bool needs_overlap(std::uint32_t index) const noexcept {
        return with_surfaces() && !is_empty(node(index).pieces_box) && states[index].bakes_geometry;
    }
    /// What the images and the geometry of a node are about.
    [[nodiscard]] Box3f contents_box(const HierarchyNode& of) const noexcept {
        return with_surfaces() ? bounds(of) : of.items_box;
    }
    [[nodiscard]] double contents_cost(const HierarchyNode& of) const noexcept {
        if (!with_surfaces()) {
            return geometry_cost(options.costs, of.item_primitives, of.item_count);
        }
        return geometry_cost(
            options.costs,
            primitive_count(of) + of.guest_primitives,
            of.item_count + of.piece_count + of.guest_count
        );
    }
    /// What the pixels cost that geometry within a box may cover this frame.
    [[nodiscard]] double pixels_cost(const Box3f& box) const noexcept;
    /// The box that the surfaces of a node's image reach to.
    [[nodiscard]] Box3f surface_clip(std::uint32_t index) const noexcept;
    /// The cell of a node where planes are perpendicular to the axes; unbounded where none is.
    [[nodiscard]] Box3f cell_of(std::uint32_t index) const noexcept;
    [[nodiscard]] ImageQuad quad_of(const CachedImage& image) const noexcept;
};

void ImageCache::Impl::begin_frame(const View& view, const Motion& motion) noexcept {
    FARFIELD_ASSERT(farfield::validate(view).has_value());
    clear(plan);
    pass_levels.clear();
    plan.cache = options.cache_id;
    plan.origin = hierarchy->origin;
    statistics = {};
    std::fill(statuses.begin(), statuses.end(), NodeStatus::untouched);
    std::fill(events.begin(), events.end(), ImageEvent::none);
    ++frame_number;

    const View& last = frame.camera.view;
    if (view.lens != last.lens || view.width != last.width || view.height != last.height) {
        ++frame.pixels;
        // An exact image is rendered where it stands in the frame, so scratch must hold a frame.
        store.require_scratch(options.exact_pixels ? std::max(view.width, view.height) : 1);
    }
    if (view.lens.near_distance != last.lens.near_distance ||
        view.lens.far_distance != last.lens.far_distance) {
        store.release_images(); // they may have been cut where the view no longer is
    }
    frame.camera = make_image_camera(view, hierarchy->origin);
    frame.frustum = make_frustum(view, hierarchy->origin);
    frame.velocity = glm::vec3(motion.velocity);
    frame.acceleration = glm::vec3(motion.acceleration);
    frame.count.frame_seconds = static_cast<float>(motion.frame_seconds);
    frame.count.max_frames = options.max_life;
    frame.threshold_rad =
        static_cast<float>(metric::angle_of_pixels(view, options.error_px, options.conversion));
    frame.px_per_rad = static_cast<float>(options.error_px) / frame.threshold_rad;
    if (faces_eye()) {
        frame.pixel_rad = glm::vec2(static_cast<float>(
            options.conversion == PixelConversion::mean
                ? metric::angle_of_pixels(view, 1.0, options.conversion)
                : metric::corner_pixel_angle(
                      metric::pixel_scale(view.lens, view.width, view.height).scale
                  )
        ));
    } else {
        // Made on the frame's pixels, which are largest in the middle of the image.
        frame.pixel_rad = {
            metric::alpha_tex_unchecked(1.0F, frame.camera.pixels_per_tangent_x),
            metric::alpha_tex_unchecked(1.0F, frame.camera.pixels_per_tangent_y)};
    }
    frame.number = frame_number;
    find_movers();
}

void ImageCache::Impl::find_movers() noexcept {
    for (const std::uint32_t index : movers_way) {
        states[index].movers_below = 0;
    }
    movers_way.clear();
    mover_leaves.clear();
    if (!orders_movers()) {
        return;
    }
    // Images have no depth inside. So no image is shown where an item moves through what it shows,
    // and the item is drawn with the leaf that its centre is in.
    for (const MovingItem& mover : hierarchy->moving) {
        block(0, mover.box);
        std::uint32_t index = 0;
        while (!is_empty(mover.box)) { // else it is hidden
            if (states[index].movers_below++ == 0) {
                movers_way.push_back(index);
            }
            if (is_leaf(node(index))) {
                break;
            }
            index = node(index).first_child + 1 - far_child(node(index), center(mover.box));
        }
        mover_leaves.push_back(index);
    }
}

void ImageCache::Impl::block(std::uint32_t index, const Box3f& box) noexcept {
    if (is_empty(intersect(contents_box(node(index)), box))) {
        return;
    }
    states[index].movers_frame = frame.number;
    if (!is_leaf(node(index))) {
        block(node(index).first_child, box);
        block(node(index).first_child + 1, box);
    }
}

bool ImageCache::Impl::is_current(const CachedImage& image, std::uint32_t index) const noexcept {
    // An image may show surfaces of other nodes: those that hide it, and those that it overlaps.
    const bool surfaces_matter = node(0).piece_count > 0 && !clips_leaves();
    return image.content_version == node(index).content_version && image.appearance == appearance &&
           (!surfaces_matter || image.surface_version == hierarchy->surface_version);
}

bool ImageCache::Impl::texels_fit(const CachedImage& image) const noexcept {
    const bool same_pixels = image.pixels == frame.pixels;
    const auto largest = static_cast<float>(options.max_texel_px);
    if (same_pixels && !std::isfinite(largest)) {
        return true;
    }
    const float distance =
        glm::dot(image.plane.point - frame.camera.eye, glm::normalize(image.plane.normal));
    if (!(distance > 0.0F)) {
        return false;
    }
    const float across = metric::alpha_tex_unchecked(image.texel.x, distance) / frame.pixel_rad.x;
    const float up = metric::alpha_tex_unchecked(image.texel.y, distance) / frame.pixel_rad.y;
    if (same_pixels) {
        return std::max(across, up) <= largest;
    }
    const float smallest = kSmallestOtherTexel * static_cast<float>(options.texel_px);
    return std::min(across, up) >= smallest &&
           std::max(across, up) <= std::min(largest, kLargestOtherTexel);
}

float ImageCache::Impl::image_error(
    const ImagePlane<float>& plane, const Box3f& box, const glm::vec3& eye
) const noexcept {
    switch (options.validity) {
    case ImageValidity::impostor_angles:
        return std::max(
            metric::alpha_trans_corners_unchecked(box, plane.viewpoint, eye),
            metric::alpha_size_corners_unchecked(box, plane.viewpoint, eye)
        );
    case ImageValidity::bound:
        return metric::angular_discrepancy_bound_unchecked(plane, box, eye);
    case ImageValidity::angle:
    case ImageValidity::zone:
        break;
    }
    return metric::corner_discrepancy_unchecked(plane, box, eye);
}

bool ImageCache::Impl::try_image(std::uint32_t index) noexcept {
    NodeState& state = states[index];
    state.shows_image = false;
    if (state.image == ImageStore::kNoImage) {
        return false;
    }
    if (!store.holds(state.image, index)) {
        state.image = ImageStore::kNoImage; // evicted since
        return false;
    }
    CachedImage& image = store.image(state.image);
    if (!is_current(image, index)) {
        // It will never be right again.
        store.release(state.image);
        state.image = ImageStore::kNoImage;
        ++statistics.images_stale;
        return false;
    }
    if (is_blocked(index)) {
        return false;
    }
    const glm::vec3& eye = frame.camera.eye;
    image.error_rad = image_error(image.plane, image.box, eye) + image.baked_rad;
    state.error_rad = image.error_rad;
    bool valid = !contains(image.box, eye) && texels_fit(image);
    if (options.validity == ImageValidity::zone) {
        valid = valid && contains(image.zone, eye) && image.allowed_rad <= frame.threshold_rad;
    } else {
        const float counted = counts_nested() ? 0.0F : image.baked_rad;
        valid = valid && image.error_rad - counted <= frame.threshold_rad;
    }
    if (!valid) {
        ++statistics.images_stale;
        return false;
    }
    state.shows_image = true;
    state.bakes_geometry = false;
    state.zone = image.zone;
    state.level = 0;
    state.draw_s = image_cost(options.costs, static_cast<double>(area(image.region)));
    state.pixels_s = 0.0;
    state.bake_s = state.draw_s;
    return true;
}

double ImageCache::Impl::pixels_cost(const Box3f& box) const noexcept {
    if (options.costs.geometry_pixel_s == 0.0) {
        return 0.0;
    }
    const View& view = frame.camera.view;
    Region seen{0, 0, view.width, view.height};
    // Around the eye it may cover everything.
    if (nearest_depth(box, frame.camera) > static_cast<float>(view.lens.near_distance)) {
        seen = intersect(project(box, frame.camera), seen);
    }
    return options.costs.geometry_pixel_s * options.frame_samples * static_cast<double>(area(seen));
}

void ImageCache::Impl::update(std::uint32_t index, Overlap overlap, bool wanted) noexcept {
    ++statistics.nodes_visited;
    const HierarchyNode& here = node(index);
    NodeState& state = states[index];
    const Box3f box = contents_box(here);
    state.level = 0;
    state.bakes_geometry = true;
    state.error_rad = 0.0F;
    state.zone = kEverywhere;
    if (is_empty(box)) {
        statuses[index] = NodeStatus::culled;
        state.draw_s = 0.0;
        state.pixels_s = 0.0;
        state.bake_s = 0.0;
        state.seen = false;
        state.shows_image = false;
        state.bakes_geometry = false;
        return;
    }
    if (overlap == Overlap::partial) {
        overlap = classify(frame.frustum, box);
    }
    state.seen = overlap != Overlap::outside;
    if (!state.seen && !wanted) {
        statuses[index] = NodeStatus::culled;
        if (!try_image(index)) {
            state.bake_s = contents_cost(here);
            state.error_rad = 0.0F;
        }
        state.draw_s = 0.0;
        state.pixels_s = 0.0;
        return;
    }
    if (try_image(index)) {
        statuses[index] = NodeStatus::image;
        events[index] = ImageEvent::reused;
        statistics.images_reused += 1U;
        store.touch(state.image, frame.number);
        return;
    }
    const std::optional<ImagePlacement> placement = place_image(index);
    if (is_leaf(here)) {
        state.error_rad = 0.0F;
        state.draw_s = contents_cost(here);
        state.pixels_s = pixels_cost(box);
        state.bake_s = state.draw_s;
    } else {
        // An image made without regard to cost is made from images, all of them.
        const bool makes =
            placement && !is_blocked(index) && options.policy == ImagePolicy::whenever_possible;
        const bool all = options.all_around || makes || (wanted && !here.image_level);
        update(here.first_child, overlap, all);
        update(here.first_child + 1, overlap, all);
        sum_up_children(index);
    }
    decide(index, placement);
}

void ImageCache::Impl::sum_up_children(std::uint32_t index) noexcept {
    NodeState& state = states[index];
    const NodeState& back = states[node(index).first_child];
    const NodeState& front = states[node(index).first_child + 1];
    state.draw_s = back.draw_s + front.draw_s;
    // What both may cover is paid for once.
    state.pixels_s = back.pixels_s + front.pixels_s;
    if (back.pixels_s > 0.0 && front.pixels_s > 0.0) {
        state.pixels_s = std::min(state.pixels_s, pixels_cost(contents_box(node(index))));
    }
    state.bake_s = back.bake_s + front.bake_s;
    state.error_rad = std::max(back.error_rad, front.error_rad);
    state.zone = intersect(back.zone, front.zone);
    state.level = std::max(back.level, front.level);
    state.bakes_geometry = back.bakes_geometry || front.bakes_geometry;
}

std::optional<ImagePlacement> ImageCache::Impl::place_image(std::uint32_t index) const noexcept {
    const HierarchyNode& here = node(index);
    if (!images_possible || !here.image_level) {
        return std::nullopt;
    }
    const Box3f box = unite(here.items_box, with_surfaces() ? surface_clip(index) : Box3f{});
    const View& view = frame.camera.view;
    const auto near_distance = static_cast<float>(view.lens.near_distance);
    if (contains(box, frame.camera.eye)) {
        return std::nullopt;
    }
    const std::int32_t limit = std::min(store.page_size(), options.image_limit) - 2 * kBorder;
    std::int32_t widest = limit;
    std::int32_t highest = limit;
    ImagePlacement placement;
    placement.box = box;
    placement.camera =
        faces_eye() ? camera_facing(box, frame.camera, hierarchy->origin) : frame.camera;
    // A corner at or before the near plane has no image.
    if (!(nearest_depth(box, placement.camera) > near_distance)) {
        return std::nullopt;
    }
    if (faces_eye()) {
        const TangentBox tangents = tangents_of(box, placement.camera);
        const float side = std::max(tangents.hi.x - tangents.lo.x, tangents.hi.y - tangents.lo.y);
        // Rounding outwards takes up to two texels more.
        const float least = side / static_cast<float>(limit - 2);
        const float tangent =
            std::max(std::tan(static_cast<float>(options.texel_px) * frame.pixel_rad.y), least);
        // However large texels may get, none is made that is seen from the start.
        const auto largest = static_cast<float>(std::min(options.max_texel_px, 1.0));
        if (tangent > std::tan(largest * frame.pixel_rad.y)) {
            return std::nullopt;
        }
        set_pixel_tangent(placement.camera, tangent);
    } else {
        widest = std::min(view.width, limit);
        highest = std::min(view.height, limit);
    }
    placement.rectangle = project(box, placement.camera);
    if (placement.rectangle.width > widest || placement.rectangle.height > highest) {
        return std::nullopt;
    }
    placement.plane = {
        .viewpoint = frame.camera.eye, .point = center(box), .normal = placement.camera.forward};
    return placement;
}

void ImageCache::Impl::decide(
    std::uint32_t index, const std::optional<ImagePlacement>& placement
) noexcept {
    const HierarchyNode& here = node(index);
    NodeState& state = states[index];
    statuses[index] = is_leaf(here) ? NodeStatus::geometry : NodeStatus::recursed;
    if (!images_possible || !here.image_level || is_blocked(index)) {
        return;
    }
    if (!placement) {
        events[index] = ImageEvent::impossible;
        ++statistics.images_impossible;
        return;
    }
    const float allowed = frame.threshold_rad - (counts_nested() ? state.error_rad : 0.0F);
    if (!(allowed > 0.0F)) {
        return;
    }
    Box3f zone = kEverywhere;
    if (options.policy == ImagePolicy::amortized) {
        if (!pays(index, *placement, allowed, zone)) {
            return;
        }
    } else if (options.validity == ImageValidity::zone) {
        zone = zone_of(index, *placement, allowed);
    }
    if (is_empty(zone)) {
        return;
    }
    const float baked_rad = state.error_rad;
    if (!make_image(index, *placement)) {
        ++statistics.images_refused;
        return;
    }
    CachedImage& image = store.image(state.image);
    image.zone = zone;
    image.allowed_rad = frame.threshold_rad;
    image.baked_rad = baked_rad;
    image.error_rad = baked_rad;
    const double show_s = image_cost(options.costs, static_cast<double>(area(image.region)));
    statuses[index] = NodeStatus::image;
    state.shows_image = true;
    state.bakes_geometry = false;
    state.zone = zone;
    state.draw_s = show_s;
    state.pixels_s = 0.0;
    state.bake_s = show_s;
    ++state.level;
}

Box3f ImageCache::Impl::zone_of(std::uint32_t index, const ImagePlacement& placement, float allowed)
    const noexcept {
    const float radius =
        metric::corner_safety_distance_unchecked(placement.plane, placement.box, allowed);
    return intersect(
        metric::inscribed_cube(Ball<float>{frame.camera.eye, radius}), states[index].zone
    );
}

bool ImageCache::Impl::pays(
    std::uint32_t index, const ImagePlacement& placement, float allowed, Box3f& zone
) const noexcept {
    const NodeState& state = states[index];
    const double contents_s = state.draw_s + state.pixels_s;
    const std::uint64_t texels = area(grown(placement.rectangle, kBorder));
    const double show_s = image_cost(options.costs, static_cast<double>(texels));
    double create_s = creation_cost(options.costs, state.bake_s, texels);
    if (state.bakes_geometry) {
        create_s += options.costs.geometry_pixel_s * options.image_samples *
                    static_cast<double>(area(placement.rectangle));
    }
    // Lives are dear: only for what would pay if it lived longest.
    if (!policy::image_pays(create_s, show_s, contents_s, options.max_life)) {
        return false;
    }
    std::uint32_t life = 0;
    if (options.validity == ImageValidity::zone) {
        zone = zone_of(index, placement, allowed);
        if (is_empty(zone)) {
            return false;
        }
        life = policy::extrapolated_lifespan_unchecked(
                   zone, frame.camera.eye, frame.velocity, frame.acceleration, frame.count
        )
                   .frames;
    } else {
        // The ball around the eye is as small as the worst direction makes it. The one in which the
        // viewer goes is known: towards a thing its image lives several times longer than past it.
        life = policy::extrapolated_lifespan_where(
            [&](const glm::vec3& eye) {
                return image_error(placement.plane, placement.box, eye) <= allowed;
            },
            frame.camera.eye,
            frame.velocity,
            frame.acceleration,
            frame.count
        );
    }
    if (!policy::image_pays(create_s, show_s, contents_s, life)) {
        return false;
    }
    if (needs_overlap(index)) {
        // Counted only where it can still change the decision.
        std::uint64_t overlap = 0;
        for_overlap(index, placement.box, false, [&](const Piece& run) { overlap += run.count; });
        create_s += geometry_cost(options.costs, overlap, 1);
    }
    return policy::image_pays(create_s, show_s, contents_s, life);
}

bool ImageCache::Impl::make_image(std::uint32_t index, const ImagePlacement& placement) noexcept {
    NodeState& state = states[index];
    if (state.image != ImageStore::kNoImage) {
        // It may have made room for the images of the children.
        if (store.holds(state.image, index)) {
            store.release(state.image);
        }
        state.image = ImageStore::kNoImage;
    }
    const Region bordered = grown(placement.rectangle, kBorder);
    const std::uint32_t slot =
        store.create(index, bordered.width, bordered.height, frame.number, plan.pages);
    statistics.images_evicted += store.take_evictions();
    if (slot == ImageStore::kNoImage) {
        return false;
    }
    state.image = slot;
    CachedImage& image = store.image(slot);
    image.plane = placement.plane;
    image.box = placement.box;
    image.pixels = frame.pixels;
    image.appearance = appearance;
    image.content_version = node(index).content_version;
    image.surface_version = hierarchy->surface_version;

    const ImageCamera& camera = placement.camera;
    const auto lens_of = [&](const Region& region) {
        return sub_lens(
            camera.view, region.x, region.y, region.x + region.width, region.y + region.height
        );
    };
    // The quad: the rectangle and what fades around it, projected onto the image plane.
    const Region quad = grown(placement.rectangle, kFade);
    const Lens lens = lens_of(quad);
    const ImagePlane<float>& plane = placement.plane;
    const float distance = glm::dot(plane.point - plane.viewpoint, plane.normal);
    const auto left = static_cast<float>(lens.left);
    const auto bottom = static_cast<float>(lens.bottom);
    const glm::vec2 size(
        static_cast<float>(lens.right - lens.left) * distance,
        static_cast<float>(lens.top - lens.bottom) * distance
    );
    image.origin =
        camera.eye + (camera.right * left + camera.up * bottom + camera.forward) * distance;
    image.edge_u = camera.right * size.x;
    image.edge_v = camera.up * size.y;
    image.texel = size / glm::vec2(quad.width, quad.height);

    Pass pass;
    pass.page = store.scratch_page();
    pass.view = camera.view;
    View contents_view = camera.view;
    contents_view.lens = lens_of(bordered);
    contents_view.width = bordered.width;
    contents_view.height = bordered.height;
    const Region whole{0, 0, camera.view.width, camera.view.height};
    if (options.exact_pixels && contains(whole, bordered)) {
        pass.viewport = whole;
        pass.scissor = bordered;
    } else {
        pass.view = contents_view;
        pass.viewport = {0, 0, bordered.width, bordered.height}; // placed when all are known
        pass.scissor = pass.viewport;
    }
    pass.copy_page = image.page;
    pass.copy = image.region;
    pass.node = index;
    if (options.quad_depth == QuadDepth::texel) {
        // A box without depth still needs two ends that can be told apart.
        constexpr float kLeast = 1.0F + 1e-5F;
        pass.copy_near = nearest_depth(placement.box, camera);
        pass.copy_far = std::max(farthest_depth(placement.box, camera), pass.copy_near * kLeast);
        image.near_ratio = pass.copy_near / distance;
        image.far_ratio = pass.copy_far / distance;
    }
    const std::size_t quads_before = plan.quads.size();
    writer.open();
    write_image_contents(index, placement, contents_view);
    const bool combined = plan.quads.size() > quads_before;
    if (combined && options.quad_depth == QuadDepth::texel) {
        writer.image_depths(quads_before, options.quad_depth);
    }
    writer.close(pass);
    pass_levels.push_back(state.level);
    if (!is_leaf(node(index))) {
        leave_untouched(node(index).first_child);
        leave_untouched(node(index).first_child + 1);
    }

    events[index] = combined ? ImageEvent::combined : ImageEvent::made;
    ++statistics.images_created;
    statistics.texels_created += area(bordered);
    statistics.images_combined += combined ? 1U : 0U;
    return true;
}

Box3f ImageCache::Impl::cell_of(std::uint32_t index) const noexcept {
    Box3f cell = kEverywhere;
    for (; index != 0; index = node(index).parent) {
        const HierarchyNode& parent = node(node(index).parent);
        for (int axis = 0; axis < 3; ++axis) {
            if (parent.plane.normal[axis] != 1.0F) {
                continue;
            }
            if (index == parent.first_child) {
                cell.hi[axis] = std::min(cell.hi[axis], parent.plane.offset);
            } else {
                cell.lo[axis] = std::max(cell.lo[axis], parent.plane.offset);
            }
        }
    }
    return cell;
}

Box3f ImageCache::Impl::surface_clip(std::uint32_t index) const noexcept {
    const HierarchyNode& of = node(index);
    if (is_empty(of.pieces_box)) {
        return {};
    }
    const glm::vec3& eye = frame.camera.eye;
    const glm::vec3 size = extent(of.pieces_box);
    const glm::vec3 to_box = center(of.pieces_box) - eye;
    const float range = glm::length(to_box);
    const float texel = range / frame.camera.pixels_per_tangent_y;
    const glm::vec3 sight = range > 0.0F ? glm::abs(to_box) / range : glm::vec3(1.0F);
    glm::vec3 margin = size * (hierarchy->inflation * 0.5F);
    for (int axis = 0; axis < 3; ++axis) {
        const float wanted = static_cast<float>(options.overlap_px) * texel *
                             std::max(
                                 stretch(sight[(axis + 1) % 3], sight[(axis + 2) % 3]),
                                 stretch(sight[(axis + 2) % 3], sight[(axis + 1) % 3])
                             );
        margin[axis] = std::max(margin[axis], std::min(wanted, kMostOverlap * size[axis]));
    }
    if (!hierarchy->clip_leaves) {
        return inflate(of.pieces_box, margin);
    }
    // Out of the cell only through the faces that the eye sees: what lies beyond those is nearer,
    // and drawn over it.
    const glm::vec3 reach = glm::max(glm::abs(of.pieces_box.lo), glm::abs(of.pieces_box.hi));
    const float largest = std::max({size.x, size.y, size.z});
    const float farthest = std::max({reach.x, reach.y, reach.z});
    constexpr float kRounding = 4.0F * std::numeric_limits<float>::epsilon();
    const float slack = kClipSlack * largest + kRounding * farthest;
    const Box3f cell = cell_of(index);
    Box3f clip = inflate(of.pieces_box, glm::max(margin, glm::vec3(slack)));
    for (int axis = 0; axis < 3; ++axis) {
        if (eye[axis] >= cell.lo[axis]) {
            clip.lo[axis] = std::max(clip.lo[axis], cell.lo[axis] - slack);
        }
        if (eye[axis] <= cell.hi[axis]) {
            clip.hi[axis] = std::min(clip.hi[axis], cell.hi[axis] + slack);
        }
    }
    return clip;
}

void ImageCache::Impl::write_image_contents(
    std::uint32_t index, const ImagePlacement& placement, const View& view
) noexcept {
    const HierarchyNode& here = node(index);
    const ImageCamera& camera = placement.camera;
    if (with_surfaces()) {
        if (needs_overlap(index)) {
            plan.clips.push_back(placement.box);
            const auto clip_index = static_cast<std::uint32_t>(plan.clips.size() - 1);
            for_overlap(index, placement.box, false, [&](const Piece& run) {
                writer.piece(run, clip_index);
            });
        }
    } else {
        // The surface is drawn apart, in every frame; here it only hides what is behind it. What is
        // before the whole box hides the quad in the frame; what is beyond hides nothing.
        View slab = view;
        slab.lens.near_distance = double{nearest_depth(placement.box, camera)};
        slab.lens.far_distance = double{farthest_depth(placement.box, camera)};
        write_surfaces(
            *hierarchy,
            make_frustum(slab, hierarchy->origin),
            camera.eye,
            options.order,
            Command::Kind::mask,
            writer
        );
    }
    if (is_leaf(here)) {
        writer.items(here.first_item, here.item_count);
        write_surfaces_of(index);
        return;
    }
    const unsigned far = far_child(here, camera.eye);
    write_contents(here.first_child + far, true);
    write_contents(here.first_child + 1 - far, true);
}

template <typename Use>
void ImageCache::Impl::for_overlap(
    std::uint32_t index, const Box3f& box, bool under_images, const Use& use
) const noexcept {
    // Only surfaces before the node: where two images meet, the farther one reaches under the
    // nearer, which is drawn over it. Reaching over would show what the farther one hides.
    for (std::uint32_t below = index; below != 0;) {
        const HierarchyNode& parent = node(node(below).parent);
        const std::uint32_t far = parent.first_child + far_child(parent, frame.camera.eye);
        if (far == below) {
            const std::uint32_t near = below == parent.first_child ? below + 1 : below - 1;
            for_blocks(near, box, under_images, use);
        }
        below = node(below).parent;
    }
}

template <typename Use>
void ImageCache::Impl::for_blocks(
    std::uint32_t index, const Box3f& box, bool under_images, const Use& use
) const noexcept {
    const HierarchyNode& here = node(index);
    if (here.piece_count == 0 || is_empty(intersect(here.pieces_box, box))) {
        return;
    }
    if (statuses[index] == NodeStatus::image) {
        under_images = false; // all below is
    }
    if (is_leaf(here) && under_images) {
        return;
    }
    if (!is_leaf(here)) {
        for_blocks(here.first_child, box, under_images, use);
        for_blocks(here.first_child + 1, box, under_images, use);
        return;
    }
    constexpr std::uint32_t kBlock = Hierarchy::kBlockPrimitives;
    for (std::uint32_t i = here.first_piece; i < here.first_piece + here.piece_count; ++i) {
        const Piece& piece = hierarchy->pieces[i];
        if (hierarchy->block_boxes.empty()) {
            use(piece);
            continue;
        }
        // A block may reach into the pieces before and after; only this one's part of it counts.
        for (std::uint32_t first = piece.first; first < piece.first + piece.count;) {
            const std::uint32_t block = first / kBlock;
            const std::uint32_t end = std::min((block + 1) * kBlock, piece.first + piece.count);
            if (!is_empty(intersect(hierarchy->block_boxes[block], box))) {
                use(Piece{piece.item, first, end - first});
            }
            first = end;
        }
    }
}

ImageQuad ImageCache::Impl::quad_of(const CachedImage& image) const noexcept {
    // Just behind the near plane at the nearest, or rounding would clip the quad.
    const float nearest = static_cast<float>(frame.camera.view.lens.near_distance) * 1.0001F;
    ImageQuad quad;
    quad.page = image.page;
    quad.node = image.node;
    quad.source = grown(image.region, kFade - kBorder);
    quad.origin = image.origin;
    quad.edge_u = image.edge_u;
    quad.edge_v = image.edge_v;
    quad.depth = std::max(nearest_depth(image.box, frame.camera), nearest);
    quad.viewpoint = image.plane.viewpoint;
    quad.near_ratio = image.near_ratio;
    quad.far_ratio = image.far_ratio;
    return quad;
}

void ImageCache::Impl::write_contents(std::uint32_t index, bool baking) noexcept {
    const HierarchyNode& here = node(index);
    const NodeState& state = states[index];
    if (!state.seen && !baking) {
        for_movers(index, [&](const MovingItem& mover) { write_mover(mover); });
        return;
    }
    // The image of a culled node is not in use until it is baked and may have made room for others.
    if (state.shows_image && store.holds(state.image, index)) {
        write_image(index, baking);
        return;
    }
    if (statuses[index] == NodeStatus::recursed) {
        const unsigned far = far_child(here, frame.camera.eye);
        write_contents(here.first_child + far, baking);
        write_contents(here.first_child + 1 - far, baking);
        return;
    }
    write_whole(index);
    if (!baking) {
        ++statistics.geometry_leaves;
        for_movers(index, [&](const MovingItem& mover) { write_mover(mover); });
    }
}

void ImageCache::Impl::write_image(std::uint32_t index, bool baking) noexcept {
    const CachedImage& image = store.image(states[index].image);
    store.touch(states[index].image, frame.number);
    if (baking) {
        writer.image(quad_of(image), options.quad_depth);
        return;
    }
    const auto write_movers = [&](bool behind) {
        for_movers(index, [&](const MovingItem& mover) {
            if (is_behind(mover.box, image.box, frame.camera.eye) == behind) {
                write_mover(mover);
            }
        });
    };
    write_movers(true);
    writer.image(quad_of(image), options.quad_depth);
    write_movers(false);
    ++statistics.images_shown;
}

void ImageCache::Impl::write_whole(std::uint32_t index) noexcept {
    const HierarchyNode& here = node(index);
    writer.items(here.first_item, here.item_count);
    write_surfaces_of(index);
    if (with_surfaces() && is_leaf(here) && !is_empty(here.pieces_box)) {
        // Images before it may have moved away from its edge by the threshold.
        const Box3f box = unite(here.items_box, surface_clip(index));
        const auto clip = static_cast<std::uint32_t>(plan.clips.size());
        for_overlap(index, box, true, [&](const Piece& run) {
            if (plan.clips.size() == clip) {
                plan.clips.push_back(box);
            }
            writer.piece(run, clip);
        });
    }
}

void ImageCache::Impl::write_surfaces_of(std::uint32_t index) noexcept {
    const HierarchyNode& here = node(index);
    if (!with_surfaces() || (here.piece_count == 0 && here.guest_count == 0)) {
        return;
    }
    if (!hierarchy->clip_leaves) {
        writer.pieces(
            Command::Kind::geometry, here.first_piece, here.piece_count, Command::kNoClip
        );
        return;
    }
    if (!is_leaf(here)) {
        write_surfaces_of(here.first_child);
        write_surfaces_of(here.first_child + 1);
        return;
    }
    if (is_empty(here.pieces_box)) {
        return; // all there is of it reaches only into the margin
    }
    const auto clip = static_cast<std::uint32_t>(plan.clips.size());
    plan.clips.push_back(surface_clip(index));
    writer.pieces(Command::Kind::geometry, here.first_piece, here.piece_count, clip);
    for (std::uint32_t i = here.first_guest; i < here.first_guest + here.guest_count; ++i) {
        writer.piece(hierarchy->guests[i], clip);
    }
}

template <typename Use>
void ImageCache::Impl::for_movers(std::uint32_t index, const Use& use) const noexcept {
    if (states[index].movers_below == 0) {
        return;
    }
    const HierarchyNode& here = node(index);
    if (!is_leaf(here)) {
        const unsigned far = far_child(here, frame.camera.eye);
        for_movers(here.first_child + far, use);
        for_movers(here.first_child + 1 - far, use);
        return;
    }
    for (std::size_t i = 0; i < mover_leaves.size(); ++i) {
        if (mover_leaves[i] == index) {
            use(hierarchy->moving[i]);
        }
    }
}

void ImageCache::Impl::write_mover(const MovingItem& mover) noexcept {
    if (classify(frame.frustum, mover.box) != Overlap::outside) {
        writer.item(mover.item);
    }
}

void ImageCache::Impl::leave_untouched(std::uint32_t index) noexcept {
    if (statuses[index] == NodeStatus::untouched) {
        return;
    }
    if (statuses[index] == NodeStatus::image && events[index] == ImageEvent::reused) {
        --statistics.images_reused; // baked, not shown
    }
    statuses[index] = NodeStatus::untouched;
    if (!is_leaf(node(index))) {
        leave_untouched(node(index).first_child);
        leave_untouched(node(index).first_child + 1);
    }
}

void ImageCache::Impl::place_in_scratch(Pass& pass, std::uint32_t& batch) noexcept {
    const bool exact = pass.viewport != Region{0, 0, pass.scissor.width, pass.scissor.height};
    const std::optional<Region> region =
        exact ? store.claim_scratch(pass.scissor)
              : store.place_in_scratch(pass.scissor.width, pass.scissor.height);
    if (!region) {
        store.clear_scratch();
        ++batch;
        place_in_scratch(pass, batch);
        return;
    }
    pass.scissor = *region;
    if (!exact) {
        pass.viewport = *region;
    }
    pass.batch = batch;
}

void ImageCache::Impl::order_passes() noexcept {
    // Images that others are made from come first; otherwise the order stays.
    sorted_passes.clear();
    const std::uint32_t deepest =
        pass_levels.empty() ? 0 : *std::max_element(pass_levels.begin(), pass_levels.end());
    std::uint32_t batch = 0;
    for (std::uint32_t level = 0; level <= deepest; ++level) {
        store.clear_scratch();
        bool any = false;
        for (std::size_t i = 0; i < plan.passes.size(); ++i) {
            if (pass_levels[i] == level) {
                sorted_passes.push_back(plan.passes[i]);
                place_in_scratch(sorted_passes.back(), batch);
                any = true;
            }
        }
        batch += any ? 1 : 0;
    }
    plan.passes.swap(sorted_passes);
}

ImageCache::ImageCache(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
ImageCache::ImageCache(ImageCache&& other) noexcept = default;
ImageCache& ImageCache::operator=(ImageCache&& other) noexcept = default;
ImageCache::~ImageCache() = default;

Result<ImageCache>
ImageCache::create(const Hierarchy& hierarchy, const ImageCacheOptions& options) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    if (hierarchy.nodes.empty()) {
        return fail(ErrorCode::invalid_argument, "image cache: the hierarchy has no nodes");
    }
    auto impl = std::make_unique<Impl>(hierarchy, options);
    const HierarchyNode& root = hierarchy.nodes[0];
    impl->surfaces = options.surfaces;
    if (options.surfaces == SurfacePlacement::automatic) {
        const bool small =
            static_cast<double>(root.piece_primitives) <=
            kSmallSurfaceShare * static_cast<double>(farfield::primitive_count(root));
        impl->surfaces = small && options.quad_depth != QuadDepth::plane
                             ? SurfacePlacement::first
                             : SurfacePlacement::in_images;
    }
    return ImageCache(std::move(impl));
}

void ImageCache::Impl::write_frame(const View& view) noexcept {
    const auto frame_batch = plan.passes.empty() ? 0U : plan.passes.back().batch + 1U;
    const std::size_t quads_before = plan.quads.size();
    const std::size_t items_before = plan.items.size();
    const std::size_t pieces_before = plan.pieces.size();
    const std::size_t clips_before = plan.clips.size();
    const std::size_t commands_before = plan.commands.size();
    const glm::vec3& eye = frame.camera.eye;
    writer.open();
    if (!with_surfaces()) {
        write_surfaces(
            *hierarchy, frame.frustum, eye, options.order, Command::Kind::geometry, writer
        );
    }
    write_contents(0, false);
    if (plan.quads.size() == quads_before) {
        // No image is shown: nothing else may cost more than the baseline does.
        plan.items.resize(items_before);
        plan.pieces.resize(pieces_before);
        plan.clips.resize(clips_before);
        plan.commands.resize(commands_before);
        write_geometry(*hierarchy, frame.frustum, eye, options.order, writer);
    } else if (options.quad_depth != QuadDepth::none) {
        writer.image_depths(quads_before, options.quad_depth);
        if (!orders_movers()) {
            write_moving(*hierarchy, frame.frustum, writer);
        }
    }
    writer.close(frame_pass(view, frame_batch));
}

void ImageCache::Impl::hide_unseen() noexcept {
    // What was kept up to date out of view has an event, but did nothing in the frame.
    for (std::size_t index = 0; index < statuses.size(); ++index) {
        if (statuses[index] != NodeStatus::untouched && !states[index].seen) {
            statuses[index] = NodeStatus::culled;
        }
    }
}

const FramePlan& ImageCache::plan(const View& view, const Motion& motion) noexcept {
    Impl& impl = *impl_;
    impl.begin_frame(view, motion);
    impl.store.write_pending_updates(impl.plan.pages);
    impl.images_possible = impl.store.possible();
    impl.update(0, Overlap::partial, impl.options.all_around);
    impl.order_passes();
    impl.write_frame(view);
    impl.hide_unseen();
    impl.store.report(impl.statistics);
    return impl.plan;
}

void ImageCache::forget_images() noexcept {
    impl_->store.forget();
    for (NodeState& state : impl_->states) {
        state.image = ImageStore::kNoImage;
    }
}

void ImageCache::set_appearance(std::uint64_t version) noexcept {
    impl_->appearance = version;
}

const ImageCacheStatistics& ImageCache::statistics() const noexcept {
    return impl_->statistics;
}

std::span<const NodeStatus> ImageCache::statuses() const noexcept {
    return impl_->statuses;
}

std::span<const ImageEvent> ImageCache::events() const noexcept {
    return impl_->events;
}

std::optional<ImageFacts> ImageCache::image_of(std::uint32_t node) const noexcept {
    const std::uint32_t slot = impl_->states[node].image;
    if (slot == ImageStore::kNoImage || !impl_->store.holds(slot, node)) {
        return std::nullopt;
    }
    const CachedImage& image = impl_->store.image(slot);
    const bool zoned = impl_->options.validity == ImageValidity::zone;
    return ImageFacts{
        .viewpoint = image.plane.viewpoint,
        .box = image.box,
        .zone = zoned ? image.zone : Box3f{},
        .error_px = image.error_rad * impl_->frame.px_per_rad,
        .made_frame = image.made_frame};
}

SurfacePlacement ImageCache::surfaces() const noexcept {
    return impl_->surfaces;
}

} // namespace farfield
