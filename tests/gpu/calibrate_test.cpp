#include "support/small_scene.hpp"
#include <farfield/gpu/calibrate.hpp>
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/gpu/plan_work.hpp>
#include <farfield/partition/changes.hpp>

#include <catch2/catch.hpp>
#include <glm/common.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

/// Checks plans as the null backend does, and takes the time that a cost model says on a clock of
/// its own.
class ModelBackend final : public Backend {
  public:
    ModelBackend(const SmallWorld& world, const CostModel& model, double frame_s)
        : checker_(world.item_primitives, &world.hierarchy), primitives_(world.item_primitives),
          origin_(world.hierarchy.origin), model_(model), frame_s_(frame_s) {
        if (!world.hierarchy.nodes.empty()) {
            box_ = bounds(world.hierarchy.nodes[0]);
        }
    }

    [[nodiscard]] Result<void>
    execute(const FramePlan& plan, TargetId target, const FrameClear& clear) noexcept override {
        ++executed_;
        if (executed_ == fail_at) {
            return fail(ErrorCode::device, "the device is on fire");
        }
        const PlanWork work = work_of(plan, primitives_);
        double seconds = frame_s_ + model_.triangle_s * static_cast<double>(work.triangles) +
                         model_.pass_s * static_cast<double>(work.images) +
                         model_.texel_s * static_cast<double>(work.image_texels) +
                         model_.splat_s * static_cast<double>(work.splats) +
                         model_.cube_s * static_cast<double>(work.cubes);
        for (const Pass& pass : plan.passes) {
            for (std::uint32_t c = 0; c < pass.command_count; ++c) {
                const Command& command = plan.commands[pass.first_command + c];
                if (draws_cells(command)) {
                    continue;
                }
                if (draws_geometry(command)) {
                    seconds += model_.geometry_pixel_s * covered_pixels(pass.view);
                    seconds += model_.draw_call_s * (command.count + command.piece_count);
                    continue;
                }
                for (std::uint32_t q = 0; q < command.count; ++q) {
                    // Texels are pixels in plans that calibrate.
                    const Region& source = plan.quads[command.first + q].source;
                    seconds += image_cost(model_, static_cast<double>(area(source)));
                }
            }
        }
        // What else runs on a machine: a late frame now and then, a bit of noise always.
        if (executed_ % 5 == 0) {
            seconds += disturbance_s;
        }
        clock_s += seconds * (1.0 + noise * std::sin(static_cast<double>(executed_)));
        return checker_.execute(plan, target, clear);
    }
    void finish() noexcept override {}
    [[nodiscard]] Result<TargetId>
    create_target(std::int32_t width, std::int32_t height, std::int32_t samples) noexcept override {
        return checker_.create_target(width, height, samples);
    }
    void destroy_target(TargetId target) noexcept override { checker_.destroy_target(target); }
    [[nodiscard]] Result<Picture> read_target(TargetId target) override {
        return checker_.read_target(target);
    }
    [[nodiscard]] Result<PositionPicture> read_positions(TargetId target) override {
        return checker_.read_positions(target);
    }
    [[nodiscard]] Limits limits() const noexcept override { return checker_.limits(); }
    [[nodiscard]] std::string device() const override { return "model"; }
    [[nodiscard]] std::uint64_t image_bytes() const noexcept override {
        return checker_.image_bytes();
    }
    [[nodiscard]] std::uint64_t position_bytes() const noexcept override {
        return checker_.position_bytes();
    }

    double clock_s = 1000.0;
    double disturbance_s = 0.0;
    double noise = 0.0;
    std::uint64_t fail_at = 0; ///< this execution fails; 0: none

  private:
    /// Of the rectangle around the whole scene, which has to be before the eye.
    [[nodiscard]] double covered_pixels(const View& view) const {
        glm::dvec2 lo(1e9);
        glm::dvec2 hi(-1e9);
        for (unsigned index = 0; index < 8; ++index) {
            const glm::dvec3 offset = origin_ + glm::dvec3(corner(box_, index)) - view.eye;
            const glm::dvec3 at = glm::transpose(view.camera_to_world) * offset;
            lo = glm::min(lo, glm::dvec2(at) / -at.z);
            hi = glm::max(hi, glm::dvec2(at) / -at.z);
        }
        const Lens& lens = view.lens;
        const double wide = std::min(hi.x, lens.right) - std::max(lo.x, lens.left);
        const double high = std::min(hi.y, lens.top) - std::max(lo.y, lens.bottom);
        return wide / (lens.right - lens.left) * high / (lens.top - lens.bottom) * view.width *
               view.height;
    }

