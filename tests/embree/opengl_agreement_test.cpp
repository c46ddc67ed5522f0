// Casting and rasterising draw the same. Two ways that share nothing but the scene: each is the
// other's proof.
#include "gpu/flat_scene.hpp"
#include "gpu/layered_scene.hpp"
#include "gpu/position_checks.hpp"
#include "opengl/device.hpp"
#include "support/small_scene.hpp"
#include <farfield/embree/embree_backend.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;

/// The same scene twice, keeping positions.
struct Pair {
    std::unique_ptr<Device> device; ///< null: the test is skipped
    std::unique_ptr<opengl::OpenGLBackend> rastered;
    std::unique_ptr<embree::EmbreeBackend> cast;
};

Pair make_pair(const Scene& scene, const Hierarchy* hierarchy) {
    Pair pair;
    pair.device = Device::create(scene, hierarchy);
    if (pair.device == nullptr) {
        return pair;
    }
    auto rastered = opengl::OpenGLBackend::create(*pair.device->source, {.positions = true});
    REQUIRE(rastered.has_value());
    pair.rastered = std::move(*rastered);
    auto cast = embree::EmbreeBackend::create(scene, hierarchy, {.positions = true});
    REQUIRE(cast.has_value());
    pair.cast = std::move(*cast);
    return pair;
}

std::size_t index_at(int width, int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
}

struct Shown {
    Picture colors;
    PositionPicture positions;
};

Shown show(Backend& backend, const FramePlan& plan, int width, int height) {
    const auto target = backend.create_target(width, height, 1);
    REQUIRE(target.has_value());
    const auto executed = backend.execute(plan, *target, {});
    if (!executed) {
        FAIL(executed.error().message);
    }
    auto colors = backend.read_target(*target);
    auto positions = backend.read_positions(*target);
    REQUIRE(colors.has_value());
    REQUIRE(positions.has_value());
    backend.destroy_target(*target);
    return {std::move(*colors), std::move(*positions)};
}

/// Where all nine pixels around one show one item.
bool is_calm(const PositionPicture& picture, int x, int y) {
    const auto at = [&](int column, int row) {
        return picture.texels[index_at(picture.width, column, row)].item;
    };
    for (int row = y - 1; row <= y + 1; ++row) {
        for (int column = x - 1; column <= x + 1; ++column) {
            if (at(column, row) != at(x, y)) {
                return false;
            }
        }
    }
    return true;
}

/// How two pictures agree away from the edges of items.
struct Agreement {
    int calm = 0;       ///< pixels, of which at least one picture shows an item
    int same_item = 0;  ///< of those
    int same_color = 0; ///< of those, within the tolerance
};

void compare(const Shown& a, const Shown& b, int tolerance, Agreement& sum) {
    for (int y = 1; y + 1 < a.positions.height; ++y) {
        for (int x = 1; x + 1 < a.positions.width; ++x) {
            if (!is_calm(a.positions, x, y) || !is_calm(b.positions, x, y)) {
                continue;
            }
            const auto pixel = index_at(a.positions.width, x, y);
            // Sky that agrees with sky says nothing.
            const bool sky = a.positions.texels[pixel].item == kNone<ItemId> &&
                             b.positions.texels[pixel].item == kNone<ItemId>;
            if (sky) {
                continue;
            }
            ++sum.calm;
            if (a.positions.texels[pixel].item != b.positions.texels[pixel].item) {
                continue;
            }
            ++sum.same_item;
            const int apart = distance(color_at(a.colors, x, y), color_at(b.colors, x, y));
            sum.same_color += apart <= tolerance ? 1 : 0;
        }
    }
}

} // namespace

