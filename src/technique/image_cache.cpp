// Hierarchical image caching: Shade, Lischinski, Salesin, DeRose, Snyder, "Hierarchical Image
// Caching for Accelerated Walkthroughs of Complex Environments", 1996. Two walks a frame, as there:
// the first decides, children before parents, and makes images; the second shows, back to front.
#include "technique/geometry_pass.hpp"
#include "technique/image_store.hpp"
#include "technique/plan_writer.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/math/frustum.hpp>
#include <farfield/metric/angular_discrepancy.hpp>
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

constexpr std::int32_t kLargestPage = 16384;
constexpr std::int32_t kSmallestPage = 64;
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

constexpr Box3f kEverywhere{
    glm::vec3(-std::numeric_limits<float>::max()), glm::vec3(std::numeric_limits<float>::max())};

/// What a frame's decisions need to know of the view, relative to the hierarchy's origin.
struct Frame {
    View view;
    Frustum frustum;
    glm::vec3 eye{0.0F};
    glm::vec3 right{0.0F};
    glm::vec3 up{0.0F};
    glm::vec3 forward{0.0F};
    glm::vec3 velocity{0.0F};
    glm::vec3 acceleration{0.0F};
    FrameCount<float> count;
    float pixels_per_tangent_x = 0.0F;
    float pixels_per_tangent_y = 0.0F;
    float threshold_rad = 0.0F;
    std::uint64_t number = 0;
};

struct NodeState {
    double draw_s = 0.0;    ///< cost of drawing the node this frame, but for its pixels as geometry
    double pixels_s = 0.0;  ///< cost of the pixels that geometry of the node may cover this frame
    double bake_s = 0.0;    ///< cost of drawing all of it, seen or not, into an image of its parent
    float error_rad = 0.0F; ///< largest error, at the eye, of what would be drawn
    Box3f zone = kEverywhere; ///< where everything that would be drawn is valid
    std::uint32_t level = 0;  ///< passes that must come before one that draws the node
    std::uint32_t image = ImageStore::kNoImage;
    bool shows_image = false;    ///< draws its image, also where it is culled and only baked
    bool bakes_geometry = false; ///< baking it would draw primitives, not images alone
};

/// Distance along the view direction of the nearest point of a box. [m]
float nearest_depth(const Box3f& box, const Frame& frame) noexcept {
    const glm::vec3 nearest =
        glm::mix(box.lo, box.hi, glm::lessThan(frame.forward, glm::vec3(0.0F)));
    return glm::dot(nearest - frame.eye, frame.forward);
}

/// Distance along the view direction of the farthest point of a box. [m]
float farthest_depth(const Box3f& box, const Frame& frame) noexcept {
    const glm::vec3 farthest =
        glm::mix(box.hi, box.lo, glm::lessThan(frame.forward, glm::vec3(0.0F)));
    return glm::dot(farthest - frame.eye, frame.forward);
}

/// A region that is larger, or smaller, by `texels` on each side.
Region grown(const Region& region, std::int32_t texels) noexcept {
    return {
        region.x - texels,
        region.y - texels,
        region.width + 2 * texels,
        region.height + 2 * texels};
}

