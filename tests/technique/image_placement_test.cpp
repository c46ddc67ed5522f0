#include "support/allocation_counter.hpp"
#include "support/random.hpp"
#include "technique/placement_world.hpp"
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/gpu/plan_work.hpp>
#include <farfield/math/frustum.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/image_placement.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace farfield;
using farfield::support::PlacementWorld;
using farfield::support::Random;
using farfield::support::TreeKind;

constexpr double kPi = std::numbers::pi;
constexpr std::uint32_t kNone32 = UINT32_MAX;

/// One sample in one texel for every image of a map, and a say in which of them there are.
class FakeImages final : public LayeredImageSource {
  public:
    explicit FakeImages(const PlacementMap& map) : there_(map.images.size(), true) {
        for (const PlacedImage& placed : map.images) {
            LayeredDepthImage image;
            image.view = placed.view;
            image.view.width = 1;
            image.view.height = 1;
            image.near_depth = placed.near_depth;
            image.far_depth = placed.far_depth;
            image.counts = {1};
            image.rows = {0, 1};
            LayeredSample sample;
            sample.color = {10, 20, 30, 255};
            image.samples = {sample};
            REQUIRE(validate(image).has_value());
            images_.push_back(std::move(image));
        }
    }

    void want(std::span<const std::uint32_t> images) noexcept override {
        wanted_count_ = std::min(images.size(), wanted_.size());
        std::copy_n(images.begin(), wanted_count_, wanted_.begin());
        ++calls_;
    }
    const LayeredDepthImage* find(std::uint32_t image) noexcept override {
        return there_[image] ? &images_[image] : nullptr;
    }

    void set_all(bool there) { there_.assign(there_.size(), there); }
    void set(std::uint32_t image, bool there) { there_.at(image) = there; }
    [[nodiscard]] bool has(std::uint32_t image) const { return there_.at(image); }
    [[nodiscard]] std::vector<std::uint32_t> wanted() const {
        return {wanted_.begin(), wanted_.begin() + static_cast<std::ptrdiff_t>(wanted_count_)};
    }
    [[nodiscard]] std::size_t calls() const { return calls_; }

  private:
    std::vector<LayeredDepthImage> images_;
    std::vector<bool> there_;
    std::array<std::uint32_t, 64> wanted_{};
    std::size_t wanted_count_ = 0;
    std::size_t calls_ = 0;
};

PlacementWorld small_forest(TreeKind kind = TreeKind::bsp, const glm::dvec3& offset = {}) {
    return support::make_world(
        {.trees = 120, .ground_cells = 12, .seed = 3, .offset = offset}, kind
    );
}

PlacementOptions forest_options() {
    PlacementOptions options;
    options.max_primitives = 900'000;
    options.first_grid = 4;
    options.max_level = 4;
    return options;
}

/// A world with its map, and a technique with all images in memory.
struct Placed {
    PlacementWorld world;
    PlacementMap map;
    std::unique_ptr<FakeImages> images;
    std::unique_ptr<ImagePlacement> technique;

    Placed(
        PlacementWorld with,
        const PlacementOptions& options,
        const ImagePlacementOptions& run_time = {}
    )
        : world(std::move(with)) {
        SerialExecutor executor;
        auto built = build_placement(world.forest.hierarchy, options, executor);
        if (!built) {
            FAIL(built.error().message);
        }
        map = std::move(*built);
        images = std::make_unique<FakeImages>(map);
        auto made = ImagePlacement::create(world.forest.hierarchy, map, *images, run_time);
        if (!made) {
            FAIL(made.error().message);
        }
        technique = std::make_unique<ImagePlacement>(std::move(*made));
    }
};

/// How often a plan draws each item and each primitive of the ground.
struct Drawn {
    std::vector<int> items;
    std::vector<int> ground;
};

Drawn drawn_by(const FramePlan& plan, const PlacementWorld& world) {
    Drawn drawn{
        std::vector<int>(world.forest.objects.size()),
        std::vector<int>(world.forest.ground.size())};
    for (const Command& command : plan.commands) {
        if (!draws_geometry(command)) {
            continue;
        }
        for (std::uint32_t i = 0; i < command.count; ++i) {
            ++drawn.items.at(index_of(plan.items.at(command.first + i)));
        }
        for (std::uint32_t i = 0; i < command.piece_count; ++i) {
            const Piece& piece = plan.pieces.at(command.first_piece + i);
            for (std::uint32_t p = piece.first; p < piece.first + piece.count; ++p) {
                ++drawn.ground.at(world.forest.hierarchy.primitives.at(p));
            }
        }
    }
    return drawn;
}

