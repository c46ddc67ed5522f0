#include <farfield/gpu/calibrate.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/view.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace farfield::gpu {

namespace {

constexpr std::int32_t kFrameSize = 512; // [px]
constexpr std::int32_t kPageSize = 1024; // [texel]
constexpr std::int32_t kSmallQuad = 8;   // [px]
constexpr std::int32_t kLargeQuad = 64;  // [px]
constexpr std::int32_t kSmallImage = 16; // [texel]
constexpr std::int32_t kLargeImage = 64; // [texel]
constexpr std::uint32_t kMostQuads = 65536;
constexpr std::uint32_t kMostImages = (kPageSize / kLargeImage) * (kPageSize / kLargeImage);
constexpr std::uint32_t kMostPieces = 65536;
constexpr std::uint32_t kFewestCells = 1U << 8U;
constexpr std::uint32_t kMostCells = 1U << 20U;
constexpr double kCellSide = 0.7; // [px] half of such splats cover a sample
// Long enough for clocks and for what else the machine does.
constexpr double kEnough = 2e-3; // [s]
// A count is not doubled any more once a single plan takes this share of the time there is.
constexpr double kLargestShare = 1.0 / 64.0;
constexpr double kFloor = 1e-12; // [s]
// Pixels are told apart from triangles where they take at least this share of the time.
constexpr double kLeastPixelShare = 0.5;
constexpr std::int32_t kSmallFrame = 128; // [px]
// Draws that differ less than this in triangles do not tell triangles from draws.
constexpr double kLeastSpread = 1.1;

constexpr PageId kScratch{0};
constexpr PageId kShown{1}; // holds one image, which all quads show
constexpr PageId kMade{2};  // images are copied to it, and never shown

double machine_clock() {
    using Seconds = std::chrono::duration<double>;
    return Seconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double square(std::int32_t side) noexcept {
    return static_cast<double>(side) * static_cast<double>(side);
}

/// Sees the whole box, all of its sphere between the near and the far plane.
View view_of(const Box3f& box, const glm::dvec3& origin) noexcept {
    constexpr double kFieldOfView = 50.0 * std::numbers::pi / 180.0;
    const glm::dvec3 middle = origin + glm::dvec3(center(box));
    // A point is looked at as a box of two millimetres.
    const double radius = std::max(0.5 * glm::length(glm::dvec3(extent(box))), 1e-3);
    const double distance = radius / std::sin(kFieldOfView / 2.0);
    const glm::dvec3 direction = glm::normalize(glm::dvec3(0.5, 0.5, 0.7));
    const Lens lens =
        perspective_lens(kFieldOfView, 1.0, 0.9 * (distance - radius), 2.0 * (distance + radius));
    return look_at(
        middle + direction * distance, middle, {0.0, 1.0, 0.0}, lens, kFrameSize, kFrameSize
    );
}

/// Geometry that was drawn, and how long that took beyond an empty frame.
struct GeometrySample {
    double triangles = 0.0;
    double draws = 0.0;
    double time_s = 0.0;
};

/// Finds the costs t and d, not negative, of least sum of ((t triangles + d draws - time) /
/// time)^2.
void fit_geometry(const std::vector<GeometrySample>& samples, CostModel& model) noexcept {
    double tt = 0.0;
    double td = 0.0;
    double dd = 0.0;
    double sum_t = 0.0;
    double sum_d = 0.0;
    double least_ratio = std::numeric_limits<double>::infinity();
    double most_ratio = 0.0;
    for (const GeometrySample& sample : samples) {
        const double time_s = std::max(sample.time_s, kFloor);
        const double t = sample.triangles / time_s;
        const double d = sample.draws / time_s;
        tt += t * t;
        td += t * d;
        dd += d * d;
        sum_t += t;
        sum_d += d;
        least_ratio = std::min(least_ratio, sample.triangles / sample.draws);
        most_ratio = std::max(most_ratio, sample.triangles / sample.draws);
    }
    if (!(most_ratio > kLeastSpread * least_ratio)) {
        // What is known is the cost of a draw together with its triangles.
        const CostModel usual;
        const double scale = sum_d / dd / (usual.triangle_s * most_ratio + usual.draw_call_s);
        model.triangle_s = usual.triangle_s * scale;
        model.draw_call_s = usual.draw_call_s * scale;
        return;
    }
    const double determinant = tt * dd - td * td;
    model.triangle_s = (sum_t * dd - sum_d * td) / determinant;
    model.draw_call_s = (sum_d * tt - sum_t * td) / determinant;
    if (model.triangle_s < 0.0) {
        model.triangle_s = 0.0;
        model.draw_call_s = sum_d / dd;
    } else if (model.draw_call_s < 0.0) {
        model.draw_call_s = 0.0;
        model.triangle_s = sum_t / tt;
    }
}

/// One run of the measurements: keeps the first error and does nothing after it.
class Calibration {
  public:
    Calibration(
        Backend& backend,
        const Hierarchy& hierarchy,
        std::span<const std::uint64_t> item_primitives,
        const CalibrationOptions& options
    );
    Calibration(const Calibration&) = delete;
    Calibration& operator=(const Calibration&) = delete;
    ~Calibration();

    [[nodiscard]] Result<CostModel> run();

  private:
    [[nodiscard]] double now() const { return options_.clock ? options_.clock() : machine_clock(); }
    [[nodiscard]] bool time_is_left() const { return now() < deadline_; }
    void begin_stage(double end_share) { deadline_ = start_s_ + end_share * options_.seconds; }

    void execute(const FramePlan& plan);
    [[nodiscard]] double time_once(const FramePlan& plan);
    [[nodiscard]] std::vector<double> time_in_turns(const std::vector<FramePlan>& plans);
    template <typename MakePlan>
    [[nodiscard]] FramePlan
    double_until_enough(std::uint32_t most, const MakePlan& make_plan, std::uint32_t first = 1);

    [[nodiscard]] FramePlan empty_plan() const;
    [[nodiscard]] ImageQuad quad_at(std::int32_t x, std::int32_t y, std::int32_t side) const;
    [[nodiscard]] FramePlan quads_plan(std::uint32_t count, std::int32_t side) const;
    [[nodiscard]] FramePlan images_plan(std::uint32_t count, std::int32_t side) const;
    [[nodiscard]] FramePlan cells_plan(Command::Kind kind, std::uint32_t count) const;
    [[nodiscard]] FramePlan
    geometry_plan(std::vector<ItemId> items, std::vector<Piece> pieces) const;

    void make_pages();
    void measure_quads(CostModel& model);
    void measure_images(CostModel& model);
    [[nodiscard]] double measure_cells(Command::Kind kind);
    [[nodiscard]] double covered_share() const;
    void measure_pixels(CostModel& model);
    void measure_geometry(CostModel& model);
    [[nodiscard]] std::vector<ItemId> items_at_rest() const;
    [[nodiscard]] std::vector<FramePlan> item_plans();
    [[nodiscard]] std::vector<FramePlan> piece_plans();

    Backend* backend_;
    const Hierarchy* hierarchy_;
    std::span<const std::uint64_t> item_primitives_;
    CalibrationOptions options_;
    View view_;
    double start_s_ = 0.0;
    double deadline_ = 0.0;
    double empty_s_ = 0.0; // an empty frame
    TargetId target_{};
    std::optional<Error> error_;
};

Calibration::Calibration(
    Backend& backend,
    const Hierarchy& hierarchy,
    std::span<const std::uint64_t> item_primitives,
    const CalibrationOptions& options
)
    : backend_(&backend), hierarchy_(&hierarchy), item_primitives_(item_primitives),
      options_(options), view_(view_of(bounds(hierarchy.nodes[0]), hierarchy.origin)) {
    if (Result<TargetId> target = backend.create_target(kFrameSize, kFrameSize, 1)) {
        target_ = *target;
    } else {
        error_ = std::move(target).error();
    }
}

Calibration::~Calibration() {
    if (target_ == TargetId{}) {
        return;
    }
    FramePlan plan = empty_plan();
    for (const PageId page : {kScratch, kShown, kMade}) {
        plan.pages.push_back({.action = PageUpdate::Action::destroy, .page = page});
    }
    // If even this fails, there is a better error to report already.
    static_cast<void>(backend_->execute(plan, target_, {}));
    backend_->destroy_target(target_);
}

void Calibration::execute(const FramePlan& plan) {
    if (error_) {
        return;
    }
    if (Result<void> executed = backend_->execute(plan, target_, {}); !executed) {
        error_ = std::move(executed).error();
    }
}

double Calibration::time_once(const FramePlan& plan) {
    backend_->finish();
    const double begin_s = now();
    execute(plan);
    backend_->finish();
    return now() - begin_s;
}

/// Medians; each plan was drawn at least once before, and is drawn once more, time or not.
std::vector<double> Calibration::time_in_turns(const std::vector<FramePlan>& plans) {
    std::vector<std::vector<double>> times(plans.size());
    for (std::uint32_t repeat = 0; repeat < options_.repeats; ++repeat) {
        if (error_ || (repeat > 0 && !time_is_left())) {
            break;
        }
        for (std::size_t i = 0; i < plans.size(); ++i) {
            times[i].push_back(time_once(plans[i]));
        }
    }
    std::vector<double> medians(plans.size(), 0.0);
    for (std::size_t i = 0; i < plans.size() && !error_; ++i) {
        const auto middle = times[i].begin() + static_cast<std::ptrdiff_t>(times[i].size() / 2);
        std::nth_element(times[i].begin(), middle, times[i].end());
        medians[i] = *middle;
    }
    return medians;
}

/// The plan of `first` things, or of 2, 4, ... times as many, that takes long enough, warm, or has
/// the most there can be.
template <typename MakePlan>
FramePlan Calibration::double_until_enough(
    std::uint32_t most, const MakePlan& make_plan, std::uint32_t first
) {
    const auto enough = [&](double time_s) {
        return time_s - empty_s_ >= kEnough || time_s >= kLargestShare * options_.seconds;
    };
    for (std::uint32_t count = first;; count = std::min(2 * count, most)) {
        FramePlan plan = make_plan(count);
        execute(plan);
        // Once may have been late; a second time says so.
        const bool done = enough(time_once(plan)) && enough(time_once(plan));
        if (error_ || done || count == most || !time_is_left()) {
            return plan;
        }
    }
}

FramePlan Calibration::empty_plan() const {
    FramePlan plan;
    plan.cache = options_.cache_id;
    plan.origin = view_.eye;
    Pass frame;
    frame.view = view_;
    frame.viewport = {0, 0, kFrameSize, kFrameSize};
    frame.scissor = frame.viewport;
    frame.batch = 1;
    plan.passes.push_back(frame);
    return plan;
}

/// An image of `side` pixels on the pixels of the frame from (x, y) on; texels are pixels.
ImageQuad Calibration::quad_at(std::int32_t x, std::int32_t y, std::int32_t side) const {
    const Lens& lens = view_.lens;
    const double distance = 0.5 * (lens.near_distance + lens.far_distance);
    const double pixel = (lens.right - lens.left) / kFrameSize * distance;
    const glm::dvec3& right = view_.camera_to_world[0];
    const glm::dvec3& up = view_.camera_to_world[1];
    const glm::dvec3 corner_at = right * (lens.left * distance + x * pixel) +
                                 up * (lens.bottom * distance + y * pixel) -
                                 view_.camera_to_world[2] * distance;
    ImageQuad quad;
    quad.page = kShown;
    quad.source = {0, 0, side, side};
    quad.origin = glm::vec3(corner_at);
    quad.edge_u = glm::vec3(right * (side * pixel));
    quad.edge_v = glm::vec3(up * (side * pixel));
    quad.depth = static_cast<float>(distance);
    return quad;
}

FramePlan Calibration::quads_plan(std::uint32_t count, std::int32_t side) const {
    FramePlan plan = empty_plan();
    constexpr auto kWide = static_cast<std::uint32_t>(kFrameSize / kLargeQuad);
    for (std::uint32_t i = 0; i < count; ++i) {
        // All over the frame, whatever their size.
        const auto x = static_cast<std::int32_t>(i % kWide) * kLargeQuad;
        const auto y = static_cast<std::int32_t>(i / kWide % kWide) * kLargeQuad;
        plan.quads.push_back(quad_at(x, y, side));
    }
    Command command;
    command.kind = Command::Kind::images;
    command.count = count;
    plan.commands.push_back(command);
    plan.passes.back().command_count = 1;
    return plan;
}

/// Images in one batch, each of one small image.
FramePlan Calibration::images_plan(std::uint32_t count, std::int32_t side) const {
    FramePlan plan = empty_plan();
    plan.quads.push_back(quad_at(0, 0, kSmallQuad));
    Command command;
    command.kind = Command::Kind::images;
    command.count = 1;
    plan.commands.push_back(command);
    Pass pass;
    pass.page = kScratch;
    pass.view = view_;
    pass.view.lens = sub_lens(view_, 0.0, 0.0, side, side);
    pass.view.width = side;
    pass.view.height = side;
    pass.command_count = 1;
    pass.copy_page = kMade;
    const auto wide = static_cast<std::uint32_t>(kPageSize / side);
    std::vector<Pass> passes;
    for (std::uint32_t i = 0; i < count; ++i) {
        pass.scissor = {
            static_cast<std::int32_t>(i % wide) * side,
            static_cast<std::int32_t>(i / wide) * side,
            side,
            side};
        pass.viewport = pass.scissor;
        pass.copy = pass.scissor;
        passes.push_back(pass);
    }
    plan.passes.insert(plan.passes.begin(), passes.begin(), passes.end());
    return plan;
}

/// Splats or cubes all over the frame, in no order that a device could use.
FramePlan Calibration::cells_plan(Command::Kind kind, std::uint32_t count) const {
    FramePlan plan = empty_plan();
    const Lens& lens = view_.lens;
    const double distance = 0.5 * (lens.near_distance + lens.far_distance);
    const double pixel = (lens.right - lens.left) / kFrameSize * distance;
    // The additive sequence of the plastic number fills a square evenly, whatever the count.
    constexpr double kStepX = 0.7548776662466927;
    constexpr double kStepY = 0.5698402909980532;
    plan.cube_frames.emplace_back(1.0F); // the view looks along none of the world's axes
    double x = 0.0;
    double y = 0.0;
    for (std::uint32_t i = 0; i < count; ++i) {
        x += kStepX - (x + kStepX >= 1.0 ? 1.0 : 0.0);
        y += kStepY - (y + kStepY >= 1.0 ? 1.0 : 0.0);
        const glm::dvec3 place =
            view_.camera_to_world[0] * ((lens.left + x * (lens.right - lens.left)) * distance) +
            view_.camera_to_world[1] * ((lens.bottom + y * (lens.top - lens.bottom)) * distance) -
            view_.camera_to_world[2] * distance;
        const glm::vec3 center(place);
        const auto side = static_cast<float>(kCellSide * pixel);
        const glm::vec<4, std::uint8_t> color(60, 80, 40, 128);
        if (kind == Command::Kind::splats) {
            plan.splats.push_back({center, side, color});
        } else {
            plan.cubes.push_back({center, glm::vec3(side), 0, {color, color, color}});
        }
    }
    Command command;
    command.kind = kind;
    command.count = count;
    plan.commands.push_back(command);
    plan.passes.back().command_count = 1;
    return plan;
}

FramePlan Calibration::geometry_plan(std::vector<ItemId> items, std::vector<Piece> pieces) const {
    FramePlan plan = empty_plan();
    Command command;
    command.count = static_cast<std::uint32_t>(items.size());
    command.piece_count = static_cast<std::uint32_t>(pieces.size());
    plan.commands.push_back(command);
    plan.passes.back().command_count = 1;
    plan.items = std::move(items);
    plan.pieces = std::move(pieces);
    return plan;
}

void Calibration::make_pages() {
    FramePlan plan = images_plan(1, kLargeQuad);
    plan.pages = {
        {.page = kScratch, .size = kPageSize, .scratch = true},
        {.page = kShown, .size = kLargeQuad},
        {.page = kMade, .size = kPageSize}};
    plan.passes[0].command_count = 0;
    plan.passes[0].copy_page = kShown;
    execute(plan);
}

void Calibration::measure_quads(CostModel& model) {
    const FramePlan small = double_until_enough(kMostQuads, [&](std::uint32_t count) {
        return quads_plan(count, kSmallQuad);
    });
    const auto count = static_cast<std::uint32_t>(small.quads.size());
    const FramePlan large = quads_plan(count, kLargeQuad);
    execute(large);
    const std::vector<double> times = time_in_turns({empty_plan(), small, large});
    empty_s_ = times[0];
    const double small_s = (times[1] - empty_s_) / count;
    const double large_s = (times[2] - empty_s_) / count;
    model.image_pixel_s = (large_s - small_s) / (square(kLargeQuad) - square(kSmallQuad));
    model.image_pixel_s = std::max(model.image_pixel_s, kFloor);
    model.image_quad_s = std::max(small_s - model.image_pixel_s * square(kSmallQuad), kFloor);
}

void Calibration::measure_images(CostModel& model) {
    const FramePlan small = double_until_enough(kMostImages, [&](std::uint32_t count) {
        return images_plan(count, kSmallImage);
    });
    const auto count = static_cast<std::uint32_t>(small.passes.size() - 1);
    const FramePlan large = images_plan(count, kLargeImage);
    execute(large);
    const std::vector<double> times = time_in_turns({small, large});
    const double small_s = (times[0] - empty_s_) / count;
    const double large_s = (times[1] - empty_s_) / count;
    model.texel_s = (large_s - small_s) / (square(kLargeImage) - square(kSmallImage));
    model.texel_s = std::max(model.texel_s, kFloor);
    const double contents_s = image_cost(model, square(kSmallQuad));
    model.pass_s = std::max(small_s - model.texel_s * square(kSmallImage) - contents_s, kFloor);
}

/// @return of one
double Calibration::measure_cells(Command::Kind kind) {
    const auto make_plan = [&](std::uint32_t count) { return cells_plan(kind, count); };
    const FramePlan plan = double_until_enough(kMostCells, make_plan, kFewestCells);
    const std::vector<double> times = time_in_turns({plan});
    return std::max((times[0] - empty_s_) / plan.commands[0].count, kFloor);
}

std::vector<ItemId> Calibration::items_at_rest() const {
    std::vector<ItemId> items = hierarchy_->items;
    std::erase(items, kNone<ItemId>);
    return items;
}

/// Items with the fewest triangles, and those with the most.
std::vector<FramePlan> Calibration::item_plans() {
    std::vector<FramePlan> plans;
    std::vector<ItemId> sorted = items_at_rest();
    std::sort(sorted.begin(), sorted.end(), [&](ItemId a, ItemId b) {
        const std::uint64_t of_a = item_primitives_[index_of(a)];
        const std::uint64_t of_b = item_primitives_[index_of(b)];
        return of_a != of_b ? of_a < of_b : a < b;
    });
    const std::size_t half = (sorted.size() + 1) / 2;
    const auto most = static_cast<std::uint32_t>(half);
    if (most > 0) {
        plans.push_back(double_until_enough(most, [&](std::uint32_t count) {
            return geometry_plan({sorted.begin(), sorted.begin() + count}, {});
        }));
    }
    if (sorted.size() > 1) {
        plans.push_back(double_until_enough(most, [&](std::uint32_t count) {
            return geometry_plan({sorted.end() - count, sorted.end()}, {});
        }));
    }
    return plans;
}

/// As many primitives in one run as in runs of one, of the item with the longest run.
std::vector<FramePlan> Calibration::piece_plans() {
    Piece longest;
    Piece run;
    for (const Piece& piece : hierarchy_->pieces) {
        if (run.item == piece.item && run.first + run.count == piece.first) {
            run.count += piece.count;
        } else {
            run = piece;
        }
        if (run.count > longest.count) {
            longest = run;
        }
    }
    std::vector<FramePlan> plans;
    if (longest.count == 0) {
        return plans;
    }
    // Every other primitive, since neighbouring runs are one.
    const std::uint32_t most = std::min((longest.count + 1) / 2, kMostPieces);
    plans.push_back(double_until_enough(most, [&](std::uint32_t count) {
        std::vector<Piece> pieces;
        for (std::uint32_t i = 0; i < count; ++i) {
            pieces.push_back({longest.item, longest.first + 2 * i, 1});
        }
        return geometry_plan({}, std::move(pieces));
    }));
    const auto count = static_cast<std::uint32_t>(plans[0].pieces.size());
    plans.push_back(geometry_plan({}, {{longest.item, longest.first, count}}));
    execute(plans.back());
    return plans;
}

/// Share of the frame that the scene's box may cover.
double Calibration::covered_share() const {
    const Box3f box = bounds(hierarchy_->nodes[0]);
    glm::dvec2 lo(1.0);
    glm::dvec2 hi(0.0);
    for (unsigned index = 0; index < 8; ++index) {
        const glm::dvec3 world = hierarchy_->origin + glm::dvec3(corner(box, index));
        const glm::dvec3 camera = glm::transpose(view_.camera_to_world) * (world - view_.eye);
        const Lens& lens = view_.lens;
        const glm::dvec2 at(
            (camera.x / -camera.z - lens.left) / (lens.right - lens.left),
            (camera.y / -camera.z - lens.bottom) / (lens.top - lens.bottom)
        );
        lo = glm::min(lo, at);
        hi = glm::max(hi, at);
    }
    const glm::dvec2 covered = glm::clamp(hi, 0.0, 1.0) - glm::clamp(lo, 0.0, 1.0);
    return std::max(covered.x * covered.y, 1.0 / square(kFrameSize));
}

/// The same geometry on many pixels and on few.
void Calibration::measure_pixels(CostModel& model) {
    const auto whole = geometry_plan(items_at_rest(), hierarchy_->pieces);
    FramePlan few = whole;
    Pass& frame = few.passes.back();
    frame.view.width = kSmallFrame;
    frame.view.height = kSmallFrame;
    frame.viewport = {0, 0, kSmallFrame, kSmallFrame};
    frame.scissor = frame.viewport;
    execute(whole);
    execute(few);
    const std::vector<double> times = time_in_turns({whole, few});
    const double pixels = (square(kFrameSize) - square(kSmallFrame)) * covered_share();
    const double all_s = times[0] - empty_s_;
    const double pixel_s = (times[0] - times[1]) / pixels;
    // Triangles cost on few pixels what they cost on many. Where they are what takes time, pixels
    // are lost in it, and what a triangle costs has them in it.
    const bool told_apart =
        pixel_s * square(kFrameSize) * covered_share() >= kLeastPixelShare * all_s;
    model.geometry_pixel_s = told_apart ? std::max(pixel_s, 0.0) : 0.0;
}

void Calibration::measure_geometry(CostModel& model) {
    std::vector<FramePlan> plans = item_plans();
    for (FramePlan& plan : piece_plans()) {
        plans.push_back(std::move(plan));
    }
    const std::vector<double> times = time_in_turns(plans);
    std::vector<GeometrySample> samples;
    for (std::size_t i = 0; i < plans.size(); ++i) {
        GeometrySample sample;
        for (const ItemId item : plans[i].items) {
            sample.triangles += static_cast<double>(item_primitives_[index_of(item)]);
        }
        for (const Piece& piece : plans[i].pieces) {
            sample.triangles += piece.count;
        }
        sample.draws = static_cast<double>(plans[i].items.size() + plans[i].pieces.size());
        // Whatever they cover, it is no more than the scene does.
        const double pixels_s = model.geometry_pixel_s * square(kFrameSize) * covered_share();
        sample.time_s = times[i] - empty_s_ - pixels_s;
        // What covers less than the scene may be left with nothing, and then tells nothing.
        if (sample.time_s > 0.0 || pixels_s == 0.0) {
            samples.push_back(sample);
        }
    }
    if (samples.empty()) {
        model.triangle_s = 0.0; // what is left of both is lost in the pixels
        model.draw_call_s = 0.0;
    } else {
        fit_geometry(samples, model);
    }
    model.triangle_s = std::max(model.triangle_s, kFloor);
    model.draw_call_s = std::max(model.draw_call_s, kFloor);
}

Result<CostModel> Calibration::run() {
    CostModel model;
    start_s_ = now();
    make_pages();
    execute(empty_plan());
    if (!error_) {
        empty_s_ = time_once(empty_plan());
    }
    // Geometry costs most to measure and is worth most.
    begin_stage(0.2);
    measure_quads(model);
    begin_stage(0.35);
    measure_images(model);
    begin_stage(0.45);
    model.splat_s = measure_cells(Command::Kind::splats);
    begin_stage(0.55);
    model.cube_s = measure_cells(Command::Kind::cubes);
    begin_stage(0.65);
    measure_pixels(model);
    begin_stage(1.0);
    measure_geometry(model);
    if (error_) {
        return tl::unexpected(std::move(*error_));
    }
    return model;
}

Result<void> check_options(const CalibrationOptions& options) {
    if (!(options.seconds > 0.0) || !std::isfinite(options.seconds)) {
        return fail(
            ErrorCode::invalid_argument,
            "calibration: seconds is " + std::to_string(options.seconds) +
                ", expected a finite time above 0"
        );
    }
    if (options.repeats < 1) {
        return fail(ErrorCode::invalid_argument, "calibration: repeats is 0, expected at least 1");
    }
    return {};
}

Result<void> check_scene(const Hierarchy& hierarchy, std::size_t items_known) {
    if (hierarchy.nodes.empty() || is_empty(bounds(hierarchy.nodes[0])) ||
        (hierarchy.items.empty() && hierarchy.pieces.empty())) {
        return fail(ErrorCode::invalid_argument, "calibration: the scene has nothing to draw");
    }
    const auto unknown = [&](ItemId item) {
        return fail(
            ErrorCode::invalid_argument,
            "calibration: the hierarchy holds item " + std::to_string(index_of(item)) +
                ", triangles are known of " + std::to_string(items_known)
        );
    };
    for (const ItemId item : hierarchy.items) {
        if (item != kNone<ItemId> && index_of(item) >= items_known) {
            return unknown(item);
        }
    }
    for (const Piece& piece : hierarchy.pieces) {
        if (index_of(piece.item) >= items_known) {
            return unknown(piece.item);
        }
    }
    return {};
}

} // namespace

Result<CostModel> calibrate(
    Backend& backend,
    const Hierarchy& hierarchy,
    std::span<const std::uint64_t> item_primitives,
    const CalibrationOptions& options
) {
    if (Result<void> valid = check_options(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    if (Result<void> valid = check_scene(hierarchy, item_primitives.size()); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    return Calibration(backend, hierarchy, item_primitives, options).run();
}

} // namespace farfield::gpu