/// Pixels of the view's own grid that the box may touch, rounded outwards; y up.
/// @pre the whole box is before the eye
Region project(const Box3f& box, const Frame& frame) noexcept {
    glm::vec2 lo(std::numeric_limits<float>::infinity());
    glm::vec2 hi(-std::numeric_limits<float>::infinity());
    for (unsigned index = 0; index < 8; ++index) {
        const glm::vec3 offset = corner(box, index) - frame.eye;
        const float depth = glm::dot(offset, frame.forward);
        const glm::vec2 tangent(
            glm::dot(offset, frame.right) / depth, glm::dot(offset, frame.up) / depth
        );
        lo = glm::min(lo, tangent);
        hi = glm::max(hi, tangent);
    }
    const Lens& lens = frame.view.lens;
    // Far outside the image a coordinate may exceed an integer; such an image is too large anyway.
    const auto pixel = [](double value) {
        constexpr double kMost = 1e6;
        return static_cast<std::int32_t>(std::clamp(value, -kMost, kMost));
    };
    Region region;
    region.x = pixel(std::floor((double{lo.x} - lens.left) * frame.pixels_per_tangent_x));
    region.y = pixel(std::floor((double{lo.y} - lens.bottom) * frame.pixels_per_tangent_y));
    const std::int32_t right =
        pixel(std::ceil((double{hi.x} - lens.left) * frame.pixels_per_tangent_x));
    const std::int32_t top =
        pixel(std::ceil((double{hi.y} - lens.bottom) * frame.pixels_per_tangent_y));
    region.width = std::max(right - region.x, 1);
    region.height = std::max(top - region.y, 1);
    return region;
}

tl::unexpected<Error> bad_option(const char* name, double value, const char* expected) {
    return fail(
        ErrorCode::invalid_argument,
        std::string("image cache: ") + name + " is " + std::to_string(value) + ", expected " +
            expected
    );
}

Result<void> check_options(const ImageCacheOptions& options) {
    if (!(options.error_px > 0.0) || !std::isfinite(options.error_px)) {
        return bad_option("error_px", options.error_px, "a finite value above 0 pixels");
    }
    if (!(options.overlap_px >= 0.0) || !std::isfinite(options.overlap_px)) {
        return bad_option("overlap_px", options.overlap_px, "a finite value of at least 0 texels");
    }
    if (options.image_samples < 1 || options.image_samples > 64) {
        return bad_option("image_samples", options.image_samples, "1 to 64");
    }
    if (options.frame_samples < 1 || options.frame_samples > 64) {
        return bad_option("frame_samples", options.frame_samples, "1 to 64");
    }
    if (options.page_size < kSmallestPage || options.page_size > kLargestPage) {
        return bad_option("page_size", options.page_size, "64 to 16384 texels");
    }
    if (options.max_life < 1) {
        return bad_option("max_life", options.max_life, "at least 1 frame");
    }
    return farfield::validate(options.costs);
}

} // namespace

namespace presets {

ImageCacheOptions shade1996(ImageCacheOptions options) noexcept {
    options.conversion = PixelConversion::mean;
    options.validity = ImageValidity::angle;
    return options;
}

} // namespace presets

struct ImageCache::Impl {
    const Hierarchy* hierarchy;
    ImageCacheOptions options;
    SurfacePlacement surfaces = SurfacePlacement::first;
    ImageStore store;
    FramePlan plan;
    PlanWriter writer;
    Frame frame;
    View last_view;
    std::vector<NodeState> states;
    std::vector<NodeStatus> statuses;
    std::vector<std::uint32_t> pass_levels; ///< of the passes written so far
    std::vector<Pass> sorted_passes;
    ImageCacheStatistics statistics;
    std::uint64_t frame_number = 0;
    bool images_possible = true;