TEST_CASE("Plain geometry is cast as it is rasterised") {
    for (const glm::dvec3& offset : {glm::dvec3(0.0), glm::dvec3(1e7, -2e6, 4e6)}) {
        const SmallWorld world = make_world(small_scene(offset));
        const Pair pair = make_pair(world.scene, &world.hierarchy);
        if (pair.device == nullptr) {
            return;
        }
        CulledGeometry geometry(world.hierarchy);
        Agreement sum;
        for (int frame = 0; frame < 160; frame += 20) {
            const FramePlan& plan = geometry.plan(small_walk(frame, kWidth, kHeight, offset));
            // Normals of OpenGL have 10 bits: half a step of 255 in each, and one of rounding.
            compare(
                show(*pair.rastered, plan, kWidth, kHeight),
                show(*pair.cast, plan, kWidth, kHeight),
                2,
                sum
            );
        }
        CAPTURE(sum.calm, sum.same_item, sum.same_color);
        CHECK(sum.calm > 8 * kWidth * kHeight / 4);
        CHECK(sum.same_item >= 0.995 * sum.calm);
        // Leaves of one tree are edges too, within the item; few are that small here.
        CHECK(sum.same_color >= 0.99 * sum.same_item);
    }
}

TEST_CASE("Images are blended as they are rasterised") {
    // Half transparent texels of many colours, on quads turned in space: what differs is the weight
    // of texels, which both round to 8 bits.
    Scene scene = flat_scene();
    std::vector<ItemId> items;
    Random random(5);
    for (int i = 0; i < 30; ++i) {
        const glm::vec4 color(random.vector(0.0F, 1.0F), 1.0F);
        const glm::dvec3 at(random.uniform(-4.0, 4.0), random.uniform(-4.0, 4.0), -0.01 * i);
        items.push_back(add_quad(scene, color, at, random.uniform(0.3, 1.5)));
    }
    const Pair pair = make_pair(scene, nullptr);
    if (pair.device == nullptr) {
        return;
    }
    constexpr int kImage = 32;
    FramePlan plan = flat_plan(items);
    plan.pages = {
        {.page = PageId{0}, .size = 64, .scratch = true}, {.page = PageId{1}, .size = 64}};
    Pass image = plan.passes[0];
    image.page = PageId{0};
    image.view = flat_view({}, kImage);
    image.view.lens = {-0.5, 0.5, -0.5, 0.5, 0.5, 100.0};
    image.viewport = {0, 0, kImage, kImage};
    image.scissor = image.viewport;
    image.copy_page = PageId{1};
    image.copy = {3, 7, kImage, kImage};
    Command show_images;
    show_images.kind = Command::Kind::images;
    int covered = 0;
    for (int i = 0; i < 12; ++i) {
        ImageQuad quad;
        quad.page = PageId{1};
        quad.source = image.copy;
        quad.edge_u = glm::vec3(8.0F, 0.0F, 0.0F) + random.vector(-3.0F, 3.0F);
        quad.edge_v = glm::vec3(0.0F, 8.0F, 0.0F) + random.vector(-3.0F, 3.0F);
        quad.origin = random.vector(-2.0F, 2.0F) - (quad.edge_u + quad.edge_v) * 0.5F;
        quad.depth = 3.0F;
        plan.quads = {quad};
        plan.commands = {plan.commands[0], show_images};
        plan.commands[1].count = 1;
        plan.passes = {image, flat_plan({}).passes[0]};
        plan.passes[1].first_command = 1;
        plan.passes[1].batch = 1;
        const Shown rastered = show(*pair.rastered, plan, kSize, kSize);
        const Shown cast = show(*pair.cast, plan, kSize, kSize);
        int apart = 0;
        int items_apart = 0;
        for (int y = 1; y + 1 < kSize; ++y) {
            for (int x = 1; x + 1 < kSize; ++x) {
                const auto pixel = index_at(kSize, x, y);
                if (!is_calm(cast.positions, x, y) || !is_calm(rastered.positions, x, y)) {
                    continue; // an edge of the quad or of something in it
                }
                covered += cast.positions.texels[pixel].item != kNone<ItemId> ? 1 : 0;
                items_apart +=
                    cast.positions.texels[pixel].item != rastered.positions.texels[pixel].item ? 1
                                                                                               : 0;
                apart += distance(color_at(cast.colors, x, y), color_at(rastered.colors, x, y)) > 2
                             ? 1
                             : 0;
                CHECK(
                    cast.positions.texels[pixel].texel_px ==
                    Approx(rastered.positions.texels[pixel].texel_px).epsilon(0.05).margin(0.05)
                );
            }
        }
        CAPTURE(i, apart);
        CHECK(apart == 0);
        CHECK(items_apart == 0);
    }
    CHECK(covered > 3000);
}

