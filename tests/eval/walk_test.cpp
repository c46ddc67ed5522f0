#include "painted_backend.hpp"
#include "support/small_scene.hpp"
#include <farfield/eval/image_errors.hpp>
#include <farfield/eval/walk.hpp>
#include <farfield/gpu/null/null_backend.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <unistd.h>
#include <vector>

// Of what a walk asks of planners and backends, and of what it makes of the answers. Backends here
// paint one colour, so that errors are known; times are whatever they are, and only their relations
// are checked. What is really drawn is walked through in walk_drawn_test.cpp.

namespace {

using farfield::Backend;
using farfield::Contender;
using farfield::ContenderResult;
using farfield::FramePlan;
using farfield::ImageCacheStatistics;
using farfield::Motion;
using farfield::NullBackend;
using farfield::Planner;
using farfield::Result;
using farfield::RunReport;
using farfield::SampledTime;
using farfield::View;
using farfield::WalkFrame;
using farfield::WalkObserver;
using farfield::WalkOptions;
using farfield::WalkPictures;
using farfield::WalkResult;
using farfield::WalkSetup;
using farfield::support::small_walk;
using farfield::support::SmallWorld;
using farfield::test::Event;
using farfield::test::PaintedBackend;
using glm::u8vec3;
namespace eval = farfield::eval;

constexpr int kWidth = 16;
constexpr int kHeight = 12; // one more than the window of SSIM
const u8vec3 kGrey(100);    // of the reference
constexpr u8vec3 kSky(0);   // `FrameClear::color`

const SmallWorld& world() {
    static const SmallWorld kWorld =
        farfield::support::make_world(farfield::support::small_scene());
    return kWorld;
}

/// A technique that plans one item a frame and numbers its plans: `FramePlan::cache` of the first
/// one is 1.
class NumberedPlanner {
  public:
    NumberedPlanner(std::string name, std::vector<Event>& events)
        : name_(std::move(name)), events_(&events) {}

    Planner planner() {
        Planner planner;
        planner.plan = [this](const View& view, const Motion& motion) -> const FramePlan& {
            ++plan_.cache;
            motions.push_back(motion);
            farfield::Pass pass;
            pass.view = view;
            pass.viewport = {0, 0, view.width, view.height};
            pass.scissor = pass.viewport;
            pass.command_count = 1;
            plan_.passes = {pass};
            plan_.commands = {{.count = 1}};
            plan_.items = {farfield::ItemId{1}};
            events_->push_back({Event::Kind::planned, name_, plan_.cache, view.eye.x});
            statistics_.images_created = plan_.cache;
            statistics_.images_combined = 1;
            statistics_.images_reused = 10;
            statistics_.images_impossible = 6;
            statistics_.images_stale = 2;
            statistics_.images_evicted = 3;
            statistics_.images_refused = 4;
            return plan_;
        };
        planner.statistics = [this]() -> const ImageCacheStatistics& { return statistics_; };
        return planner;
    }

    std::vector<Motion> motions;

  private:
    std::string name_;
    std::vector<Event>* events_;
    FramePlan plan_;
    ImageCacheStatistics statistics_;
};

/// A walk with painted backends. Contenders are added first, then it is walked.
class Stage {
  public:
    static PaintedBackend::Paint plain(const u8vec3& color) {
        return [color](const FramePlan&) { return color; };
    }

    PaintedBackend& backend(const std::string& name, const PaintedBackend::Paint& paint) {
        return backends_.emplace_back(name, events, paint);
    }

    Contender& contend(const std::string& name, const PaintedBackend::Paint& paint) {
        planners.emplace_back(name, events);
        Contender& contender = contenders.emplace_back();
        contender.name = name;
        contender.planner = planners.back().planner();
        contender.backend = &backend(name, paint);
        return contender;
    }

    WalkSetup setup() {
        WalkSetup setup;
        setup.contenders = contenders;
        setup.reference = reference;
        setup.truth = truth;
        setup.hierarchy = &world().hierarchy;
        setup.item_primitives = world().item_primitives;
        setup.view = [](int frame) { return small_walk(frame, kWidth, kHeight); };
        return setup;
    }

    Result<WalkResult> walk(const WalkOptions& options, const WalkObserver& observer = {}) {
        return eval::walk(setup(), options, observer);
    }

    /// Plans in the order in which a backend, or all of them, executed them.
    [[nodiscard]] std::vector<std::uint32_t> plans(Event::Kind kind, const std::string& who) const {
        std::vector<std::uint32_t> result;
        for (const Event& event : events) {
            if (event.kind == kind && event.who == who) {
                result.push_back(event.cache);
            }
        }
        return result;
    }