/// What an image shows, as `Drawn`.
Drawn replaced_by(const Placed& placed, std::uint32_t image) {
    const Hierarchy& tree = placed.world.forest.hierarchy;
    Drawn drawn{
        std::vector<int>(placed.world.forest.objects.size()),
        std::vector<int>(placed.world.forest.ground.size())};
    if (image == kNone32) {
        return drawn;
    }
    const PlacedImage& shown = placed.map.images.at(image);
    for (std::uint32_t k = 0; k < shown.cell_count; ++k) {
        const PlacementCell& cell =
            placed.map.cells.at(placed.map.replaced.at(shown.first_cell + k));
        const HierarchyNode& node = tree.nodes.at(cell.node);
        for (std::uint32_t i = 0; i < node.item_count; ++i) {
            ++drawn.items.at(index_of(tree.items.at(node.first_item + i)));
        }
        for (std::uint32_t i = 0; i < node.piece_count; ++i) {
            const Piece& piece = tree.pieces.at(node.first_piece + i);
            for (std::uint32_t p = piece.first; p < piece.first + piece.count; ++p) {
                ++drawn.ground.at(tree.primitives.at(p));
            }
        }
    }
    return drawn;
}

/// True where the box certainly meets the frustum: one of its 3^3 grid points lies inside by more
/// than the rounding of plane distances (coordinates below 1000 m, an ulp is 6e-5 m).
bool surely_seen(const Frustum& frustum, const Box3f& box) {
    constexpr float kRounding = 1e-3F;
    for (int index = 0; index < 27; ++index) {
        const int layer = index / 9;
        const glm::vec3 fraction = glm::vec3(index % 3, index / 3 % 3, layer) / 2.0F;
        const glm::vec3 point = glm::mix(box.lo, box.hi, fraction);
        const bool inside =
            std::all_of(frustum.planes.begin(), frustum.planes.end(), [&](const Plane& plane) {
                return signed_distance(plane, point) > kRounding;
            });
        if (inside) {
            return true;
        }
    }
    return false;
}

/// All that is surely in view is drawn or replaced, and nothing is both, or twice.
void check_cover(const Placed& placed, const View& view, const FramePlan& plan) {
    const PlacementWorld& world = placed.world;
    const glm::dvec3& origin = world.forest.hierarchy.origin;
    const Drawn drawn = drawn_by(plan, world);
    const Drawn replaced = replaced_by(placed, placed.technique->statistics().image);
    const Frustum frustum = make_frustum(view, origin);
    for (std::size_t item = 0; item < drawn.items.size(); ++item) {
        const Object& object = world.forest.objects[item];
        const int times = drawn.items[item] + replaced.items[item];
        CAPTURE(item);
        REQUIRE(times <= 1);
        if (!object.splittable && surely_seen(frustum, local_box(object.bounds, origin))) {
            REQUIRE(times == 1);
        }
    }
    for (std::size_t triangle = 0; triangle < drawn.ground.size(); ++triangle) {
        const int times = drawn.ground[triangle] + replaced.ground[triangle];
        CAPTURE(triangle);
        REQUIRE(times <= 1);
        if (surely_seen(frustum, local_box(world.forest.ground[triangle], origin))) {
            REQUIRE(times == 1);
        }
    }
}

View view_of(const PlacementMap& map, const glm::dvec3& eye, double yaw, double pitch = 0.0) {
    const PlacementOptions& options = map.options;
    return level_view(
        yaw_frame(options.up),
        eye,
        yaw,
        pitch,
        {.lens = options.lens, .width = options.width, .height = options.height}
    );
}

/// Turns a view about its own axis.
View rolled(View view, double angle) {
    const glm::dmat3 axes = view.camera_to_world;
    view.camera_to_world[0] = std::cos(angle) * axes[0] + std::sin(angle) * axes[1];
    view.camera_to_world[1] = std::cos(angle) * axes[1] - std::sin(angle) * axes[0];
    return view;
}

/// A part of a view's window. @param least side of it, of the whole
View narrowed(Random& random, View view, double least) {
    const Lens whole = view.lens;
    const double wide = random.uniform(least, 1.0);
    const double high = random.uniform(least, 1.0);
    const double x = random.uniform(0.0, 1.0 - wide);
    const double y = random.uniform(0.0, 1.0 - high);
    view.lens.left = whole.left + x * (whole.right - whole.left);
    view.lens.right = whole.left + (x + wide) * (whole.right - whole.left);
    view.lens.bottom = whole.bottom + y * (whole.top - whole.bottom);
    view.lens.top = whole.bottom + (y + high) * (whole.top - whole.bottom);
    return view;
}