    NullBackend checker_;
    std::vector<std::uint64_t> primitives_;
    glm::dvec3 origin_{0.0};
    Box3f box_;
    CostModel model_;
    double frame_s_;
    std::uint64_t executed_ = 0;
};

gpu::CalibrationOptions with_clock(const ModelBackend& backend) {
    gpu::CalibrationOptions options;
    options.clock = [&backend] { return backend.clock_s; };
    return options;
}

void check_close(const CostModel& measured, const CostModel& expected, double tolerance) {
    CHECK(measured.triangle_s == Approx(expected.triangle_s).epsilon(tolerance));
    CHECK(measured.draw_call_s == Approx(expected.draw_call_s).epsilon(tolerance));
    CHECK(measured.image_quad_s == Approx(expected.image_quad_s).epsilon(tolerance));
    CHECK(measured.image_pixel_s == Approx(expected.image_pixel_s).epsilon(tolerance));
    CHECK(measured.pass_s == Approx(expected.pass_s).epsilon(tolerance));
    CHECK(measured.texel_s == Approx(expected.texel_s).epsilon(tolerance));
    CHECK(measured.splat_s == Approx(expected.splat_s).epsilon(tolerance));
    CHECK(measured.cube_s == Approx(expected.cube_s).epsilon(tolerance));
    CHECK(measured.cell_s == CostModel().cell_s);
}

/// Software rendering, and what a graphics card may be like: all but triangles dearer than they.
const CostModel kProcessor{1.2e-7, 1e-5, 5e-6, 4e-9, 5e-5, 1e-8, 0.0, 7e-8, 1e-6, 2e-8};
const CostModel kCard{5e-10, 4e-7, 3e-8, 2e-11, 8e-6, 1e-10, 0.0, 2e-9, 4e-9, 2e-8};

/// One tree mesh, many times; nothing is split.
SmallWorld forest_world(int trees) {
    Scene scene;
    const MeshId tree = add_mesh(scene, tree_mesh(88), kNone<MaterialId>);
    for (int i = 0; i < trees; ++i) {
        add_instance(scene, tree, {i * 10.0, 0.0, 0.0});
    }
    return make_world(std::move(scene));
}

} // namespace

TEST_CASE("Calibration recovers the model of a backend that keeps to one") {
    const SmallWorld world = make_world(small_scene());
    for (const CostModel& model : {kProcessor, kCard}) {
        ModelBackend backend(world, model, 1e-3);
        const auto measured =
            gpu::calibrate(backend, world.hierarchy, world.item_primitives, with_clock(backend));
        REQUIRE(measured.has_value());
        // Differences of sums of the same numbers: what is left is the rounding of a clock that
        // stands at 1000 s, 1e-13 s a reading, against 2 ms; small shares of it lose more.
        check_close(*measured, model, 1e-6);
        CHECK(validate(*measured).has_value());
        CHECK(backend.image_bytes() == 0);
    }
}

TEST_CASE("Where pixels of geometry are what costs, they are told apart from triangles") {
    const SmallWorld world = make_world(small_scene());
    CostModel model = kCard;
    model.geometry_pixel_s = 1e-7;
    ModelBackend backend(world, model, 1e-3);
    const auto measured =
        gpu::calibrate(backend, world.hierarchy, world.item_primitives, with_clock(backend));
    REQUIRE(measured.has_value());
    CHECK(measured->geometry_pixel_s == Approx(model.geometry_pixel_s).epsilon(1e-6));
    check_close(*measured, model, 1e-3);

    // A tenth of the time is lost in what triangles cost.
    model = kProcessor;
    model.geometry_pixel_s = 1e-9;
    ModelBackend other(world, model, 1e-3);
    const auto of_other =
        gpu::calibrate(other, world.hierarchy, world.item_primitives, with_clock(other));
    REQUIRE(of_other.has_value());
    CHECK(of_other->geometry_pixel_s == 0.0);
}