    [[nodiscard]] std::size_t targets_left() const {
        std::size_t count = 0;
        for (const PaintedBackend& one : backends_) {
            count += one.targets_left();
        }
        return count;
    }

    std::vector<Event> events;
    std::deque<NumberedPlanner> planners;
    std::vector<Contender> contenders;
    Backend* reference = nullptr;
    Backend* truth = nullptr;

  private:
    std::deque<PaintedBackend> backends_; // what it hands out stays where it is
};

/// Both orders of plain geometry are tried: warming up, then two frames each.
std::size_t trials(const WalkOptions& options) {
    return static_cast<std::size_t>(options.warm_up_frames) + 4;
}

std::string message_of(const Result<WalkResult>& result) {
    return result ? "walked" : result.error().message;
}

/// PSNR of two pictures of one colour each, a level of `apart` apart in one channel of three.
double psnr_of(double apart) {
    return 10.0 * std::log10(255.0 * 255.0 / (apart * apart / 3.0));
}

std::string read_file(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts(1);
    for (const char character : text) {
        if (character == separator) {
            parts.emplace_back();
        } else {
            parts.back() += character;
        }
    }
    return parts;
}

/// The columns that the header promises, in order.
std::vector<std::string> documented_columns() {
    const std::string header =
        read_file(std::filesystem::path(FARFIELD_TEST_DATA) / "../include/farfield/eval/walk.hpp");
    constexpr std::string_view kBefore = "Writes a table of all frames of one contender:";
    const std::size_t begin = header.find(kBefore) + kBefore.size();
    std::string list;
    for (const char character : header.substr(begin, header.find(';', begin) - begin)) {
        list += character == '/' || character == ' ' || character == '\n'
                    ? ""
                    : std::string(1, character);
    }
    return split(list, ',');
}

} // namespace