    Impl(const Hierarchy& tree, const ImageCacheOptions& chosen)
        : hierarchy(&tree), options(chosen), store(
                                                 {.budget_bytes = chosen.image_budget_bytes,
                                                  .page_size = chosen.page_size,
                                                  .samples = chosen.image_samples}
                                             ),
          writer(plan, tree), states(tree.nodes.size()),
          statuses(tree.nodes.size(), NodeStatus::untouched) {}
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    void begin_frame(const View& view, const Motion& motion) noexcept;
    void update(std::uint32_t index, bool inside) noexcept;
    [[nodiscard]] bool try_image(std::uint32_t index) noexcept;
    void decide(std::uint32_t index) noexcept;
    [[nodiscard]] bool make_image(
        std::uint32_t index,
        const ImagePlane<float>& plane,
        const Box3f& box,
        const Region& rectangle
    ) noexcept;
    /// @param box of the contents @param view that the image is rendered with
    void write_image_contents(std::uint32_t index, const Box3f& box, const View& view) noexcept;
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
    /// True when the node's own image must reach beyond its cell to hide cracks. Images of children
    /// reach beyond theirs already.
    [[nodiscard]] bool needs_overlap(std::uint32_t index) const noexcept {
        return with_surfaces() && node(index).piece_count > 0 && states[index].bakes_geometry;
    }
    /// What the images and the geometry of a node are about.
    [[nodiscard]] Box3f contents_box(const HierarchyNode& of) const noexcept {
        return with_surfaces() ? bounds(of) : of.items_box;
    }
    [[nodiscard]] double contents_cost(const HierarchyNode& of) const noexcept {
        return with_surfaces()
                   ? geometry_cost(
                         options.costs, primitive_count(of), of.item_count + of.piece_count
                     )
                   : geometry_cost(options.costs, of.item_primitives, of.item_count);
    }
    /// What the pixels cost that geometry within a box may cover this frame.
    [[nodiscard]] double pixels_cost(const Box3f& box) const noexcept;
    [[nodiscard]] Box3f surface_clip(const HierarchyNode& of) const noexcept;
    [[nodiscard]] ImageQuad quad_of(const CachedImage& image) const noexcept;
};

void ImageCache::Impl::begin_frame(const View& view, const Motion& motion) noexcept {
    FARFIELD_ASSERT(validate(view).has_value());
    clear(plan);
    pass_levels.clear();
    plan.cache = options.cache_id;
    plan.origin = hierarchy->origin;
    statistics = {};
    std::fill(statuses.begin(), statuses.end(), NodeStatus::untouched);
    ++frame_number;

    const bool same_pixels = view.lens == last_view.lens && view.width == last_view.width &&
                             view.height == last_view.height;
    if (!same_pixels) {
        store.release_images();
        for (NodeState& state : states) {
            state.image = ImageStore::kNoImage;
        }
        // An exact image is rendered where it stands in the frame, so scratch must hold a frame.
        store.require_scratch(options.exact_pixels ? std::max(view.width, view.height) : 1);
    }
    last_view = view;

    frame.view = view;
    frame.frustum = make_frustum(view, hierarchy->origin);
    frame.eye = local_point(view.eye, hierarchy->origin);
    frame.right = glm::vec3(view.camera_to_world[0]);
    frame.up = glm::vec3(view.camera_to_world[1]);
    frame.forward = -glm::vec3(view.camera_to_world[2]);
    frame.velocity = glm::vec3(motion.velocity);
    frame.acceleration = glm::vec3(motion.acceleration);
    frame.count.frame_seconds = static_cast<float>(motion.frame_seconds);
    frame.count.max_frames = options.max_life;
    const Lens& lens = view.lens;
    frame.pixels_per_tangent_x = static_cast<float>(view.width / (lens.right - lens.left));
    frame.pixels_per_tangent_y = static_cast<float>(view.height / (lens.top - lens.bottom));
    if (options.conversion == PixelConversion::mean) {
        const double fov_y = std::atan(lens.top) - std::atan(lens.bottom);
        frame.threshold_rad =
            static_cast<float>(options.error_px * metric::mean_pixel_angle(fov_y, view.height));
    } else {
        frame.threshold_rad = static_cast<float>(metric::angle_of_pixels_unchecked(
            metric::pixel_scale(lens, view.width, view.height).scale, options.error_px
        ));
    }
    frame.number = frame_number;
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
    const CachedImage& image = store.image(state.image);
    state.error_rad =
        metric::corner_discrepancy_unchecked(image.plane, image.box, frame.eye) + image.baked_rad;
    const bool valid = options.validity == ImageValidity::angle
                           ? state.error_rad <= frame.threshold_rad
                           : contains(image.zone, frame.eye) && !contains(image.box, frame.eye);
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
    Region seen{0, 0, frame.view.width, frame.view.height};
    // Around the eye it may cover everything.
    if (nearest_depth(box, frame) > static_cast<float>(frame.view.lens.near_distance)) {
        seen = intersect(project(box, frame), seen);
    }
    return options.costs.geometry_pixel_s * options.frame_samples * static_cast<double>(area(seen));
}