/// A view that a map serves: from anywhere, half of them from the rims of sites, in any direction,
/// half of them where ranges end; some through a part of the window, some rolled.
View random_view(Random& random, const PlacementMap& map) {
    const PlacementSite& site = map.sites[random.below(static_cast<unsigned>(map.sites.size()))];
    const bool on_rim = random.below(2) == 0;
    glm::dvec3 eye(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        const double share =
            on_rim ? static_cast<double>(random.below(2)) : random.uniform(0.0, 1.0);
        eye[axis] = site.eyes.lo[axis] + share * (site.eyes.hi[axis] - site.eyes.lo[axis]);
    }
    eye = glm::min(glm::max(eye, map.options.eyes.lo), map.options.eyes.hi);
    double yaw = random.uniform(-kPi, kPi);
    if (random.below(2) == 0) {
        const double off = std::pow(10.0, random.uniform(-12.0, -5.0));
        yaw = map.ranges[site.first_range + random.below(site.range_count)].yaw +
              (random.below(2) == 0 ? off : -off);
    }
    const View whole = view_of(map, eye, yaw, map.options.max_pitch * random.uniform(-1.0, 1.0));
    switch (random.below(3)) {
    case 0:
        return whole;
    case 1:
        return narrowed(random, whole, 0.05);
    default:
        while (true) {
            const View turned = rolled(narrowed(random, whole, 0.05), random.uniform(-0.5, 0.5));
            if (find(map, turned).refusal == PlacementRefusal::none) {
                return turned;
            }
        }
    }
}

/// A view from the middle of an image's site in the middle of a range that shows it.
View view_for(const PlacementMap& map, std::uint32_t image) {
    const PlacementSite& site = map.sites[map.images.at(image).site];
    for (std::uint32_t i = 0; i < site.range_count; ++i) {
        const std::uint32_t range = site.first_range + i;
        if (map.ranges[range].image == image) {
            const double to = i + 1 < site.range_count ? map.ranges[range + 1].yaw : kPi;
            return view_of(map, center(site.eyes), 0.5 * (map.ranges[range].yaw + to));
        }
    }
    FAIL("image " << image << " is in no range");
    return {};
}

/// A site that has at least so many images, with them.
std::pair<std::uint32_t, std::set<std::uint32_t>>
site_with_images(const PlacementMap& map, std::size_t least) {
    for (std::uint32_t i = 0; i < map.sites.size(); ++i) {
        std::set<std::uint32_t> images;
        for (std::uint32_t k = 0; k < map.sites[i].range_count; ++k) {
            const std::uint32_t image = map.ranges[map.sites[i].first_range + k].image;
            if (image != kNone32) {
                images.insert(image);
            }
        }
        if (images.size() >= least) {
            return {i, images};
        }
    }
    FAIL("no site has " << least << " images");
    return {};
}

std::size_t count_of(const FramePlan& plan, LayeredUpdate::Action action) {
    return static_cast<std::size_t>(std::count_if(
        plan.layered_updates.begin(),
        plan.layered_updates.end(),
        [&](const LayeredUpdate& update) { return update.action == action; }
    ));
}

/// Whatever is asked of a plan of a view that is served, all images in memory.
void check_served(Placed& placed, const View& view, const FramePlan& plan, bool thoroughly) {
    const ImagePlacementStatistics& statistics = placed.technique->statistics();
    const PlacedView found = find(placed.map, view);
    REQUIRE(found.refusal == PlacementRefusal::none);
    REQUIRE(statistics.refusal == PlacementRefusal::none);
    REQUIRE_FALSE(statistics.missed);
    REQUIRE(statistics.site == found.site);
    const PlacementRange& range = placed.map.ranges[found.range];
    REQUIRE(statistics.image == range.image);
    const PlanWork work = work_of(plan, placed.world.item_primitives);
    REQUIRE(work.triangles == statistics.primitives);
    REQUIRE(work.triangles <= range.primitives);
    REQUIRE(work.triangles <= placed.map.options.max_primitives);
    const bool shows = range.image != kNone32;
    REQUIRE(work.layered_images == (shows ? 1 : 0));
    REQUIRE(statistics.samples == (shows ? 1 : 0));
    REQUIRE(plan.layers.size() == (shows ? 1 : 0));
    REQUIRE(plan.passes.size() == 1);
    REQUIRE(plan.passes[0].view == view);
    REQUIRE(plan.passes[0].command_count == plan.commands.size());
    REQUIRE(statistics.handed_over == (count_of(plan, LayeredUpdate::Action::create) == 1));
    if (thoroughly) {
        check_cover(placed, view, plan);
    }
}

} // namespace

TEST_CASE("what cannot work is refused by name and value") {
    const Placed placed(small_forest(), forest_options());
    const Hierarchy& tree = placed.world.forest.hierarchy;
    struct Bad {
        const char* says = "";
        ImagePlacementOptions options;
    };
    for (const Bad& bad :
         {Bad{"resident_images is 0", {.resident_images = 0}},
          Bad{"resident_images is 65", {.resident_images = 65}},
          Bad{"prefetch_frames is 1001", {.prefetch_frames = 1001}}}) {
        const auto made = ImagePlacement::create(tree, placed.map, *placed.images, bad.options);
        REQUIRE_FALSE(made.has_value());
        CHECK(made.error().code == ErrorCode::invalid_argument);
        CAPTURE(made.error().message);
        CHECK(made.error().message.find(bad.says) != std::string::npos);
    }
    CHECK(ImagePlacement::create(
              tree, placed.map, *placed.images, {.resident_images = 64, .prefetch_frames = 1000}
    )
              .has_value());
    const PlacementWorld other = small_forest(TreeKind::octree);
    const auto made = ImagePlacement::create(other.forest.hierarchy, placed.map, *placed.images);
    REQUIRE_FALSE(made.has_value());
    CHECK(made.error().code == ErrorCode::bad_data);
}