TEST_CASE("a walk that cannot begin is refused by name", "[walk]") {
    Stage stage;
    CHECK(message_of(stage.walk({.frames = 1})) == "walk: no contenders");
    PaintedBackend& first = stage.backend("first", Stage::plain(kGrey));
    stage.contend("a", Stage::plain(kGrey));
    stage.reference = &first;
    CHECK(message_of(stage.walk({.frames = 0})) == "walk: frames is 0, expected at least 1");
    for (const double seconds :
         {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        CAPTURE(seconds);
        const auto refused = stage.walk({.frames = 1, .frame_seconds = seconds});
        CHECK_THAT(message_of(refused), Catch::StartsWith("walk: frame_seconds is "));
    }
    SECTION("for a view, with its frame") {
        WalkSetup setup = stage.setup();
        setup.view = [](int frame) {
            View view = small_walk(frame, kWidth, kHeight);
            view.eye.x = frame == 2 ? std::nan("") : view.eye.x;
            return view;
        };
        CHECK(eval::walk(setup, {.frames = 2}));
        CHECK_THAT(message_of(eval::walk(setup, {.frames = 3})), Catch::StartsWith("frame 2: "));
    }
    SECTION("for a view of another size, with its frame") {
        WalkSetup setup = stage.setup();
        setup.view = [](int frame) {
            return small_walk(frame, frame == 2 ? kWidth + 1 : kWidth, kHeight);
        };
        CHECK(eval::walk(setup, {.frames = 2}));
        CHECK_THAT(message_of(eval::walk(setup, {.frames = 3})), Catch::StartsWith("frame 2: "));
    }
    SECTION("for a contender without a backend") {
        stage.contenders[0].backend = nullptr;
        CHECK(message_of(stage.walk({.frames = 1})) == "walk: a: no backend");
    }
    SECTION("for pictures without a reference") {
        WalkSetup setup = stage.setup();
        setup.reference = nullptr;
        farfield::WalkObserver observer;
        observer.on_pictures = [](const WalkPictures&) -> farfield::Result<void> { return {}; };
        CHECK(eval::walk(setup, {.frames = 1}, observer));
        CHECK_THAT(
            message_of(eval::walk(setup, {.frames = 1, .picture_every = 1}, observer)),
            Catch::StartsWith("walk: pictures without")
        );
    }
    SECTION("for a truth without a reference") {
        WalkSetup setup = stage.setup();
        setup.truth = setup.reference;
        setup.reference = nullptr;
        CHECK_THAT(
            message_of(eval::walk(setup, {.frames = 1})), Catch::StartsWith("walk: a truth without")
        );
    }
    SECTION("for a contender whose backend takes no such target") {
        stage.contenders[0].samples = 17;
        CHECK(message_of(stage.walk({.frames = 1})) == "a: 17 samples are too many");
        CHECK(stage.targets_left() == 0);
    }
    SECTION("for a contender whose positions take no target") {
        PaintedBackend& positions = stage.backend("positions", Stage::plain(kGrey));
        positions.samples = 0;
        stage.contenders[0].positions = &positions;
        CHECK(message_of(stage.walk({.frames = 1})) == "a: 1 samples are too many");
        CHECK(stage.targets_left() == 0);
    }
    SECTION("for a contender whose reference takes no target") {
        PaintedBackend& own = stage.backend("own", Stage::plain(kGrey));
        own.samples = 0;
        stage.contenders[0].reference = &own;
        CHECK(message_of(stage.walk({.frames = 1})) == "a: 1 samples are too many");
        CHECK(stage.targets_left() == 0);
    }
    SECTION("for the truth") {
        PaintedBackend& truth = stage.backend("truth", Stage::plain(kGrey));
        truth.samples = 15;
        stage.truth = &truth;
        CHECK(message_of(stage.walk({.frames = 1})) == "truth: 16 samples are too many");
        CHECK(stage.targets_left() == 0);
    }
    // Nothing was planned that then was not drawn.
    CHECK(stage.plans(Event::Kind::planned, "a").size() <= 2);
}

TEST_CASE("a backend that fails ends the walk, with contender and frame", "[walk]") {
    Stage stage;
    stage.contend("a", Stage::plain(kGrey));
    Contender& b = stage.contend("b", Stage::plain(kGrey));
    PaintedBackend& reference = stage.backend("reference", Stage::plain(kGrey));
    PaintedBackend& positions = stage.backend("positions", Stage::plain(kGrey));
    stage.reference = &reference;
    b.positions = &positions;
    const WalkOptions options{.frames = 4, .reference_every = 1};
    std::string expected;
    SECTION("while it draws") {
        static_cast<PaintedBackend*>(b.backend)->fail_at = 1;
        expected = "b, frame 1: the device is gone";
    }
    SECTION("while it draws again for positions") {
        positions.fail_at = 2;
        expected = "b, frame 2: the device is gone";
    }
    SECTION("while it draws plain geometry") {
        reference.fail_at = trials(options) + 2;
        expected = "the device is gone";
    }
    SECTION("while it warms up") {
        reference.fail_at = 0;
        expected = "the device is gone";
    }
    CHECK(message_of(stage.walk(options)) == expected);
    CHECK(stage.targets_left() == 0);
}

TEST_CASE("an observer may end the walk", "[walk]") {
    Stage stage;
    stage.contend("a", Stage::plain(kGrey));
    stage.reference = &stage.backend("reference", Stage::plain(kGrey));
    WalkObserver observer;
    SECTION("on a frame") {
        observer.on_frame =
            [](int frame, std::size_t, const View&, const FramePlan&) -> Result<void> {
            return frame == 2 ? farfield::fail(farfield::ErrorCode::device, "disk full")
                              : Result<void>{};
        };
    }
    SECTION("on pictures") {
        observer.on_pictures = [](const WalkPictures& pictures) -> Result<void> {
            return pictures.frame == 2 ? farfield::fail(farfield::ErrorCode::device, "disk full")
                                       : Result<void>{};
        };
    }
    const auto ended = stage.walk({.frames = 4, .picture_every = 1}, observer);
    CHECK(message_of(ended) == "a, frame 2: disk full");
    CHECK(stage.plans(Event::Kind::executed, "a").size() == 3);
    CHECK(stage.targets_left() == 0);
}

TEST_CASE("contenders take turns, another one first on each frame", "[walk]") {
    Stage stage;
    for (const char* name : {"a", "b", "c"}) {
        stage.contend(name, Stage::plain(kGrey));
    }
    std::vector<int> progress;
    std::string seen;
    WalkObserver observer;
    observer.on_progress = [&](int frame, int frames) {
        CHECK(frames == 4);
        progress.push_back(frame);
    };
    observer.on_frame =
        [&](int frame, std::size_t contender, const View& view, const FramePlan& plan
        ) -> Result<void> {
        CHECK(view == small_walk(frame, kWidth, kHeight));
        CHECK(plan.cache == static_cast<std::uint32_t>(frame + 1));
        seen += std::to_string(frame) + stage.contenders[contender].name + " ";
        return {};
    };
    REQUIRE(stage.walk({.frames = 4, .reference_every = 0}, observer));
    CHECK(seen == "0a 0b 0c 1b 1c 1a 2c 2a 2b 3a 3b 3c ");
    CHECK(progress == std::vector<int>{1, 2, 3, 4});
    // Each is drawn as soon as it is planned.
    for (std::size_t i = 0; i < stage.events.size(); i += 2) {
        CAPTURE(i);
        CHECK(stage.events[i].kind == Event::Kind::planned);
        CHECK(stage.events[i + 1].kind == Event::Kind::executed);
        CHECK(stage.events[i].who == stage.events[i + 1].who);
        CHECK(stage.events[i].cache == stage.events[i + 1].cache);
    }
}

TEST_CASE("plain geometry is drawn beside what is divided by it", "[walk]") {
    Stage stage;
    for (const char* name : {"a", "b", "c"}) {
        stage.contend(name, Stage::plain(kGrey));
    }
    stage.reference = &stage.backend("reference", Stage::plain(kGrey));
    PaintedBackend& own = stage.backend("own", Stage::plain(kGrey));
    stage.contenders[1].reference = &own;
    stage.contenders[2].reference = &own;
    const WalkOptions options{.frames = 2, .reference_every = 1};
    REQUIRE(stage.walk(options));
    std::string executed;
    for (const Event& event : stage.events) {
        executed += event.kind == Event::Kind::executed ? event.who + " " : "";
    }
    std::string expected;
    for (const char* who : {"reference ", "own "}) {
        for (std::size_t i = 0; i < trials(options); ++i) {
            expected += who;
        }
    }
    expected += "reference a own b c "; // b is the first on frame 1
    expected += "reference own b c a ";
    CHECK(executed == expected);
}

TEST_CASE("each plan is executed once and in order, and once more for positions", "[walk]") {
    Stage stage;
    stage.contend("a", Stage::plain(kGrey)).positions =
        &stage.backend("a's positions", Stage::plain(kGrey));
    stage.contend("b", Stage::plain(kGrey));
    stage.reference = &stage.backend("reference", Stage::plain(kGrey));
    const auto result = stage.walk({.frames = 5, .reference_every = 2, .picture_every = 1});
    REQUIRE(result);
    const std::vector<std::uint32_t> once = {1, 2, 3, 4, 5};
    for (const char* who : {"a", "a's positions", "b"}) {
        CAPTURE(who);
        CHECK(stage.plans(Event::Kind::executed, who) == once);
    }
    CHECK(stage.plans(Event::Kind::planned, "a") == once);
    // Plans of contenders go to no other backend.
    const auto others = stage.plans(Event::Kind::executed, "reference");
    CHECK(std::all_of(others.begin(), others.end(), [](std::uint32_t plan) { return plan == 0; }));
    CHECK(result->contenders[0].disparity.has_value());
    CHECK(result->contenders[0].disparity->frames == 5);
    CHECK_FALSE(result->contenders[1].disparity.has_value());
    CHECK(stage.targets_left() == 0);
}

TEST_CASE("motion comes from frames already seen", "[walk]") {
    Stage stage;
    stage.contend("a", Stage::plain(kGrey));
    constexpr double kSeconds = 0.5;
    REQUIRE(stage.walk({.frames = 4, .frame_seconds = kSeconds, .reference_every = 0}));
    const std::vector<Motion>& motions = stage.planners[0].motions;
    REQUIRE(motions.size() == 4);
    CHECK(motions[0] == Motion{.frame_seconds = kSeconds});
    // Eyes of up to 75 m are rounded in double, twice a step, and divided by the time once or
    // twice.
    constexpr double kRounding = 8.0 * 75.0 * 2.3e-16 / (kSeconds * kSeconds);
    for (std::size_t frame = 1; frame < motions.size(); ++frame) {
        CAPTURE(frame);
        CHECK(motions[frame].frame_seconds == kSeconds);
        CHECK(glm::length(motions[frame].velocity - glm::dvec3(0.6, 0.0, -0.8)) < kRounding);
        CHECK(glm::length(motions[frame].acceleration) < kRounding);
    }
    CHECK(motions[1].acceleration == glm::dvec3(0.0));
}

TEST_CASE("references are drawn on the sampled frames alone", "[walk]") {
    Stage stage;
    stage.contend("a", Stage::plain(kGrey));
    PaintedBackend& reference = stage.backend("reference", Stage::plain(kGrey));
    PaintedBackend& truth = stage.backend("truth", Stage::plain(kGrey));
    stage.reference = &reference;
    stage.truth = &truth;
    const WalkOptions options{.frames = 40, .reference_every = 7, .seed = 5, .warm_up_frames = 2};
    const auto result = stage.walk(options);
    REQUIRE(result);
    const std::vector<int> sampled = eval::sampled_frames(40, 7, 5);
    REQUIRE(sampled.size() > 5);
    CHECK(reference.executed() == trials(options) + sampled.size());
    CHECK(truth.executed() == sampled.size());
    std::vector<double> drawn;
    for (const Event& event : stage.events) {
        if (event.who == "truth") {
            drawn.push_back(event.eye_x);
        }
    }
    std::vector<double> expected;
    std::vector<int> timed;
    expected.reserve(sampled.size());
    for (const int frame : sampled) {
        expected.push_back(small_walk(frame, kWidth, kHeight).eye.x);
    }
    for (const SampledTime& time : result->reference) {
        timed.push_back(time.frame);
        CHECK(time.ms > 0.0);
    }
    CHECK(drawn == expected);
    CHECK(timed == sampled);
    CHECK(result->reference_truth.size() == sampled.size());
    const std::set<int> held(sampled.begin(), sampled.end());
    for (int frame = 0; frame < 40; ++frame) {
        CAPTURE(frame);
        const WalkFrame& measured = result->contenders[0].frames[static_cast<std::size_t>(frame)];
        CHECK(measured.image.has_value() == (held.count(frame) != 0));
        CHECK(measured.truth.has_value() == (held.count(frame) != 0));
    }
}

TEST_CASE("pictures are shown on the frames asked for, and measured on sampled ones", "[walk]") {
    Stage stage;
    stage.contend("a", Stage::plain(kGrey));
    stage.contend("b", Stage::plain(u8vec3(100, 100, 110)));
    PaintedBackend& reference = stage.backend("reference", Stage::plain(kGrey));
    PaintedBackend& own = stage.backend("own", Stage::plain(kGrey));
    stage.reference = &reference;
    stage.contenders[1].reference = &own;
    std::string shown;
    WalkObserver observer;
    observer.on_pictures = [&](const WalkPictures& pictures) -> Result<void> {
        shown += std::to_string(pictures.frame) + stage.contenders[pictures.contender].name + " ";
        CHECK(pictures.reference.rgba[2] == 100);
        CHECK(pictures.picture.rgba[2] == (pictures.contender == 0 ? 100 : 110));
        CHECK(pictures.truth == nullptr);
        CHECK(pictures.disparity == nullptr);
        return {};
    };
    SECTION("never sampled") {
        WalkOptions options{.frames = 7, .reference_every = 0, .picture_every = 3};
        const auto result = stage.walk(options, observer);
        REQUIRE(result);
        CHECK(shown == "0a 0b 3b 3a 6a 6b ");
        CHECK(result->reference.empty());
        CHECK(reference.executed() == trials(options) + 3);
        // Its times alone are wanted, and none are taken.
        CHECK(own.executed() == trials(options));
        for (const WalkFrame& frame : result->contenders[1].frames) {
            CHECK_FALSE(frame.image.has_value());
        }
    }
    SECTION("with the references") {
        // Of 3 frames the first and the last are always sampled; with every = 3 there is no other.
        REQUIRE(
            stage.walk({.frames = 3, .reference_every = 3, .reference_pictures = true}, observer)
        );
        CHECK(shown == "0a 0b 2a 2b ");
    }
}

TEST_CASE("contenders of one backend and number of samples share their baseline", "[walk]") {
    Stage stage;
    for (const char* name : {"a", "b", "c", "d"}) {
        stage.contend(name, Stage::plain(kGrey));
    }
    PaintedBackend& reference = stage.backend("reference", Stage::plain(kGrey));
    PaintedBackend& shared = stage.backend("shared", Stage::plain(kSky));
    stage.reference = &reference;
    stage.contenders[1].reference = &shared;
    stage.contenders[2].reference = &shared;
    stage.contenders[3].reference = &shared;
    stage.contenders[3].samples = 4;
    const WalkOptions options{.frames = 6, .reference_every = 1, .warm_up_frames = 1};
    const auto result = stage.walk(options);
    REQUIRE(result);
    CHECK(reference.executed() == trials(options) + 6);
    CHECK(shared.executed() == 2 * (trials(options) + 6));
    CHECK(shared.targets_made() == 2);
    const auto same = [](const std::vector<SampledTime>& a, const std::vector<SampledTime>& b) {
        return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](auto one, auto other) {
            return one.frame == other.frame && one.ms == other.ms;
        });
    };
    CHECK(same(result->contenders[0].reference, result->reference));
    CHECK(same(result->contenders[1].reference, result->contenders[2].reference));
    // Six times in nanoseconds that were measured apart are not all the same by chance.
    CHECK_FALSE(same(result->contenders[0].reference, result->contenders[1].reference));
    CHECK_FALSE(same(result->contenders[1].reference, result->contenders[3].reference));
    // Pictures are held against the reference of the setup, whatever times are divided by.
    for (const ContenderResult& contender : result->contenders) {
        CHECK(contender.frames[0].image->psnr_db == eval::kMaxPsnrDb);
    }
}