void ImageCache::Impl::update(std::uint32_t index, bool inside) noexcept {
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
        state.shows_image = false;
        state.bakes_geometry = false;
        return;
    }
    if (!inside) {
        const Overlap overlap = classify(frame.frustum, box);
        if (overlap == Overlap::outside) {
            statuses[index] = NodeStatus::culled;
            if (!try_image(index)) {
                state.bake_s = contents_cost(here);
                state.error_rad = 0.0F;
            }
            state.draw_s = 0.0;
            state.pixels_s = 0.0;
            return;
        }
        inside = overlap == Overlap::inside;
    }
    if (try_image(index)) {
        statuses[index] = NodeStatus::image;
        store.touch(state.image, frame.number);
        return;
    }
    if (is_leaf(here)) {
        state.error_rad = 0.0F;
        state.draw_s = contents_cost(here);
        state.pixels_s = pixels_cost(box);
        state.bake_s = state.draw_s;
    } else {
        update(here.first_child, inside);
        update(here.first_child + 1, inside);
        const NodeState& back = states[here.first_child];
        const NodeState& front = states[here.first_child + 1];
        state.draw_s = back.draw_s + front.draw_s;
        // What both may cover is paid for once.
        state.pixels_s = back.pixels_s + front.pixels_s;
        if (back.pixels_s > 0.0 && front.pixels_s > 0.0) {
            state.pixels_s = std::min(state.pixels_s, pixels_cost(box));
        }
        state.bake_s = back.bake_s + front.bake_s;
        state.error_rad = std::max(back.error_rad, front.error_rad);
        state.zone = intersect(back.zone, front.zone);
        state.level = std::max(back.level, front.level);
        state.bakes_geometry = back.bakes_geometry || front.bakes_geometry;
    }
    decide(index);
}