TEST_CASE("no view that is served renders more than its range says, and none lacks anything") {
    struct Case {
        TreeKind kind = TreeKind::bsp;
        double max_pitch = 0.0;
        std::uint64_t budget = 0;
        glm::dvec3 offset{0.0};
    };
    const std::array<Case, 6> cases = {
        {{TreeKind::bsp, 0.0, 900'000, {}},
         {TreeKind::kdtree, 0.0, 900'000, {}},
         {TreeKind::octree, 0.0, 700'000, {}},
         {TreeKind::bsp, 0.5, 1'100'000, {}},
         {TreeKind::octree, 0.2, 900'000, {}},
         {TreeKind::bsp, 0.0, 900'000, {1e7, -2e6, 1e7}}}};
    for (std::size_t number = 0; number < cases.size(); ++number) {
        const Case& now = cases[number];
        PlacementOptions options = forest_options();
        options.max_primitives = now.budget;
        options.max_pitch = now.max_pitch;
        Placed placed(small_forest(now.kind, now.offset), options);
        REQUIRE(placed.map.images.size() > 10);
        NullBackend backend(placed.world.item_primitives, &placed.world.forest.hierarchy);
        const TargetId target = backend.create_target(640, 480, 1).value();
        Random random(100 + number);
        std::size_t with_image = 0;
        for (int i = 0; i < 5000; ++i) {
            const View view = random_view(random, placed.map);
            CAPTURE(number, i);
            const Motion motion{.velocity = random.vector(-10.0, 10.0)};
            const FramePlan& plan = placed.technique->plan(view, motion);
            check_served(placed, view, plan, i % 5 == 0);
            with_image += plan.layers.size();
            const Result<void> done = backend.execute(plan, target, {});
            if (!done) {
                FAIL(done.error().message);
            }
        }
        CHECK(with_image > 1000);
    }
}

TEST_CASE("ground alone is placed as pieces") {
    PlacementOptions options;
    options.max_primitives = 1500;
    options.max_level = 3;
    options.eyes = {{-64.0, 1.0, -64.0}, {64.0, 5.0, 64.0}};
    for (const TreeKind kind : {TreeKind::bsp, TreeKind::kdtree, TreeKind::octree}) {
        Placed placed(
            support::make_world({.trees = 0, .radius = 256.0, .ground_cells = 48}, kind), options
        );
        CAPTURE(static_cast<int>(kind));
        REQUIRE_FALSE(placed.map.images.empty());
        Random random(7);
        for (int i = 0; i < 1000; ++i) {
            const View view = random_view(random, placed.map);
            check_served(placed, view, placed.technique->plan(view, {}), i % 5 == 0);
        }
    }
}

TEST_CASE("what the planes of run time round is within the bound") {
    // Two cubes with edges that are a little farther apart than the lens is wide: no view has both,
    // but the planes of some views, which are float, let both through.
    Random random(8);
    std::size_t both = 0;
    for (int run = 0; run < 300; ++run) {
        const double tangent = random.uniform(0.4, 2.0);
        const double fov = 2.0 * std::atan(tangent);
        const double first = random.uniform(-3.0, 3.0 - fov);
        const double gap = std::pow(10.0, random.uniform(-8.5, -6.5));
        // Right at yaw y is (cos y, 0, sin y), forward (sin y, 0, -cos y).
        const auto towards = [](double yaw) {
            return glm::dvec3(std::sin(yaw), 0, -std::cos(yaw));
        };
        // The corner of an axis-aligned box that is the last to leave has the sign of the plane's
        // normal: the box is made to have that corner on the ray.
        const auto box_at = [&](double yaw, double normal_yaw) {
            const glm::dvec3 corner_at = random.uniform(50.0, 500.0) * towards(yaw);
            const glm::dvec3 normal = towards(normal_yaw);
            glm::dvec3 size(random.uniform(1.0, 9.0), 0.0, random.uniform(1.0, 9.0));
            size.x *= normal.x > 0.0 ? -1.0 : 1.0;
            size.z *= normal.z > 0.0 ? -1.0 : 1.0;
            const glm::dvec3 other = corner_at + size;
            const glm::dvec3 high(0.0, 1.0, 0.0);
            return Box3d{glm::min(corner_at, other) - high, glm::max(corner_at, other) + high};
        };
        const double second = first + fov + gap;
        const Box3d left = box_at(first, first + 0.5 * kPi);
        const Box3d right = box_at(second, second - 0.5 * kPi);
        if (!is_empty(intersect(left, right))) {
            continue;
        }
        PlacementOptions options;
        options.lens = {-tangent, tangent, -1.0, 1.0, 0.1, 1e4};
        options.eyes = {glm::dvec3(0.0), glm::dvec3(0.0)};
        options.max_primitives = 1'000'000;
        Placed placed(support::make_cubes({left, right}, 100), options);
        for (int i = 0; i < 9; ++i) {
            const double yaw = 0.5 * (first + second) + 0.25 * gap * (i - 4);
            const View view = view_of(placed.map, glm::dvec3(0.0), yaw);
            CAPTURE(run, i, yaw, gap);
            check_served(placed, view, placed.technique->plan(view, {}), false);
            both += placed.technique->statistics().primitives == 200 ? 1U : 0U;
        }
    }
    // Else this test would say nothing.
    CHECK(both > 50);
}

TEST_CASE("a view that is not served is plain geometry, and says why") {
    PlacementOptions options = forest_options();
    options.max_pitch = 0.2;
    options.max_primitives = 1'000'000;
    options.cell_depth = 24;
    options.eyes = {{-100.0, 1.0, -100.0}, {100.0, 9.0, 100.0}};
    Placed placed(small_forest(), options);
    REQUIRE(placed.map.images.size() > 10);
    Random random(9);
    CulledGeometry culled(placed.world.forest.hierarchy, GeometryOrder::front_to_back);
    const auto check = [&](const View& view, PlacementRefusal why) {
        REQUIRE(validate(view).has_value());
        const FramePlan& plan = placed.technique->plan(view, {});
        const ImagePlacementStatistics& statistics = placed.technique->statistics();
        REQUIRE(statistics.refusal == why);
        REQUIRE(statistics.image == kNone32);
        REQUIRE_FALSE(statistics.missed);
        REQUIRE(statistics.samples == 0);
        REQUIRE(plan.layers.empty());
        REQUIRE(plan.layered_updates.empty());
        REQUIRE(work_of(plan, placed.world.item_primitives).triangles == statistics.primitives);
        check_cover(placed, view, plan);
        // Cells are leaves here: at least what the baseline draws, and nothing that is out of view.
        const Drawn mine = drawn_by(plan, placed.world);
        const FramePlan& baseline = culled.plan(view);
        const Drawn its = drawn_by(baseline, placed.world);
        for (std::size_t i = 0; i < mine.items.size(); ++i) {
            REQUIRE(mine.items[i] >= its.items[i]);
        }
        for (std::size_t i = 0; i < mine.ground.size(); ++i) {
            REQUIRE(mine.ground[i] >= its.ground[i]);
        }
        // In the same order, front to back.
        std::size_t met = 0;
        for (const ItemId item : plan.items) {
            met += met < baseline.items.size() && baseline.items[met] == item ? 1U : 0U;
        }
        REQUIRE(met == baseline.items.size());
        std::uint64_t in_view = 0;
        const Frustum frustum = make_frustum(view, placed.world.forest.hierarchy.origin);
        for (const PlacementCell& cell : placed.map.cells) {
            in_view += classify(frustum, cell.box) != Overlap::outside ? cell.primitives : 0;
        }
        REQUIRE(statistics.primitives == in_view);
    };
    for (int i = 0; i < 50; ++i) {
        const double yaw = random.uniform(-kPi, kPi);
        const glm::dvec3 eye(
            random.uniform(-100.0, 100.0), random.uniform(1.0, 9.0), random.uniform(-100.0, 100.0)
        );
        for (int axis = 0; axis < 3; ++axis) {
            for (const double by : {1e-9, 50.0}) {
                glm::dvec3 out = eye;
                out[axis] = options.eyes.hi[axis] + by;
                check(view_of(placed.map, out, yaw), PlacementRefusal::outside);
                out[axis] = options.eyes.lo[axis] - by;
                check(view_of(placed.map, out, yaw), PlacementRefusal::outside);
            }
        }
        for (const double pitch : {0.2 + 1e-6, 1.5, -0.2 - 1e-6, -1.5}) {
            check(view_of(placed.map, eye, yaw, pitch), PlacementRefusal::pitch);
        }
        for (const double by : {1e-6, 1.0}) {
            View wide = view_of(placed.map, eye, yaw);
            wide.lens.left -= by;
            check(wide, PlacementRefusal::window);
            wide = view_of(placed.map, eye, yaw);
            wide.lens.right += by;
            check(wide, PlacementRefusal::window);
            wide = view_of(placed.map, eye, yaw);
            wide.lens.bottom -= by;
            check(wide, PlacementRefusal::window);
            wide = view_of(placed.map, eye, yaw);
            wide.lens.top += by;
            check(wide, PlacementRefusal::window);
        }
        for (const double roll : {1e-6, -1e-6, 0.5 * kPi, kPi / 3.0}) {
            check(rolled(view_of(placed.map, eye, yaw), roll), PlacementRefusal::window);
        }
        // Upside down the window of a lens on its axis is the same.
        const View turned = rolled(view_of(placed.map, eye, yaw), kPi);
        check_served(placed, turned, placed.technique->plan(turned, {}), true);
        // So it is with a smaller one that is rolled a little, and right at the ends.
        View small = view_of(placed.map, eye, yaw, i % 2 == 0 ? 0.2 : -0.2);
        check_served(placed, small, placed.technique->plan(small, {}), true);
        small.lens = {-0.3, 0.3, -0.3, 0.3, 0.1, 1000.0};
        small = rolled(small, 0.7);
        check_served(placed, small, placed.technique->plan(small, {}), true);
    }
    // Looking straight up there is no yaw, and no need of one.
    check(view_of(placed.map, {0.0, 5.0, 0.0}, 0.0, 0.5 * kPi), PlacementRefusal::pitch);
}

TEST_CASE("a very wide lens that looks up steeply is served, a higher one is not") {
    PlacementOptions options = forest_options();
    options.max_pitch = 1.2;
    options.lens = {-15.0, 15.0, -15.0, 15.0, 0.1, 1e4};
    options.max_primitives = 100'000'000;
    Placed placed(small_forest(), options);
    const glm::dvec3 eye = center(placed.map.options.eyes);
    View view = view_of(placed.map, eye, 0.3, 1.0);
    CHECK(find(placed.map, view).refusal == PlacementRefusal::none);
    view.lens.top = 16.0;
    CHECK(find(placed.map, view).refusal == PlacementRefusal::window);
}

TEST_CASE("an image that is not there is missed, and never waited for") {
    Placed placed(small_forest(), forest_options());
    placed.images->set_all(false);
    Random random(10);
    std::size_t missed = 0;
    for (int i = 0; i < 300; ++i) {
        const View view = random_view(random, placed.map);
        const FramePlan& plan = placed.technique->plan(view, {});
        const ImagePlacementStatistics& statistics = placed.technique->statistics();
        const PlacedView found = find(placed.map, view);
        REQUIRE(statistics.missed == (placed.map.ranges[found.range].image != kNone32));
        REQUIRE(statistics.refusal == PlacementRefusal::none);
        REQUIRE(statistics.image == kNone32);
        REQUIRE(plan.layers.empty());
        REQUIRE(work_of(plan, placed.world.item_primitives).triangles == statistics.primitives);
        check_cover(placed, view, plan);
        missed += statistics.missed ? 1U : 0U;
    }
    CHECK(missed > 50);
}

TEST_CASE("in place of an image that is not there the best other one of the site is shown") {
    PlacementOptions options = forest_options();
    options.max_primitives = 600'000;
    Placed placed(small_forest(), options);
    Random random(11);
    std::size_t others = 0;
    std::size_t none = 0;
    for (int i = 0; i < 1000; ++i) {
        const View view = random_view(random, placed.map);
        const PlacedView found = find(placed.map, view);
        const std::uint32_t right = placed.map.ranges[found.range].image;
        if (right == kNone32) {
            continue;
        }
        for (std::uint32_t image = 0; image < placed.map.images.size(); ++image) {
            placed.images->set(image, image != right && random.below(2) == 0);
        }
        // What each of the others that are there would leave, and what none does.
        placed.images->set(right, false);
        const FramePlan& plan = placed.technique->plan(view, {});
        const ImagePlacementStatistics statistics = placed.technique->statistics();
        REQUIRE(statistics.missed);
        REQUIRE(plan.layers.size() == (statistics.image == kNone32 ? 0 : 1));
        REQUIRE(work_of(plan, placed.world.item_primitives).triangles == statistics.primitives);
        check_cover(placed, view, plan);
        const Frustum inner = make_frustum(view, placed.map.origin);
        const Frustum outer = make_frustum(found.around, placed.map.origin);
        const auto left_with = [&](std::uint32_t image) {
            std::vector<bool> without(placed.map.cells.size(), false);
            if (image != kNone32) {
                const PlacedImage& its = placed.map.images[image];
                for (std::uint32_t k = 0; k < its.cell_count; ++k) {
                    without.at(placed.map.replaced.at(its.first_cell + k)) = true;
                }
            }
            std::uint64_t left = 0;
            for (std::size_t c = 0; c < without.size(); ++c) {
                const PlacementCell& cell = placed.map.cells[c];
                left += !without[c] && classify(inner, cell.box) != Overlap::outside &&
                                classify(outer, cell.box) != Overlap::outside
                            ? cell.primitives
                            : 0;
            }
            return left;
        };
        std::uint64_t least = left_with(kNone32);
        bool helps = false;
        const PlacementSite& site = placed.map.sites[found.site];
        for (std::uint32_t k = 0; k < site.range_count; ++k) {
            const std::uint32_t image = placed.map.ranges[site.first_range + k].image;
            if (image != kNone32 && placed.images->has(image) && left_with(image) < least) {
                least = left_with(image);
                helps = true;
            }
        }
        CAPTURE(i);
        REQUIRE(statistics.primitives == least);
        // One that hides nothing is not worth handing over.
        REQUIRE((statistics.image != kNone32) == helps);
        if (statistics.image != kNone32) {
            REQUIRE(placed.map.images[statistics.image].site == found.site);
            REQUIRE(placed.images->has(statistics.image));
            ++others;
        } else {
            ++none;
        }
    }
    CHECK(others > 50);
    CHECK(none > 20);
}

TEST_CASE("an image is handed over once, and the least used one makes room") {
    Placed placed(small_forest(), forest_options(), {.resident_images = 2});
    const auto [site, set] = site_with_images(placed.map, 3);
    const std::vector<std::uint32_t> images(set.begin(), set.end());
    NullBackend backend(placed.world.item_primitives, &placed.world.forest.hierarchy);
    const TargetId target = backend.create_target(640, 480, 1).value();
    const auto show = [&](std::size_t which) {
        const View view = view_for(placed.map, images[which]);
        const FramePlan& plan = placed.technique->plan(view, {});
        check_served(placed, view, plan, false);
        REQUIRE(placed.technique->statistics().image == images[which]);
        REQUIRE(backend.execute(plan, target, {}).has_value());
        const bool handed = placed.technique->statistics().handed_over;
        if (handed) {
            REQUIRE(plan.layered_updates.back().image == plan.layers[0].image);
            REQUIRE(plan.layered_updates.back().content == placed.images->find(images[which]));
            REQUIRE(index_of(plan.layers[0].image) < 2);
        } else {
            REQUIRE(plan.layered_updates.empty());
        }
        return handed;
    };
    CHECK(show(0));
    CHECK_FALSE(show(0));
    CHECK(show(1));
    CHECK_FALSE(show(0));
    CHECK_FALSE(show(1));
    CHECK_FALSE(show(0));
    CHECK(show(2)); // in place of 1
    CHECK_FALSE(show(0));
    CHECK(show(1)); // in place of 2
    CHECK_FALSE(show(0));
    CHECK(show(2));
    CHECK_FALSE(show(2));
    // What the backend has lost is handed over again, and dropped before.
    placed.technique->forget_images();
    const View view = view_for(placed.map, images[0]);
    const FramePlan& plan = placed.technique->plan(view, {});
    CHECK(count_of(plan, LayeredUpdate::Action::destroy) == 2);
    CHECK(count_of(plan, LayeredUpdate::Action::create) == 1);
    CHECK(plan.layered_updates.back().action == LayeredUpdate::Action::create);
    CHECK(placed.technique->statistics().handed_over);
    REQUIRE(backend.execute(plan, target, {}).has_value());
    CHECK_FALSE(show(0));
    CHECK(show(2));
}

TEST_CASE("after a plan that failed images are handed over again") {
    Placed placed(small_forest(), forest_options());
    const auto [site, images] = site_with_images(placed.map, 1);
    const View view = view_for(placed.map, *images.begin());
    NullBackend backend(placed.world.item_primitives, &placed.world.forest.hierarchy);
    const TargetId target = backend.create_target(640, 480, 1).value();
    REQUIRE(backend.execute(placed.technique->plan(view, {}), target, {}).has_value());
    FramePlan broken = placed.technique->plan(view, {});
    broken.layers[0].image = make_id<LayeredImageId>(63);
    REQUIRE_FALSE(backend.execute(broken, target, {}).has_value());
    // The backend has forgotten; one that is not told is found out.
    REQUIRE_FALSE(backend.execute(placed.technique->plan(view, {}), target, {}).has_value());
    placed.technique->forget_images();
    REQUIRE(backend.execute(placed.technique->plan(view, {}), target, {}).has_value());
    REQUIRE(backend.execute(placed.technique->plan(view, {}), target, {}).has_value());
}

TEST_CASE("images are asked for by urgency: this one, those ahead, those beside") {
    Placed placed(small_forest(), forest_options(), {.prefetch_frames = 60});
    const PlacementMap& map = placed.map;
    Random random(12);
    std::size_t ahead_at_all = 0;
    std::size_t beside_at_all = 0;
    for (int i = 0; i < 500; ++i) {
        const View view = random_view(random, map);
        // The box of eyes is much wider than high.
        const glm::dvec3 velocity = random.vector(-60.0, 60.0) * glm::dvec3(1.0, 0.02, 1.0);
        const Motion motion{.velocity = velocity, .frame_seconds = 1.0 / 60.0};
        std::vector<std::uint32_t> expected;
        const auto add = [&](std::uint32_t image) {
            if (image != kNone32 &&
                std::find(expected.begin(), expected.end(), image) == expected.end()) {
                expected.push_back(image);
            }
        };
        const PlacedView found = find(map, view);
        add(map.ranges[found.range].image);
        const std::size_t now = expected.size();
        for (const double seconds : {0.5, 1.0}) {
            View then = view;
            then.eye += seconds * motion.velocity;
            const PlacedView ahead = find(map, then);
            if (ahead.refusal == PlacementRefusal::none) {
                add(map.ranges[ahead.range].image);
            }
        }
        ahead_at_all += expected.size() - now;
        const std::size_t before = expected.size();
        const PlacementSite& site = map.sites[found.site];
        const std::uint32_t last = site.first_range + site.range_count - 1;
        add(map.ranges[found.range == last ? site.first_range : found.range + 1].image);
        add(map.ranges[found.range == site.first_range ? last : found.range - 1].image);
        beside_at_all += expected.size() - before;
        const std::size_t calls = placed.images->calls();
        static_cast<void>(placed.technique->plan(view, motion));
        REQUIRE(placed.images->calls() == calls + 1);
        REQUIRE(placed.images->wanted() == expected);
    }
    CHECK(ahead_at_all > 50);
    CHECK(beside_at_all > 50);
    // From outside only what is ahead is asked for.
    View outside = view_for(map, 0);
    const double way = 2.0 * glm::length(extent(map.options.eyes));
    outside.eye.y += way;
    static_cast<void>(placed.technique->plan(outside, {}));
    CHECK(placed.images->wanted().empty());
    static_cast<void>(
        placed.technique->plan(outside, {.velocity = {0.0, -way, 0.0}, .frame_seconds = 1.0 / 60.0})
    );
    CHECK(placed.images->wanted() == std::vector<std::uint32_t>{0});
}

TEST_CASE("equal views make equal plans") {
    Placed a(small_forest(), forest_options());
    Placed b(small_forest(), forest_options());
    Random random(13);
    for (int i = 0; i < 300; ++i) {
        const View view = random_view(random, a.map);
        REQUIRE(a.technique->statistics().site == b.technique->statistics().site);
        const std::uint64_t mine = digest(a.technique->plan(view, {}));
        REQUIRE(mine == digest(b.technique->plan(view, {})));
    }
}

TEST_CASE("what moves is drawn where it is, whatever an image replaces") {
    Placed placed(small_forest(), forest_options());
    Hierarchy& tree = placed.world.forest.hierarchy;
    const View view = view_for(placed.map, 0);
    static_cast<void>(placed.technique->plan(view, {}));
    // The first item that the image replaces steps before the eye, 5 m away.
    const Drawn replaced = replaced_by(placed, 0);
    const auto at = std::find(replaced.items.begin(), replaced.items.end(), 1);
    REQUIRE(at != replaced.items.end());
    const auto item = make_id<ItemId>(static_cast<std::size_t>(at - replaced.items.begin()));
    const glm::dvec3 place = view.eye - 5.0 * view.camera_to_world[2];
    REQUIRE(partition::update_bounds(tree, item, {place - 1.0, place + 1.0}).has_value());
    const auto is_drawn = [&](const View& from) {
        const FramePlan& plan = placed.technique->plan(from, {});
        return std::count(plan.items.begin(), plan.items.end(), item);
    };
    CHECK(is_drawn(view) == 1);
    CHECK(placed.technique->statistics().image == 0);
    CHECK(is_drawn(rolled(view, 0.5)) == 1); // not served: the same
    View back = view;
    back.camera_to_world[0] = -view.camera_to_world[0];
    back.camera_to_world[2] = -view.camera_to_world[2];
    CHECK(is_drawn(back) == 0);
}

TEST_CASE("planning allocates nothing once warm") {
    Placed placed(small_forest(), forest_options(), {.resident_images = 3});
    Random random(14);
    std::vector<View> views;
    std::vector<std::uint64_t> digests;
    for (int i = 0; i < 400; ++i) {
        views.push_back(random_view(random, placed.map));
        if (i % 10 == 0) {
            views.push_back(rolled(views.back(), 0.5 * kPi));
        }
    }
    const Motion motion{.velocity = {5.0, 0.0, 3.0}};
    const auto walk = [&] {
        for (std::size_t i = 0; i < views.size(); ++i) {
            placed.images->set_all(i % 3 != 0);
            if (i % 50 == 49) {
                placed.technique->forget_images();
            }
            static_cast<void>(placed.technique->plan(views[i], motion));
        }
    };
    walk();
    const std::uint64_t before = support::allocation_count();
    walk();
    CHECK(support::allocation_count() == before);
}