TEST_CASE("figures of a contender come from its frames", "[walk]") {
    Stage stage;
    // Blue is 1, 2, 4, 8, 16 too much: the median of the errors is that of 4.
    const auto paint = [](const FramePlan& plan) {
        return u8vec3(100, 100, 100U + (1U << (plan.cache - 1U)));
    };
    Contender& a = stage.contend("a", paint);
    PaintedBackend& positions = stage.backend("positions", Stage::plain(kGrey));
    static_cast<PaintedBackend*>(a.backend)->bytes = {10, 500, 20, 30, 40};
    positions.bytes = {1, 2, 3, 100, 5};
    a.positions = &positions;
    a.error_px = 2.0;
    stage.reference = &stage.backend("reference", Stage::plain(kGrey));
    stage.truth = &stage.backend("truth", Stage::plain(u8vec3(100, 90, 100)));
    const auto result = stage.walk({.frames = 5, .reference_every = 1});
    REQUIRE(result);
    RunReport report;
    REQUIRE(eval::add_to_report(*result, 0, report));

    CHECK(report.frames == 5);
    CHECK(*report.image.psnr_db_median == Approx(psnr_of(4.0)));
    CHECK(*report.image.psnr_db_min == Approx(psnr_of(16.0)));
    CHECK(*report.image.missing_fraction == 0.0);
    CHECK(*report.image.extra_fraction == 0.0);
    CHECK(*report.image.ssim_median < 1.0);
    CHECK(*report.image.flip_mean > 0.0);
    CHECK(*report.truth.reference_psnr_db_median == Approx(psnr_of(10.0)));
    // Green is 10 too much on every frame, blue 4 on the middle one: the squares add up.
    CHECK(*report.truth.psnr_db_median == Approx(psnr_of(std::sqrt(116.0))));

    const std::vector<WalkFrame>& frames = result->contenders[0].frames;
    REQUIRE(frames.size() == 5);
    double total = 0.0;
    double reference = 0.0;
    double least = std::numeric_limits<double>::infinity();
    double most = 0.0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        CHECK(frames[i].plan_ms >= 0.0);
        CHECK(frames[i].frame_ms >= frames[i].plan_ms);
        const double ratio = result->contenders[0].reference[i].ms / frames[i].frame_ms;
        total += frames[i].frame_ms;
        reference += result->contenders[0].reference[i].ms;
        least = std::min(least, ratio);
        most = std::max(most, ratio);
    }
    CHECK(*report.frame_ms.total == Approx(total));
    CHECK(*report.frame_ms.mean == Approx(total / 5.0));
    CHECK(*report.frame_ms.first == frames[0].frame_ms);
    CHECK(*report.reference_frame_ms.total == Approx(reference));
    CHECK(*report.reference_frame_ms.sampled == 5);
    CHECK(*report.speedup.overall == Approx(reference / total));
    CHECK(*report.speedup.min == Approx(least));
    CHECK(*report.speedup.max == Approx(most));

    // One item a frame, and what the planner says of its images: 1, 2, ... 5 of them made.
    CHECK(*report.work.triangles_per_frame == static_cast<double>(world().item_primitives[1]));
    CHECK(*report.work.draw_calls_per_frame == 1.0);
    CHECK(*report.work.image_quads_per_frame == 0.0);
    CHECK(*report.work.splats_per_frame == 0.0);
    CHECK(*report.work.cubes_per_frame == 0.0);
    CHECK(*report.work.images_created == 15);
    CHECK(*report.work.combined == 5);
    CHECK(*report.work.new_count == 10);
    CHECK(*report.work.images_reused == 50);
    CHECK(*report.work.impossible == 30);
    CHECK(*report.work.stale == 10);
    CHECK(*report.work.evicted == 15);
    CHECK(*report.work.budget_misses == 20);
    CHECK(*report.memory.image_bytes_peak == 500);
    CHECK(*report.memory.aov_bytes == 700);

    // Nothing but background has positions here: nothing is shown too far off, and nothing right.
    CHECK_FALSE(report.disparity_px.median.has_value());
    CHECK_FALSE(report.disparity_px.max.has_value());
    CHECK_FALSE(report.disparity_px.tightness.has_value());
}