void ImageCache::Impl::decide(std::uint32_t index) noexcept {
    const HierarchyNode& here = node(index);
    NodeState& state = states[index];
    statuses[index] = is_leaf(here) ? NodeStatus::geometry : NodeStatus::recursed;
    if (!images_possible) {
        return;
    }
    const Box3f clip = with_surfaces() ? surface_clip(here) : Box3f{};
    const Box3f box = unite(here.items_box, clip);
    // A corner at or before the near plane, or an eye in the box, has no image.
    if (!(nearest_depth(box, frame) > static_cast<float>(frame.view.lens.near_distance)) ||
        contains(box, frame.eye)) {
        return;
    }
    const ImagePlane<float> plane{
        .viewpoint = frame.eye, .point = center(box), .normal = frame.forward};
    const float allowed =
        frame.threshold_rad - (options.validity == ImageValidity::angle ? state.error_rad : 0.0F);
    if (!(allowed > 0.0F)) {
        return;
    }
    const double contents_s = state.draw_s + state.pixels_s;
    // What is drawn as it is needs no image, however long that would live.
    if (image_cost(options.costs, 0.0) >= contents_s) {
        return;
    }
    const Region rectangle = project(box, frame);
    const std::int32_t widest = std::min(frame.view.width, store.page_size() - 2 * kBorder);
    const std::int32_t highest = std::min(frame.view.height, store.page_size() - 2 * kBorder);
    if (rectangle.width > widest || rectangle.height > highest) {
        return;
    }
    const std::uint64_t texels = area(grown(rectangle, kBorder));
    const double show_s = image_cost(options.costs, static_cast<double>(texels));
    double create_s = creation_cost(options.costs, state.bake_s, texels);
    if (state.bakes_geometry) {
        create_s += options.costs.geometry_pixel_s * options.image_samples *
                    static_cast<double>(area(rectangle));
    }
    // Zones are dear: only for what would pay if it lived longest.
    if (!policy::image_pays(create_s, show_s, contents_s, options.max_life)) {
        return;
    }
    Box3f zone = kEverywhere;
    std::uint32_t life = 0;
    if (options.validity == ImageValidity::zone) {
        const float radius = metric::corner_safety_distance_unchecked(plane, box, allowed);
        zone = intersect(metric::inscribed_cube(Ball<float>{frame.eye, radius}), state.zone);
        if (is_empty(zone)) {
            return;
        }
        life = policy::extrapolated_lifespan_unchecked(
                   zone, frame.eye, frame.velocity, frame.acceleration, frame.count
        )
                   .frames;
    } else {
        // The ball around the eye is as small as the worst direction makes it. The one in which the
        // viewer goes is known: towards a thing its image lives several times longer than past it.
        life = policy::extrapolated_lifespan_where(
            [&](const glm::vec3& eye) {
                return metric::corner_discrepancy_unchecked(plane, box, eye) <= allowed;
            },
            frame.eye,
            frame.velocity,
            frame.acceleration,
            frame.count
        );
    }
    if (!policy::image_pays(create_s, show_s, contents_s, life)) {
        return;
    }
    if (needs_overlap(index)) {
        // Counted only where it can still change the decision.
        std::uint64_t overlap = 0;
        for_overlap(index, box, false, [&](const Piece& run) { overlap += run.count; });
        create_s += geometry_cost(options.costs, overlap, 1);
        if (!policy::image_pays(create_s, show_s, contents_s, life)) {
            return;
        }
    }
    if (!make_image(index, plane, box, rectangle)) {
        ++statistics.images_refused;
        return;
    }
    CachedImage& image = store.image(state.image);
    image.zone = zone;
    image.baked_rad = state.error_rad;
    statuses[index] = NodeStatus::image;
    state.shows_image = true;
    state.bakes_geometry = false;
    state.zone = zone;
    state.draw_s = show_s;
    state.pixels_s = 0.0;
    state.bake_s = show_s;
    ++state.level;
}

bool ImageCache::Impl::make_image(
    std::uint32_t index, const ImagePlane<float>& plane, const Box3f& box, const Region& rectangle
) noexcept {
    NodeState& state = states[index];
    if (state.image != ImageStore::kNoImage) {
        // It may have made room for the images of the children.
        if (store.holds(state.image, index)) {
            store.release(state.image);
        }
        state.image = ImageStore::kNoImage;
    }
    const Region bordered = grown(rectangle, kBorder);
    const std::uint32_t slot =
        store.create(index, bordered.width, bordered.height, frame.number, plan.pages);
    statistics.images_evicted += store.take_evictions();
    if (slot == ImageStore::kNoImage) {
        return false;
    }
    state.image = slot;
    CachedImage& image = store.image(slot);
    image.plane = plane;
    image.box = box;

    const auto lens_of = [&](const Region& region) {
        return sub_lens(
            frame.view, region.x, region.y, region.x + region.width, region.y + region.height
        );
    };
    // The quad: the rectangle and what fades around it, projected onto the image plane.
    const Lens lens = lens_of(grown(rectangle, kFade));
    const float distance = glm::dot(plane.point - plane.viewpoint, plane.normal);
    const auto left = static_cast<float>(lens.left);
    const auto bottom = static_cast<float>(lens.bottom);
    image.origin = frame.eye + (frame.right * left + frame.up * bottom + frame.forward) * distance;
    image.edge_u = frame.right * (static_cast<float>(lens.right - lens.left) * distance);
    image.edge_v = frame.up * (static_cast<float>(lens.top - lens.bottom) * distance);

    Pass pass;
    pass.page = store.scratch_page();
    pass.view = frame.view;
    View contents_view = frame.view;
    contents_view.lens = lens_of(bordered);
    contents_view.width = bordered.width;
    contents_view.height = bordered.height;
    const Region whole{0, 0, frame.view.width, frame.view.height};
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
    const std::size_t quads_before = plan.quads.size();
    writer.open();
    write_image_contents(index, box, contents_view);
    writer.close(pass);
    pass_levels.push_back(state.level);
    if (!is_leaf(node(index))) {
        leave_untouched(node(index).first_child);
        leave_untouched(node(index).first_child + 1);
    }

    ++statistics.images_created;
    statistics.texels_created += area(bordered);
    statistics.images_combined += plan.quads.size() > quads_before ? 1U : 0U;
    return true;
}