TEST_CASE("Late frames and noise change little") {
    const SmallWorld world = make_world(small_scene());
    ModelBackend backend(world, kProcessor, 1e-3);
    backend.disturbance_s = 0.02; // every fifth frame, ten times as long as the others
    backend.noise = 0.002;
    const auto measured =
        gpu::calibrate(backend, world.hierarchy, world.item_primitives, with_clock(backend));
    REQUIRE(measured.has_value());
    // A median of times within 0.2 % is within 0.2 %; differences of them lose a factor of some ten
    // where the smaller part is a tenth of the whole.
    check_close(*measured, kProcessor, 0.05);
}

TEST_CASE("Calibration keeps to its time where it can") {
    const SmallWorld world = make_world(small_scene());
    for (const double frame_s : {1e-3, 0.05, 0.5}) {
        ModelBackend backend(world, kProcessor, frame_s);
        gpu::CalibrationOptions options = with_clock(backend);
        options.seconds = 1.0;
        const double begin_s = backend.clock_s;
        const auto measured =
            gpu::calibrate(backend, world.hierarchy, world.item_primitives, options);
        REQUIRE(measured.has_value());
        // Pages, the empty frame, eleven plans twice each to warm up and once to count, the
        // clean-up: under 45 frames, however long a frame takes.
        CHECK(backend.clock_s - begin_s < 1.2 + 45 * frame_s);
        check_close(*measured, kProcessor, 1e-3);
    }
}

TEST_CASE("Items that are all alike share their cost as usual") {
    const SmallWorld world = forest_world(20);
    // Ten times as dear as the default in both: the ratio is right, so the parts are.
    CostModel model;
    model.triangle_s *= 10.0;
    model.draw_call_s *= 10.0;
    ModelBackend backend(world, model, 1e-3);
    const auto measured =
        gpu::calibrate(backend, world.hierarchy, world.item_primitives, with_clock(backend));
    REQUIRE(measured.has_value());
    check_close(*measured, model, 1e-6);

    // With another ratio at least what a tree costs is right.
    ModelBackend other(world, kCard, 1e-3);
    const auto of_other =
        gpu::calibrate(other, world.hierarchy, world.item_primitives, with_clock(other));
    REQUIRE(of_other.has_value());
    CHECK(geometry_cost(*of_other, 100, 1) == Approx(geometry_cost(kCard, 100, 1)).epsilon(1e-3));
}

TEST_CASE("One item, or one split item, is enough") {
    const SmallWorld tree = forest_world(1);
    ModelBackend backend(tree, kProcessor, 1e-3);
    const auto of_tree =
        gpu::calibrate(backend, tree.hierarchy, tree.item_primitives, with_clock(backend));
    REQUIRE(of_tree.has_value());
    CHECK(
        geometry_cost(*of_tree, 100, 1) == Approx(geometry_cost(kProcessor, 100, 1)).epsilon(1e-6)
    );

    Scene scene;
    add_instance(scene, add_mesh(scene, ground_mesh(20, 10.0F), kNone<MaterialId>), {});
    const SmallWorld ground = make_world(std::move(scene));
    REQUIRE(ground.hierarchy.items.empty());
    ModelBackend other(ground, kProcessor, 1e-3);
    const auto of_ground =
        gpu::calibrate(other, ground.hierarchy, ground.item_primitives, with_clock(other));
    REQUIRE(of_ground.has_value());
    check_close(*of_ground, kProcessor, 1e-6);
}