TEST_CASE("geometry that is not there, and background that should be", "[walk]") {
    Stage stage;
    stage.contend("blind", Stage::plain(kSky));
    stage.contend("solid", Stage::plain(kGrey));
    SECTION("where the reference shows geometry everywhere") {
        stage.reference = &stage.backend("reference", Stage::plain(kGrey));
        const auto result = stage.walk({.frames = 1, .reference_every = 1});
        REQUIRE(result);
        CHECK(result->contenders[0].frames[0].image->missing_fraction == 1.0);
        CHECK(result->contenders[0].frames[0].image->extra_fraction == 0.0);
        // The border of the picture has no neighbours there, so it counts as inside.
        CHECK(result->contenders[0].sky_holes == std::uint64_t{kWidth} * kHeight);
        RunReport report;
        REQUIRE(eval::add_to_report(*result, 0, report));
        CHECK(*report.image.missing_fraction == 1.0);
        CHECK(*report.image.extra_fraction == 0.0);
        CHECK(result->contenders[1].frames[0].image->missing_fraction == 0.0);
        CHECK(result->contenders[1].sky_holes == 0);
    }
    SECTION("where it shows none") {
        stage.reference = &stage.backend("reference", Stage::plain(kSky));
        const auto result = stage.walk({.frames = 1, .reference_every = 1});
        REQUIRE(result);
        for (const ContenderResult& contender : result->contenders) {
            CHECK_FALSE(contender.frames[0].image->missing_fraction.has_value());
            CHECK_FALSE(contender.frames[0].image->extra_fraction.has_value());
            CHECK(contender.sky_holes == 0);
        }
    }
}