Box3f ImageCache::Impl::surface_clip(const HierarchyNode& of) const noexcept {
    if (is_empty(of.pieces_box)) {
        return {};
    }
    const glm::vec3 size = extent(of.pieces_box);
    const glm::vec3 to_box = center(of.pieces_box) - frame.eye;
    const float range = glm::length(to_box);
    const float texel = range / frame.pixels_per_tangent_y;
    glm::vec3 margin = size * (hierarchy->inflation * 0.5F);
    for (int axis = 0; axis < 3; ++axis) {
        // A step along the axis is foreshortened by the sine of its angle with the line of sight.
        const float cosine = range > 0.0F ? to_box[axis] / range : 0.0F;
        const float sine = std::sqrt(std::max(1.0F - cosine * cosine, 1e-6F));
        const float wanted = static_cast<float>(options.overlap_px) * texel / sine;
        margin[axis] = std::max(margin[axis], std::min(wanted, kMostOverlap * size[axis]));
    }
    return inflate(of.pieces_box, margin);
}

void ImageCache::Impl::write_image_contents(
    std::uint32_t index, const Box3f& box, const View& view
) noexcept {
    const HierarchyNode& here = node(index);
    if (with_surfaces()) {
        if (needs_overlap(index)) {
            plan.clips.push_back(box);
            const auto clip_index = static_cast<std::uint32_t>(plan.clips.size() - 1);
            for_overlap(index, box, false, [&](const Piece& run) {
                writer.piece(run, clip_index);
            });
        }
    } else {
        // The surface is drawn apart, in every frame; here it only hides what is behind it. What is
        // before the whole box hides the quad in the frame; what is beyond hides nothing.
        View slab = view;
        slab.lens.near_distance = double{nearest_depth(box, frame)};
        slab.lens.far_distance = double{farthest_depth(box, frame)};
        write_surfaces(
            *hierarchy,
            make_frustum(slab, hierarchy->origin),
            frame.eye,
            options.order,
            Command::Kind::mask,
            writer
        );
    }
    if (is_leaf(here)) {
        writer.items(here.first_item, here.item_count);
        if (with_surfaces()) {
            writer.pieces(
                Command::Kind::geometry, here.first_piece, here.piece_count, Command::kNoClip
            );
        }
        return;
    }
    const unsigned far = far_child(here, frame.eye);
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
        const std::uint32_t far = parent.first_child + far_child(parent, frame.eye);
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
    const float nearest = static_cast<float>(frame.view.lens.near_distance) * 1.0001F;
    ImageQuad quad;
    quad.page = image.page;
    quad.node = image.node;
    quad.source = grown(image.region, kFade - kBorder);
    quad.origin = image.origin;
    quad.edge_u = image.edge_u;
    quad.edge_v = image.edge_v;
    quad.depth = std::max(nearest_depth(image.box, frame), nearest);
    return quad;
}