TEST_CASE("Items that have left their places are not drawn to measure") {
    SmallWorld world = forest_world(4);
    REQUIRE(partition::hide(world.hierarchy, ItemId{0}).has_value());
    REQUIRE(partition::hide(world.hierarchy, ItemId{1}).has_value());
    REQUIRE(partition::update_bounds(world.hierarchy, ItemId{2}, {{0, 0, 0}, {1, 1, 1}}).has_value()
    );
    ModelBackend backend(world, kProcessor, 1e-3);
    const auto measured =
        gpu::calibrate(backend, world.hierarchy, world.item_primitives, with_clock(backend));
    INFO((measured ? std::string("measured") : measured.error().message));
    REQUIRE(measured.has_value());
    CHECK(
        geometry_cost(*measured, 100, 1) == Approx(geometry_cost(kProcessor, 100, 1)).epsilon(1e-6)
    );
}

TEST_CASE("What costs nothing is at the floor, never below") {
    const SmallWorld world = make_world(small_scene());
    ModelBackend backend(world, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, 1e-3);
    backend.noise = 0.1; // differences of noise alone have either sign
    const auto measured =
        gpu::calibrate(backend, world.hierarchy, world.item_primitives, with_clock(backend));
    REQUIRE(measured.has_value());
    for (const double cost :
         {measured->triangle_s,
          measured->draw_call_s,
          measured->image_quad_s,
          measured->image_pixel_s,
          measured->pass_s,
          measured->texel_s,
          measured->splat_s,
          measured->cube_s}) {
        CHECK(cost >= 1e-12);
        CHECK(std::isfinite(cost));
    }
}

TEST_CASE("Scenes and options that cannot be measured are refused by name") {
    const SmallWorld world = make_world(small_scene());
    ModelBackend backend(world, kProcessor, 1e-3);
    const auto refused = [&](const Hierarchy& hierarchy,
                             const std::vector<std::uint64_t>& primitives,
                             const gpu::CalibrationOptions& options) {
        const auto measured = gpu::calibrate(backend, hierarchy, primitives, options);
        REQUIRE_FALSE(measured.has_value());
        CHECK(measured.error().code == ErrorCode::invalid_argument);
        CHECK(backend.image_bytes() == 0);
        return measured.error().message;
    };
    const gpu::CalibrationOptions usual = with_clock(backend);
    CHECK(refused({}, {}, usual) == "calibration: the scene has nothing to draw");
    const auto nothing = partition::build_bsp({});
    REQUIRE(nothing.has_value());
    CHECK(refused(*nothing, {}, usual) == "calibration: the scene has nothing to draw");
    CHECK(
        refused(world.hierarchy, {5}, usual).find("triangles are known of 1") != std::string::npos
    );
    gpu::CalibrationOptions options = usual;
    options.seconds = 0.0;
    CHECK(
        refused(world.hierarchy, world.item_primitives, options) ==
        "calibration: seconds is 0.000000, expected a finite time above 0"
    );
    options = usual;
    options.repeats = 0;
    CHECK(
        refused(world.hierarchy, world.item_primitives, options) ==
        "calibration: repeats is 0, expected at least 1"
    );
}

TEST_CASE("An error of the backend ends it, and leaves nothing behind") {
    const SmallWorld world = make_world(small_scene());
    for (const std::uint64_t fail_at : {1U, 2U, 3U, 10U, 40U, 90U}) {
        ModelBackend backend(world, kProcessor, 1e-3);
        backend.fail_at = fail_at;
        const auto measured =
            gpu::calibrate(backend, world.hierarchy, world.item_primitives, with_clock(backend));
        REQUIRE_FALSE(measured.has_value());
        CHECK(measured.error().message == "the device is on fire");
        CHECK(backend.image_bytes() == 0);
    }
    NullBackend small(world.item_primitives, nullptr, {.page_size = 512, .samples = 1});
    const auto measured = gpu::calibrate(small, world.hierarchy, world.item_primitives);
    REQUIRE_FALSE(measured.has_value());
    CHECK(measured.error().code == ErrorCode::unsupported);
    CHECK(small.image_bytes() == 0);
}

TEST_CASE("Any backend can be measured with the machine's clock") {
    const SmallWorld world = make_world(small_scene());
    NullBackend backend(world.item_primitives, &world.hierarchy);
    const auto measured =
        gpu::calibrate(backend, world.hierarchy, world.item_primitives, {.seconds = 0.1});
    REQUIRE(measured.has_value());
    CHECK(validate(*measured).has_value());
}