TEST_CASE("errors that take long are measured only where they are wanted and defined", "[walk]") {
    Stage stage;
    stage.contend("a", Stage::plain(kGrey));
    stage.reference = &stage.backend("reference", Stage::plain(kGrey));
    const auto without =
        stage.walk({.frames = 1, .reference_every = 1, .perceptual_errors = false});
    REQUIRE(without);
    CHECK_FALSE(without->contenders[0].frames[0].image->ssim.has_value());
    CHECK_FALSE(without->contenders[0].frames[0].image->flip.has_value());
    CHECK(without->contenders[0].frames[0].image->psnr_db == eval::kMaxPsnrDb);
    // The window of SSIM does not fit into 10 rows.
    WalkSetup setup = stage.setup();
    setup.view = [](int frame) { return small_walk(frame, kWidth, 10); };
    const auto low = eval::walk(setup, {.frames = 1, .reference_every = 1});
    REQUIRE(low);
    CHECK_FALSE(low->contenders[0].frames[0].image->ssim.has_value());
    CHECK(low->contenders[0].frames[0].image->flip == 0.0);
}

TEST_CASE("without a reference there are times and work, and nothing else", "[walk]") {
    NullBackend backend(world().item_primitives, &world().hierarchy);
    auto cache = farfield::ImageCache::create(
        world().hierarchy, farfield::presets::shade1996({.error_px = 4.0})
    );
    REQUIRE(cache);
    Contender contender;
    contender.name = "images";
    contender.planner.plan = [&](const View& view, const Motion& motion) -> const FramePlan& {
        return cache->plan(view, motion);
    };
    contender.planner.statistics = [&]() -> const ImageCacheStatistics& {
        return cache->statistics();
    };
    contender.backend = &backend;
    WalkSetup setup;
    setup.contenders = {&contender, 1};
    setup.hierarchy = &world().hierarchy;
    setup.item_primitives = world().item_primitives;
    setup.view = [](int frame) { return small_walk(frame, 160, 120); };
    const auto result = eval::walk(setup, {.frames = 20, .reference_every = 1});
    REQUIRE(result);
    CHECK(backend.plans_executed() == 20);
    RunReport report;
    REQUIRE(eval::add_to_report(*result, 0, report));
    CHECK(*report.frame_ms.total > 0.0);
    CHECK(*report.work.images_created > 0);
    // The backend counts what the plans say, image by image.
    CHECK(*report.work.texels_created == backend.total_work().image_texels);
    CHECK(*report.memory.image_bytes_peak > 0);
    CHECK_FALSE(report.speedup.overall.has_value());
    CHECK_FALSE(report.reference_frame_ms.total.has_value());
    CHECK_FALSE(report.image.psnr_db_median.has_value());
    CHECK_FALSE(report.truth.psnr_db_median.has_value());
    CHECK_FALSE(report.disparity_px.max.has_value());
    CHECK_FALSE(report.memory.aov_bytes.has_value());
}