void ImageCache::Impl::write_contents(std::uint32_t index, bool baking) noexcept {
    const HierarchyNode& here = node(index);
    NodeState& state = states[index];
    const NodeStatus status = statuses[index];
    if (status == NodeStatus::culled && !baking) {
        return;
    }
    // The image of a culled node is not in use until it is baked and may have made room for others.
    if (state.shows_image && store.holds(state.image, index)) {
        const CachedImage& image = store.image(state.image);
        store.touch(state.image, frame.number);
        writer.image(quad_of(image));
        if (!baking) {
            ++statistics.images_shown;
            statistics.images_reused += image.made_frame < frame.number ? 1U : 0U;
        }
        return;
    }
    if (status == NodeStatus::recursed) {
        const unsigned far = far_child(here, frame.eye);
        write_contents(here.first_child + far, baking);
        write_contents(here.first_child + 1 - far, baking);
        return;
    }
    statistics.geometry_leaves += baking ? 0U : 1U;
    writer.items(here.first_item, here.item_count);
    if (with_surfaces()) {
        writer.pieces(
            Command::Kind::geometry, here.first_piece, here.piece_count, Command::kNoClip
        );
        if (is_leaf(here) && here.piece_count > 0) {
            // Images before it may have moved away from its edge by the threshold.
            const Box3f box = unite(here.items_box, surface_clip(here));
            const auto clip = static_cast<std::uint32_t>(plan.clips.size());
            for_overlap(index, box, true, [&](const Piece& run) {
                if (plan.clips.size() == clip) {
                    plan.clips.push_back(box);
                }
                writer.piece(run, clip);
            });
        }
    }
}

void ImageCache::Impl::leave_untouched(std::uint32_t index) noexcept {
    if (statuses[index] == NodeStatus::untouched) {
        return;
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
    if (Result<void> valid = check_options(options); !valid) {
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
        impl->surfaces = small ? SurfacePlacement::first : SurfacePlacement::in_images;
    }
    return ImageCache(std::move(impl));
}

const FramePlan& ImageCache::plan(const View& view, const Motion& motion) noexcept {
    Impl& impl = *impl_;
    impl.begin_frame(view, motion);
    impl.store.write_pending_updates(impl.plan.pages);
    impl.images_possible = impl.store.possible();
    impl.update(0, false);
    impl.order_passes();

    const auto frame_batch = impl.plan.passes.empty() ? 0U : impl.plan.passes.back().batch + 1U;
    const std::size_t quads_before = impl.plan.quads.size();
    const std::size_t items_before = impl.plan.items.size();
    const std::size_t pieces_before = impl.plan.pieces.size();
    const std::size_t commands_before = impl.plan.commands.size();
    impl.writer.open();
    if (!impl.with_surfaces()) {
        write_surfaces(
            *impl.hierarchy,
            impl.frame.frustum,
            impl.frame.eye,
            impl.options.order,
            Command::Kind::geometry,
            impl.writer
        );
    }
    impl.write_contents(0, false);
    if (impl.plan.quads.size() == quads_before) {
        // No image is shown: nothing else may cost more than the baseline does.
        impl.plan.items.resize(items_before);
        impl.plan.pieces.resize(pieces_before);
        impl.plan.commands.resize(commands_before);
        write_geometry(
            *impl.hierarchy, impl.frame.frustum, impl.frame.eye, impl.options.order, impl.writer
        );
    }
    impl.writer.close(frame_pass(view, frame_batch));

    impl.store.report(impl.statistics);
    return impl.plan;
}

void ImageCache::forget_images() noexcept {
    impl_->store.forget();
    for (NodeState& state : impl_->states) {
        state.image = ImageStore::kNoImage;
    }
}

const ImageCacheStatistics& ImageCache::statistics() const noexcept {
    return impl_->statistics;
}

std::span<const NodeStatus> ImageCache::statuses() const noexcept {
    return impl_->statuses;
}

SurfacePlacement ImageCache::surfaces() const noexcept {
    return impl_->surfaces;
}

} // namespace farfield