TEST_CASE("Splats and cubes are blended as they are rasterised") {
    const SmallWorld world = make_world(small_scene());
    const Pair pair = make_pair(world.scene, &world.hierarchy);
    if (pair.device == nullptr) {
        return;
    }
    CulledGeometry geometry(world.hierarchy);
    Random random(77);
    int apart = 0;
    int shown = 0;
    for (int frame = 0; frame < 120; frame += 40) {
        const View view = small_walk(frame, kWidth, kHeight);
        const FramePlan& plain = geometry.plan(view);
        FramePlan plan = plain;
        const auto place = [&] {
            const double depth = random.uniform(5.0, 80.0);
            const glm::dvec3 camera(
                random.uniform(view.lens.left, view.lens.right) * depth,
                random.uniform(view.lens.bottom, view.lens.top) * depth,
                -depth
            );
            return glm::vec3(view.eye + view.camera_to_world * camera - plan.origin);
        };
        const auto color = [&] {
            const auto alpha = static_cast<std::uint8_t>(random.below(256));
            const auto part = [&] { return static_cast<std::uint8_t>(random.below(alpha + 1U)); };
            const std::uint8_t red = part();
            const std::uint8_t green = part();
            return glm::vec<4, std::uint8_t>(red, green, part(), alpha);
        };
        for (int i = 0; i < 5000; ++i) {
            const glm::vec3 center = place();
            plan.splats.push_back({center, random.uniform(0.0F, 0.5F), color()});
        }
        plan.cube_frames = {glm::mat3(1.0F), glm::mat3(view.camera_to_world)};
        for (std::uint32_t i = 0; i < 100; ++i) {
            ShownCube cube;
            cube.center = place();
            cube.size = random.vector(0.3F, 1.5F);
            cube.frame = i % 2;
            cube.faces = {color(), color(), color()};
            plan.cubes.push_back(cube);
        }
        // Cubes between the two halves of the splats.
        const auto add = [&](Command::Kind kind, std::uint32_t first, std::uint32_t count) {
            Command command;
            command.kind = kind;
            command.first = first;
            command.count = count;
            plan.commands.push_back(command);
            ++plan.passes[0].command_count;
        };
        add(Command::Kind::splats, 0, 2500);
        add(Command::Kind::cubes, 0, 100);
        add(Command::Kind::splats, 2500, 2500);
        const Shown rastered = show(*pair.rastered, plan, kWidth, kHeight);
        const Shown cast = show(*pair.cast, plan, kWidth, kHeight);
        const Shown without = show(*pair.cast, plain, kWidth, kHeight);
        for (int y = 1; y + 1 < kHeight; ++y) {
            for (int x = 1; x + 1 < kWidth; ++x) {
                const Color color_there = color_at(cast.colors, x, y);
                shown += color_there != color_at(without.colors, x, y) ? 1 : 0;
                // Half a step of 255 for each layer, some ten at most on one pixel, or the 2 of
                // geometry.
                const bool alike = distance(color_there, color_at(rastered.colors, x, y)) <= 5;
                const bool edge = !is_calm(without.positions, x, y);
                apart += alike || edge ? 0 : 1;
            }
        }
    }
    CAPTURE(shown, apart);
    CHECK(shown > 10'000);
    // Rims of cubes, and of leaves within one tree.
    CHECK(apart < shown / 50);
}

TEST_CASE("A walk with a cache is cast as it is rasterised") {
    const SmallWorld world = make_world(small_scene());
    const Pair pair = make_pair(world.scene, &world.hierarchy);
    if (pair.device == nullptr) {
        return;
    }
    for (const SurfacePlacement surfaces : {SurfacePlacement::first, SurfacePlacement::in_images}) {
        ImageCacheOptions options = presets::shade1996();
        options.page_size = 512;
        options.costs.triangle_s = 1e-6;
        options.surfaces = surfaces;
        auto cache = ImageCache::create(world.hierarchy, options);
        REQUIRE(cache.has_value());
        Agreement sum;
        std::uint32_t images = 0;
        for (int frame = 0; frame < 40; ++frame) {
            const FramePlan& plan =
                cache->plan(small_walk(frame, kWidth, kHeight), small_walk_motion());
            images += cache->statistics().images_shown;
            compare(
                show(*pair.rastered, plan, kWidth, kHeight),
                show(*pair.cast, plan, kWidth, kHeight),
                3,
                sum
            );
        }
        CAPTURE(sum.calm, sum.same_item, sum.same_color);
        CHECK(images > 400);
        CHECK(sum.same_item >= 0.995 * sum.calm);
        CHECK(sum.same_color >= 0.99 * sum.same_item);
    }
}

TEST_CASE("Keyframes are projected alike, onto the scene that they are of") {
    const glm::dvec3 offset = GENERATE(glm::dvec3(0.0), glm::dvec3(1e7, -2e6, 4e6));
    const SmallWorld world = make_world(small_scene(offset));
    const Pair pair = make_pair(world.scene, &world.hierarchy);
    if (pair.device == nullptr) {
        return;
    }
    CulledGeometry geometry(world.hierarchy);
    Agreement sum;
    int keyframe_pixels = 0;
    int same_source = 0;
    for (const int frame : {0, 40, 90}) {
        // Keyframes of two frames earlier and later, of all that is in view from either.
        FramePlan plan = geometry.plan(small_walk(frame, kWidth, kHeight, offset));
        const auto commands = static_cast<std::uint32_t>(plan.commands.size());
        const Pass shown = plan.passes[0];
        plan.pages = {{.page = PageId{0}, .size = 512, .scratch = true}};
        plan.passes.clear();
        for (const int other : {frame - 4, frame + 4}) {
            const auto index = static_cast<std::uint32_t>(plan.keyframes.size());
            const auto page = static_cast<PageId>(index + 1);
            plan.pages.push_back({.page = page, .size = 512, .depth = true});
            Pass pass = shown;
            pass.page = PageId{0};
            pass.view = small_walk(other, kWidth, kHeight, offset);
            pass.batch = index;
            pass.copy_page = page;
            pass.copy = {7, 5, kWidth, kHeight};
            pass.copy_near = 1.0F;
            pass.copy_far = 101.0F;
            plan.passes.push_back(pass);
            Keyframe keyframe;
            keyframe.page = page;
            keyframe.source = pass.copy;
            keyframe.view = pass.view;
            keyframe.copy_near = pass.copy_near;
            keyframe.copy_far = pass.copy_far;
            keyframe.offset_m = 0.01F;
            keyframe.max_shift_px = 1.0F;
            keyframe.node = index;
            plan.keyframes.push_back(keyframe);
        }
        plan.passes.push_back(shown);
        plan.passes.back().batch = 2;
        plan.passes.back().first_command = commands;
        for (std::uint32_t i = 0; i < commands; ++i) {
            Command command = plan.commands[i];
            command.kind = Command::Kind::projected;
            command.keyframe_count = 2;
            plan.commands.push_back(command);
        }
        const Shown rastered = show(*pair.rastered, plan, kWidth, kHeight);
        const Shown cast = show(*pair.cast, plan, kWidth, kHeight);
        // A keyframe's colours change from texel to texel, and pixels that see one by a hair in one
        // of the two do not in the other: a step of depth or a hundredth of a pixel.
        compare(rastered, cast, 8, sum);
        for (std::size_t i = 0; i < cast.positions.texels.size(); ++i) {
            const std::uint32_t node = cast.positions.texels[i].node;
            keyframe_pixels += node != UINT32_MAX ? 1 : 0;
            same_source += node != UINT32_MAX && rastered.positions.texels[i].node == node ? 1 : 0;
        }
    }
    CAPTURE(sum.calm, sum.same_item, sum.same_color, keyframe_pixels, same_source);
    CHECK(sum.calm > 3 * kWidth * kHeight / 4);
    CHECK(keyframe_pixels > 3 * kWidth * kHeight / 8);
    CHECK(same_source > keyframe_pixels * 0.97);
    CHECK(sum.same_item > sum.calm * 0.999);
    CHECK(sum.same_color > sum.same_item * 0.99);
}

namespace {

/// A layered image of what a plan shows from an eye and from beside it, with points.
LayeredDepthImage
layers_of(Backend& backend, FramePlan plan, const Scene& scene, const View& view) {
    LayeredDepthImage image;
    image.view = view;
    image.near_depth = 2.0;
    image.far_depth = 200.0;
    const std::vector<glm::dmat4x3> frames = item_frames(scene);
    const Lens& lens = view.lens;
    std::vector<LayeredSample> samples;
    for (const double aside : {0.0, -1.5, 1.5}) {
        Pass& pass = plan.passes[0];
        pass.view = view;
        pass.view.eye += aside * view.camera_to_world[0];
        const Shown shown = show(backend, plan, view.width, view.height);
        for (int y = 0; y < view.height; ++y) {
            for (int x = 0; x < view.width; ++x) {
                const PositionTexel& texel = shown.positions.texels[index_at(view.width, x, y)];
                if (texel.item == kNone<ItemId>) {
                    continue;
                }
                const glm::dvec3 point =
                    glm::transpose(view.camera_to_world) *
                    (frames[index_of(texel.item)] * glm::dvec4(glm::dvec3(texel.point), 1.0) -
                     view.eye);
                const double u = (point.x / -point.z - lens.left) / (lens.right - lens.left);
                const double v = (point.y / -point.z - lens.bottom) / (lens.top - lens.bottom);
                if (u < 0.0 || u >= 1.0 || v < 0.0 || v >= 1.0) {
                    continue;
                }
                const Color color = color_at(shown.colors, x, y);
                const auto byte = [&](std::size_t i) {
                    return static_cast<std::uint8_t>(color[i]);
                };
                samples.push_back(
                    {.x = static_cast<std::uint16_t>(u * view.width * kLayeredSteps),
                     .y = static_cast<std::uint16_t>(v * view.height * kLayeredSteps),
                     .depth = layered_step(image, -point.z),
                     .extent = 300,
                     .color = {byte(0), byte(1), byte(2), 255}}
                );
                image.points.push_back(texel);
            }
        }
    }
    return make_layers(std::move(image), samples);
}

} // namespace

TEST_CASE("Layered images among geometry look alike, drawn as points, warped and cast") {
    const glm::dvec3 offset = GENERATE(glm::dvec3(0.0), glm::dvec3(1e7, -2e6, 4e6));
    const SmallWorld world = make_world(small_scene(offset));
    const Pair pair = make_pair(world.scene, &world.hierarchy);
    if (pair.device == nullptr) {
        return;
    }
    const auto warping = opengl::OpenGLBackend::create(
        *pair.device->source, {.positions = true, .layers = opengl::LayerDrawing::warped}
    );
    REQUIRE(warping.has_value());
    // Every second tree in the image, the rest and the ground as geometry.
    FramePlan plan;
    std::vector<ItemId> in_image;
    for (std::size_t i = 0; i < world.scene.instances.size(); ++i) {
        (i % 2 == 1 ? in_image : plan.items).push_back(make_id<ItemId>(i));
    }
    const auto view_of = [&](int frame) { return small_walk(frame, kWidth, kHeight, offset); };
    FramePlan source = flat_plan(in_image, view_of(20));
    source.origin = offset;
    const LayeredDepthImage image = layers_of(*pair.cast, source, world.scene, view_of(20));
    plan.origin = offset;
    plan.commands = {items_command(0, static_cast<std::uint32_t>(plan.items.size()))};
    plan.commands.resize(2);
    plan.commands[1].kind = Command::Kind::layers;
    plan.commands[1].count = 1;
    constexpr std::uint32_t kNode = 5;
    plan.layers = {{.image = kLayeredImage, .node = kNode}};
    plan.layered_updates = {{.image = kLayeredImage, .content = &image}};
    const std::vector<glm::dmat4x3> frames = item_frames(world.scene);
    int shown = 0;        // pixels of layers
    int warped_apart = 0; // of those: something else where OpenGL draws what was warped
    int points_apart = 0; // of those: something else where it draws points
    int sample_apart = 0; // of those of points: another sample
    double worst = 0.0;   // from a pixel's centre to its point, beyond the square it must be in
    for (const int frame : {12, 16, 20, 24, 28}) {
        const View view = view_of(frame);
        plan.passes = {flat_plan({}, view).passes[0]};
        plan.passes[0].command_count = 2;
        const Shown points = show(*pair.rastered, plan, kWidth, kHeight);
        const Shown warped = show(**warping, plan, kWidth, kHeight);
        const Shown cast = show(*pair.cast, plan, kWidth, kHeight);
        for (int y = 0; y < kHeight; ++y) {
            for (int x = 0; x < kWidth; ++x) {
                const std::size_t pixel = index_at(kWidth, x, y);
                const PositionTexel& of_cast = cast.positions.texels[pixel];
                const PositionTexel& of_warped = warped.positions.texels[pixel];
                const PositionTexel& of_points = points.positions.texels[pixel];
                if (of_cast.node != kNode) {
                    continue;
                }
                ++shown;
                if (of_warped.node == kNode) {
                    // The same samples, warped by the same arithmetic.
                    REQUIRE(of_warped == of_cast);
                    REQUIRE(color_at(warped.colors, x, y) == color_at(cast.colors, x, y));
                } else {
                    ++warped_apart;
                }
                if (of_points.node != kNode) {
                    ++points_apart;
                    continue;
                }
                sample_apart += of_points.point == of_cast.point ? 0 : 1;
                for (const PositionTexel* texel : {&of_cast, &of_points}) {
                    // A point is less than the diagonal of 1/16 texel from its sample's place,
                    // whose square is 300/256 texels wide.
                    const double within = std::sqrt(0.5) + std::sqrt(2.0) / 16.0 * 256.0 / 300.0;
                    worst = std::max(
                        worst,
                        displacement_px(*texel, x, y, view, frames) -
                            within * static_cast<double>(texel->texel_px)
                    );
                }
            }
        }
    }
    CAPTURE(shown, warped_apart, points_apart, sample_apart, worst);
    CHECK(shown > kWidth * kHeight / 6);
    // Rims of leaves that are geometry: pixels whose centres are so near to an edge that snapping
    // vertices to 1/256 px decides, on either side. Not every pixel of this forest has an edge.
    CHECK(warped_apart <= shown / 128);
    CHECK(points_apart <= shown / 128);
    // Samples that are as near as depths are rounded, and edges of squares through a pixel's
    // centre.
    CHECK(sample_apart <= shown / 512);
    CHECK(worst < kRasterPx);
}