TEST_CASE("plain geometry has a report of its own", "[walk]") {
    Stage stage;
    stage.contend("a", Stage::plain(kGrey));
    RunReport report;
    SECTION("with the times of all frames, and the truth") {
        stage.reference = &stage.backend("reference", Stage::plain(kGrey));
        stage.truth = &stage.backend("truth", Stage::plain(u8vec3(100, 100, 107)));
        const auto result = stage.walk({.frames = 9, .reference_every = 4});
        REQUIRE(result);
        REQUIRE(eval::add_reference_to_report(*result, report));
        CHECK(report.frames == 9);
        CHECK(*report.speedup.overall == 1.0);
        CHECK(*report.reference_frame_ms.sampled == result->reference.size());
        CHECK(*report.frame_ms.total == Approx(*report.reference_frame_ms.total));
        CHECK(*report.frame_ms.first == result->reference[0].ms);
        CHECK(*report.truth.psnr_db_median == Approx(psnr_of(7.0)));
        CHECK(report.truth.reference_psnr_db_median == report.truth.psnr_db_median);
        // Against itself it has no errors to tell.
        CHECK_FALSE(report.image.psnr_db_median.has_value());
    }
    SECTION("and none where it was not drawn") {
        const auto result = stage.walk({.frames = 2});
        REQUIRE(result);
        REQUIRE(eval::add_reference_to_report(*result, report));
        CHECK(report.frames == 0);
        CHECK_FALSE(report.frame_ms.total.has_value());
        CHECK_FALSE(report.speedup.overall.has_value());
    }
}

