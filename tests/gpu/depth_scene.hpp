#pragma once

#include "gpu/drawing.hpp"
#include "gpu/flat_scene.hpp"
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/view.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

/// Boards, and plans that show some of them by an image among others. What stands before what can
/// be told in advance.
namespace farfield::support {

/// A square, turned about the vertical.
struct Board {
    ItemId item = kNone<ItemId>;
    glm::dvec3 at{0.0};
    double half = 1.0;    ///< [m]
    double yaw_rad = 0.0; ///< 0: faces +z

    [[nodiscard]] glm::dvec3 normal() const { return {std::sin(yaw_rad), 0.0, std::cos(yaw_rad)}; }
    /// Depth of its plane along a ray of unit depth; infinite: behind.
    [[nodiscard]] double plane_depth(const glm::dvec3& eye, const glm::dvec3& direction) const {
        const double depth = glm::dot(at - eye, normal()) / glm::dot(direction, normal());
        return depth > 0.0 ? depth : std::numeric_limits<double>::infinity();
    }
    [[nodiscard]] double depth(const glm::dvec3& eye, const glm::dvec3& direction) const {
        const double depth = plane_depth(eye, direction);
        const glm::dvec3 place = eye + direction * depth - at;
        const glm::dvec3 side(std::cos(yaw_rad), 0.0, -std::sin(yaw_rad));
        const bool hit = std::abs(glm::dot(place, side)) <= half && std::abs(place.y) <= half;
        return hit ? depth : std::numeric_limits<double>::infinity();
    }
};

inline Board add_board(
    Scene& scene,
    const glm::vec4& color,
    const glm::dvec3& at,
    double half = 1.0,
    double yaw_rad = 0.0
) {
    return {add_quad(scene, color, at, half, yaw_rad), at, half, yaw_rad};
}

/// Direction through the centre of a pixel from the top left, of unit depth.
inline glm::dvec3 pixel_direction(const View& view, double x, double y) {
    const Lens& lens = view.lens;
    const double right = lens.left + (x + 0.5) / view.width * (lens.right - lens.left);
    const double up = lens.top - (y + 0.5) / view.height * (lens.top - lens.bottom);
    return view.camera_to_world * glm::dvec3(right, up, -1.0);
}

/// Where images of the flat view stand: pixels of a frame from the eye that makes them are their
/// texels.
inline constexpr float kImagePlane = 8.0F;    ///< distance of the quad from the eye, at z = 0 [m]
inline constexpr double kKeptSteps = 65535.0; ///< of depths that a page keeps
inline constexpr int kDepthPageSize = 256;    ///< [texel]
inline constexpr int kImageWithBorder = kSize + 2;

/// What a frame shows around an image of the flat view.
struct ImageAmongItems {
    std::vector<ItemId> image{};  ///< what the image shows
    std::vector<ItemId> before{}; ///< drawn before it
    std::vector<ItemId> after{};  ///< drawn after it and its depths
    std::vector<ItemId> mask{};   ///< of the image
    QuadDepth depth = QuadDepth::texel;
    bool write_depths = true;
    float copy_near = 1.0F;  ///< [m]
    float copy_far = 33.0F;  ///< [m]
    int samples = 1;         ///< of the image
    glm::vec2 shift_px{0};   ///< of the quad, to the right and up
    View view = flat_view(); ///< of the frame
};

inline void add_command(
    FramePlan& plan, Command::Kind kind, const std::vector<ItemId>& items, std::uint32_t& count
) {
    Command command;
    command.kind = kind;
    command.first = static_cast<std::uint32_t>(plan.items.size());
    command.count = static_cast<std::uint32_t>(items.size());
    plan.items.insert(plan.items.end(), items.begin(), items.end());
    plan.commands.push_back(command);
    ++count;
}

inline void add_quads_command(
    FramePlan& plan, Command::Kind kind, QuadDepth depth, std::uint32_t quad, std::uint32_t& count
) {
    Command command;
    command.kind = kind;
    command.first = quad;
    command.count = 1;
    command.depth = depth;
    plan.commands.push_back(command);
    ++count;
}

/// The quad of an image that is at `place` of page 1, border included.
inline ImageQuad depth_quad(const Region& place, float copy_near, float copy_far) {
    constexpr float kPixel = 2.0F * kImagePlane / kSize;
    ImageQuad quad;
    quad.page = PageId{1};
    quad.source = {place.x + 1, place.y + 1, kSize, kSize};
    quad.origin = {-kImagePlane, -kImagePlane, 0.0F};
    quad.edge_u = {kPixel * kSize, 0.0F, 0.0F};
    quad.edge_v = {0.0F, kPixel * kSize, 0.0F};
    quad.depth = kImagePlane;
    quad.viewpoint = {0.0F, 0.0F, kImagePlane};
    quad.near_ratio = copy_near / kImagePlane;
    quad.far_ratio = copy_far / kImagePlane;
    return quad;
}

/// A pass that makes such an image from commands to be added.
inline Pass depth_image_pass(const Region& place, float copy_near, float copy_far) {
    Pass pass;
    pass.page = PageId{0};
    pass.view = flat_view();
    pass.view.lens = sub_lens(pass.view, -1.0, -1.0, kSize + 1.0, kSize + 1.0);
    pass.view.width = kImageWithBorder;
    pass.view.height = kImageWithBorder;
    pass.viewport = {3, 7, kImageWithBorder, kImageWithBorder};
    pass.scissor = pass.viewport;
    pass.copy_page = PageId{1};
    pass.copy = place;
    pass.copy_near = copy_near;
    pass.copy_far = copy_far;
    return pass;
}

inline constexpr Region kDepthPlace{5, 9, kImageWithBorder, kImageWithBorder};

/// Makes an image and shows it among items: pass 0 makes it, the last is the frame; quad 0 shows
/// it.
inline FramePlan plan_among_items(const ImageAmongItems& what) {
    FramePlan plan;
    plan.pages = {
        {.page = PageId{0}, .size = kDepthPageSize, .scratch = true, .samples = what.samples},
        {.page = PageId{1}, .size = kDepthPageSize, .depth = what.depth == QuadDepth::texel}};
    Pass image = depth_image_pass(kDepthPlace, what.copy_near, what.copy_far);
    if (!what.mask.empty()) {
        add_command(plan, Command::Kind::mask, what.mask, image.command_count);
    }
    add_command(plan, Command::Kind::geometry, what.image, image.command_count);
    ImageQuad quad = depth_quad(kDepthPlace, what.copy_near, what.copy_far);
    quad.origin += glm::vec3(what.shift_px * (2.0F * kImagePlane / kSize), 0.0F);
    plan.quads = {quad};
    Pass frame;
    frame.view = what.view;
    frame.viewport = {0, 0, what.view.width, what.view.height};
    frame.scissor = frame.viewport;
    frame.batch = 1;
    frame.first_command = image.command_count;
    add_command(plan, Command::Kind::geometry, what.before, frame.command_count);
    add_quads_command(plan, Command::Kind::images, what.depth, 0, frame.command_count);
    if (what.write_depths && what.depth != QuadDepth::none) {
        add_quads_command(plan, Command::Kind::image_depths, what.depth, 0, frame.command_count);
    }
    add_command(plan, Command::Kind::geometry, what.after, frame.command_count);
    plan.passes = {image, frame};
    return plan;
}

/// How far a depth of an image may be off where it is `depth` [m]: half a step of the 65536 over
/// the slab, and float arithmetic on the way of what is kept and of what it is compared with. Each
/// has a few roundings of distances and of reverse-z depths, whose relative error is that of the
/// distance: 32 roundings hold with room.
inline double depth_tolerance(double slab, double depth) {
    return 0.5 * slab / kKeptSteps + 32.0 * double{std::numeric_limits<float>::epsilon()} * depth;
}

/// A red board that an image shows and a blue one of the caller's that goes through it, both
/// turned, so that each is before the other somewhere. They meet behind the plane of the image, so
/// that it matters at what depth it stands.
struct CrossedBoards {
    Scene scene = flat_scene();
    Board red = add_board(scene, kRedPaint, {0.3, 0.2, -1.6}, 4.7, 0.7);
    Board blue = add_board(scene, kBluePaint, {-0.4, -0.9, -1.2}, 4.9, -0.6);
};

/// @param backend over the scene of `boards`, keeps positions
inline void check_depth_positions(Backend& backend, const CrossedBoards& boards) {
    const auto target = backend.create_target(kSize, kSize, 1);
    REQUIRE(target.has_value());
    for (const bool blue_after : {false, true}) {
        INFO("blue after " << blue_after);
        ImageAmongItems what{.image = {boards.red.item}};
        (blue_after ? what.after : what.before) = {boards.blue.item};
        REQUIRE(backend.execute(plan_among_items(what), *target, {}).has_value());
        const auto colors = backend.read_target(*target);
        const auto positions = backend.read_positions(*target);
        REQUIRE(colors.has_value());
        REQUIRE(positions.has_value());
        int wrong = 0;
        int red = 0;
        int blue = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const auto pixel =
                    static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x);
                const ItemId item = positions->texels[pixel].item;
                const Color color = color_at(*colors, x, y);
                const ItemId expected = color == kRed    ? boards.red.item
                                        : color == kBlue ? boards.blue.item
                                                         : kNone<ItemId>;
                wrong += item != expected ? 1 : 0;
                red += color == kRed ? 1 : 0;
                blue += color == kBlue ? 1 : 0;
            }
        }
        CHECK(wrong == 0);
        CHECK(red > 200);
        CHECK(blue > 200);
    }
    backend.destroy_target(*target);
}

} // namespace farfield::support