TEST_CASE("the table of frames has the columns that its documentation names", "[walk]") {
    Stage stage;
    stage.contend("a", Stage::plain(u8vec3(100, 100, 110)));
    stage.reference = &stage.backend("reference", Stage::plain(kGrey));
    const auto result = stage.walk({.frames = 3, .reference_every = 3});
    REQUIRE(result);
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() /
        ("farfield_test_walk_" + std::to_string(::getpid()) + ".csv");
    REQUIRE(eval::save_frames(*result, 0, file));
    const std::vector<std::string> lines = split(read_file(file), '\n');
    std::filesystem::remove(file);
    REQUIRE(lines.size() == 5);
    CHECK(lines[4].empty());
    const std::vector<std::string> columns = split(lines[0], ',');
    CHECK(columns == documented_columns());
    REQUIRE(columns.size() == 17);
    for (std::size_t frame = 0; frame < 3; ++frame) {
        CAPTURE(frame);
        const std::vector<std::string> cells = split(lines[frame + 1], ',');
        REQUIRE(cells.size() == columns.size());
        const bool sampled = frame != 1;
        for (std::size_t i = 0; i < cells.size(); ++i) {
            CAPTURE(columns[i]);
            static const std::set<std::string> kOfReference = {
                "reference_ms", "psnr_db", "ssim", "flip"};
            static const std::set<std::string> kNever = {
                "truth_psnr_db", "disparity_p99_px", "disparity_max_px"};
            const bool measured =
                kNever.count(columns[i]) == 0 && (sampled || kOfReference.count(columns[i]) == 0);
            CHECK(cells[i].empty() != measured);
        }
        CHECK(cells[0] == std::to_string(frame));
        // Written with six digits behind the point.
        CHECK(
            std::stod(cells[1]) == Approx(result->contenders[0].frames[frame].frame_ms).margin(1e-6)
        );
        CHECK(cells[12] == std::to_string(frame + 1)); // images_created
    }
    CHECK(std::stod(split(lines[1], ',')[4]) == Approx(psnr_of(10.0)).margin(1e-6));
    CHECK_FALSE(eval::save_frames(*result, 0, "/nonexistent/frames.csv"));
}
