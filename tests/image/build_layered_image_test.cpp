#include "image/analytic_views.hpp"
#include "image/layered_images.hpp"
#include <farfield/core/executor.hpp>
#include <farfield/image/build_layered_image.hpp>
#include <farfield/image/layered_warp.hpp>

#include <catch2/catch.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;
using glm::dvec3;

namespace {

View central_view(int width = 96, int height = 72) {
    View view = straight_view(width, height);
    view.lens.far_distance = 60.0;
    return view;
}

/// Balls against nothing.
AnalyticScene ball_scene() {
    AnalyticScene scene;
    scene.balls = {
        {{-2.0, 0.5, -10.0}, 1.5},
        {{1.5, -0.5, -8.0}, 1.0},
        {{0.3, 1.2, -14.0}, 2.0},
        {{3.5, 1.5, -12.0}, 1.2},
        {{-1.0, -2.0, -9.0}, 0.6}};
    return scene;
}

/// The same in a room of a floor, a wall beside that is seen at a slant, and one at the end.
AnalyticScene room_scene() {
    AnalyticScene scene = ball_scene();
    scene.planes = {
        {{0.0, 1.0, 0.0}, -3.0},
        {glm::normalize(dvec3(1.0, 0.0, 0.15)), -6.0},
        {{0.0, 0.0, 1.0}, -20.0}};
    return scene;
}

/// One plane across the view, 10 m away.
AnalyticScene wall_scene() {
    AnalyticScene scene;
    scene.planes = {{{0.0, 0.0, 1.0}, -10.0}};
    return scene;
}

std::vector<ConstructionView> pictures(const AnalyticScene& scene, const std::vector<View>& views) {
    std::vector<ConstructionView> all;
    all.reserve(views.size());
    for (const View& view : views) {
        all.push_back(scene.picture(view));
    }
    return all;
}

BuiltLayeredImage build(
    const AnalyticScene& scene,
    const View& central,
    const std::vector<ConstructionView>& views,
    const LayeredImageOptions& options = {.keep_points = true}
) {
    Result<BuiltLayeredImage> built = build_layered_image(central, views, scene.frames(), options);
    INFO((built ? "" : built.error().message));
    REQUIRE(built.has_value());
    const Result<void> valid = validate(built->image);
    INFO((valid ? "" : valid.error().message));
    REQUIRE(valid.has_value());
    const LayeredImageQuality& quality = built->quality;
    CHECK(quality.samples == built->image.samples.size());
    CHECK(quality.seen == quality.samples + quality.merged + quality.outside + quality.crowded);
    return std::move(*built);
}

/// What a warp shows against what is there, over some eyes.
struct Comparison {
    std::size_t visible = 0; ///< pixels with something that the central window has as well
    std::size_t holes = 0;   ///< of them, without anything
    std::size_t grown = 0;   ///< pixels of a ball where there is none
    std::size_t rim = 0;     ///< pixels that differ from one of two neighbours in what is there
};

Comparison
look(const AnalyticScene& scene, const BuiltLayeredImage& built, const std::vector<dvec3>& eyes) {
    const View& central = built.image.view;
    const std::vector<glm::dmat4x3> frames = scene.frames();
    Comparison sum;
    LayeredWarper warper;
    WarpedLayers warped;
    SerialExecutor executor;
    for (const dvec3& eye : eyes) {
        View view = straight_view(central.width, central.height, 0.8);
        view.eye = central.eye + eye;
        warper.warp(built.image, view, executor, warped, true);
        const PositionPicture truth = scene.picture(view).positions;
        const auto item_at = [&](int x, int y) {
            return truth.texels[pixel_at(view, x, view.height - 1 - y)];
        };
        for (int y = 0; y + 1 < view.height; ++y) {
            for (int x = 0; x + 1 < view.width; ++x) {
                const PositionTexel there = item_at(x, y);
                sum.rim +=
                    there.item != item_at(x + 1, y).item || there.item != item_at(x, y + 1).item
                        ? 1
                        : 0;
                const std::uint32_t shown = warped.samples[pixel_at(view, x, y)];
                const ItemId item =
                    shown == UINT32_MAX ? kNone<ItemId> : built.image.points[shown].item;
                if (item != there.item && index_of(item) < scene.balls.size()) {
                    ++sum.grown;
                }
                if (there.item == kNone<ItemId>) {
                    continue;
                }
                const dvec3 point =
                    frames[index_of(there.item)] * glm::dvec4(dvec3(there.point), 1.0);
                const dvec3 seen = point - central.eye;
                const Lens& lens = central.lens;
                if (-seen.z < lens.far_distance && std::abs(seen.x / seen.z) < 0.98 * lens.right &&
                    std::abs(seen.y / seen.z) < 0.98 * lens.top) {
                    ++sum.visible;
                    sum.holes += item == kNone<ItemId> ? 1 : 0;
                }
            }
        }
    }
    return sum;
}

const std::vector<dvec3> kEyes = {
    {0.5, 0.0, 0.0}, {-0.6, 0.3, 0.0}, {0.3, 0.3, 0.5}, {0.5, -0.4, -0.8}, {1.2, 0.0, -1.0}};

} // namespace

TEST_CASE("a wall straight ahead is one sample a texel, in its middle") {
    const AnalyticScene scene = wall_scene();
    const View central = central_view(32, 24);
    const BuiltLayeredImage built = build(scene, central, {scene.picture(central)});
    const LayeredDepthImage& image = built.image;
    CHECK(image.view == central);
    REQUIRE(image.samples.size() == pixel_count(central));
    CHECK(built.quality.most_layers == 1);
    CHECK(built.quality.mean_layers == 1.0);
    CHECK(image.near_depth == Approx(10.0).epsilon(1e-6));
    CHECK(image.far_depth > image.near_depth);
    const ConstructionView made = scene.picture(central);
    for (std::size_t i = 0; i < image.samples.size(); ++i) {
        const LayeredSample& sample = image.samples[i];
        CHECK(sample.x == 16 * (i % 32) + 8);
        CHECK(sample.y == 16 * (i / 32) + 8);
        CHECK(sample.extent == 288); // 1.125 texels
        const std::size_t pixel = (23 - i / 32) * 32 + i % 32;
        CHECK(sample.color.g == made.colors.rgba[4 * pixel + 1]);
        CHECK(sample.color.a == 255);
        CHECK(image.points[i].point == made.positions.texels[pixel].point);
        CHECK(image.points[i].item == ItemId{0});
    }
}

TEST_CASE("without pictures, or with nothing in them, the image is empty") {
    const View central = central_view();
    const AnalyticScene scene = wall_scene();
    CHECK(build(scene, central, {}).image.samples.empty());
    const AnalyticScene none;
    const BuiltLayeredImage built = build(none, central, {none.picture(central)});
    CHECK(built.image.samples.empty());
    CHECK(built.quality.seen == 0);
    CHECK(built.quality.mean_layers == 0.0);
    // Behind the central eye, and beyond its far plane.
    View back = central;
    back.eye = {0.0, 0.0, -20.0};
    back.camera_to_world = {{-1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, -1.0}};
    const AnalyticScene behind = {.balls = {{{0.0, 0.0, 8.0}, 2.0}}, .planes = {}};
    const BuiltLayeredImage outside = build(behind, central, {behind.picture(back)});
    CHECK(outside.quality.seen > 10);
    CHECK(outside.quality.outside == outside.quality.seen);
    View near = central;
    near.lens.far_distance = 9.0;
    CHECK(build(scene, near, {scene.picture(central)}).image.samples.empty());
    near.lens.far_distance = 60.0;
    near.lens.near_distance = 11.0;
    CHECK(build(scene, near, {scene.picture(central)}).image.samples.empty());
}

TEST_CASE("what does not fit together is refused by name") {
    const AnalyticScene scene = wall_scene();
    const View central = central_view(8, 6);
    const auto check_refused = [&](const std::string& text,
                                   const std::function<void(ConstructionView&)>& damage,
                                   const LayeredImageOptions& options = {}) {
        std::vector<ConstructionView> views = {scene.picture(central), scene.picture(central)};
        damage(views[1]);
        const auto built = build_layered_image(central, views, scene.frames(), options);
        INFO(text);
        REQUIRE_FALSE(built.has_value());
        CHECK_THAT(
            built.error().message,
            Catch::StartsWith("layered depth image: ") && Catch::Contains(text)
        );
    };
    const auto nothing = [](ConstructionView&) {};
    check_refused("merge_distance is 0.8", nothing, {.merge_distance = 0.8F});
    check_refused("merge_distance is -", nothing, {.merge_distance = -0.1F});
    check_refused("overlap is 0.9", nothing, {.overlap = 0.9F});
    check_refused("overlap is nan", nothing, {.overlap = std::nanf("")});
    check_refused("most_stretch is 17", nothing, {.most_stretch = 17.0F});
    check_refused("construction view 1: view: width is 0", [](ConstructionView& bad) {
        bad.view.width = 0;
    });
    check_refused("colours of 7 x 6 pixels", [](ConstructionView& bad) { bad.colors.width = 7; });
    check_refused("in 191 bytes", [](ConstructionView& bad) { bad.colors.rgba.pop_back(); });
    check_refused("positions of 8 x 5", [](ConstructionView& bad) { bad.positions.height = 5; });
    check_refused("47 of them there", [](ConstructionView& bad) {
        bad.positions.texels.pop_back();
    });
    check_refused("pixel 3, 2 from the upper left: item 1, there are frames of 1", [](auto& bad) {
        bad.positions.texels[2 * 8 + 3].item = ItemId{1};
    });
    check_refused("view 1: pixel 0, 1 from the upper left: the point nan", [](auto& bad) {
        bad.positions.texels[8].point.x = std::numeric_limits<float>::quiet_NaN();
    });
    View bad = central;
    bad.width = 5000;
    const auto large = build_layered_image(bad, {}, {});
    REQUIRE_FALSE(large.has_value());
    CHECK_THAT(large.error().message, Catch::Contains("5000 x 6 texels, at most 4096"));
    bad.width = 0;
    CHECK_FALSE(build_layered_image(bad, {}, {}).has_value());
}

TEST_CASE("samples are where their points are") {
    const AnalyticScene scene = room_scene();
    View central = central_view();
    central.eye = {0.3, 0.2, 0.5};
    const BuiltLayeredImage built =
        build(scene, central, pictures(scene, construction_views(central, 8.0)));
    const LayeredDepthImage& image = built.image;
    const std::vector<glm::dmat4x3> frames = scene.frames();
    CHECK(built.quality.mean_layers > 1.2);
    for (std::size_t i = 0; i < image.samples.size(); ++i) {
        const LayeredSample& sample = image.samples[i];
        const PositionTexel& texel = image.points[i];
        const dvec3 seen =
            frames[index_of(texel.item)] * glm::dvec4(dvec3(texel.point), 1.0) - central.eye;
        const Lens& lens = central.lens;
        const double x = (seen.x / -seen.z - lens.left) / (lens.right - lens.left) * 96 * 16;
        const double y = (seen.y / -seen.z - lens.bottom) / (lens.top - lens.bottom) * 72 * 16;
        CAPTURE(i, x, y, seen.z);
        // Rounded to the nearest step, the last one to that before; points to float.
        CHECK(std::abs(std::min(x, 96 * 16 - 1.0) - sample.x) < 0.51);
        CHECK(std::abs(std::min(y, 72 * 16 - 1.0) - sample.y) < 0.51);
        const double far = 1.0 / image.far_depth;
        const double step = (1.0 / image.near_depth - far) / 65535.0;
        CHECK(std::abs(1.0 / -seen.z - far - sample.depth * step) < 0.51 * step);
        CHECK(sample.color.r == index_of(texel.item));
    }
}

TEST_CASE("the nearest view's samples stay, whatever the order") {
    const AnalyticScene scene = wall_scene();
    const View central = central_view(32, 24);
    std::vector<ConstructionView> views = pictures(scene, construction_views(central, 8.0));
    const auto tint = [](ConstructionView& made, std::uint8_t color) {
        for (std::size_t i = 2; i < made.colors.rgba.size(); i += 4) {
            made.colors.rgba[i] = color;
        }
    };
    for (std::size_t i = 0; i < views.size(); ++i) {
        tint(views[i], static_cast<std::uint8_t>(i));
    }
    std::reverse(views.begin(), views.end());
    const BuiltLayeredImage built = build(scene, central, views);
    CHECK(built.image.samples.size() == pixel_count(central));
    CHECK(built.quality.merged + built.quality.outside == 8 * pixel_count(central));
    for (const LayeredSample& sample : built.image.samples) {
        CHECK(sample.color.b == 0);
    }
    // Without merging all are there.
    const BuiltLayeredImage all =
        build(scene, central, views, {.merge_distance = 0.0F, .keep_points = false});
    CHECK(all.quality.samples > 6 * pixel_count(central));
    CHECK(all.image.points.empty());
}

TEST_CASE("a texel keeps its 255 nearest samples") {
    // A wall that leans back, through 17 x 17 pixels in one texel.
    AnalyticScene scene;
    scene.planes = {{dvec3(0.0, 0.5, 1.0), -10.0}};
    const View central = central_view(1, 1);
    const View fine = central_view(17, 17);
    const ConstructionView made = scene.picture(fine);
    const BuiltLayeredImage built =
        build(scene, central, {made}, {.merge_distance = 0.0F, .keep_points = true});
    REQUIRE(built.quality.seen == pixel_count(fine));
    REQUIRE(built.quality.outside == 0);
    CHECK(built.quality.most_layers == 255);
    // The image has 16 steps to a texel: of each row two samples are at one place, and merged.
    CHECK(built.quality.merged == 17);
    CHECK(built.quality.crowded == 17);
    // Rows of pixels are the farther the higher: the uppermost one is missing.
    const auto height = [&](const PositionTexel& texel) {
        return (scene.frames()[0] * glm::dvec4(dvec3(texel.point), 1.0)).y;
    };
    const auto is_lower = [&](const PositionTexel& a, const PositionTexel& b) {
        return height(a) < height(b);
    };
    const std::vector<PositionTexel>& all = made.positions.texels;
    const std::vector<PositionTexel>& kept = built.image.points;
    const double highest = height(*std::max_element(all.begin(), all.end(), is_lower));
    const double highest_kept = height(*std::max_element(kept.begin(), kept.end(), is_lower));
    CHECK(highest_kept < highest - 0.1);
    CHECK(height(kept.back()) == Approx(highest_kept)); // near to far
}

TEST_CASE("from where they were taken, pictures come back") {
    const AnalyticScene scene = room_scene();
    const View central = central_view();
    const BuiltLayeredImage built =
        build(scene, central, pictures(scene, construction_views(central, 8.0)));
    LayeredWarper warper;
    WarpedLayers warped;
    SerialExecutor executor;
    warper.warp(built.image, central, executor, warped, true, LayeredFront::depth);
    const PositionPicture truth = scene.picture(central).positions;
    const auto item_at = [&](int x, int y) {
        return truth.texels[pixel_at(central, x, 71 - y)].item;
    };
    REQUIRE(std::count(warped.samples.begin(), warped.samples.end(), UINT32_MAX) == 0);
    // Squares of balls reach over their rims: those of views from behind, which are 1.5 times as
    // far away, have sides of up to 1.5 * 1.25 * 1.125 = 2.1 texels, and reach 1.1 texels beyond;
    // where they end and where a ball does may be between centres of pixels. Nothing shows through.
    for (int y = 0; y < 72; ++y) {
        for (int x = 0; x < 96; ++x) {
            const std::uint32_t sample = warped.samples[pixel_at(central, x, y)];
            bool is_near = false;
            for (int over = std::max(y - 2, 0); over <= std::min(y + 2, 71); ++over) {
                for (int beside = std::max(x - 2, 0); beside <= std::min(x + 2, 95); ++beside) {
                    is_near = is_near || item_at(beside, over) == built.image.points[sample].item;
                }
            }
            CAPTURE(x, y);
            CHECK(is_near);
        }
    }
    // The picture of the central view alone is what it was, in order as well.
    const BuiltLayeredImage single = build(scene, central, {scene.picture(central)});
    warper.warp(single.image, central, executor, warped, true);
    for (int i = 0; i < 96 * 72; ++i) {
        const auto pixel = static_cast<std::size_t>(i);
        CHECK(single.image.points[warped.samples[pixel]].item == item_at(i % 96, i / 96));
    }
}

TEST_CASE("nine views leave next to no holes, and hardly grow what they show") {
    const View central = central_view();
    for (const bool in_room : {false, true}) {
        const AnalyticScene scene = in_room ? room_scene() : ball_scene();
        const std::vector<ConstructionView> views =
            pictures(scene, construction_views(central, 8.0));
        const Comparison one = look(scene, build(scene, central, {views[0]}), kEyes);
        const BuiltLayeredImage built = build(scene, central, views);
        const Comparison nine = look(scene, built, kEyes);
        const auto share = [](std::size_t part, std::size_t whole) {
            return static_cast<double>(part) / static_cast<double>(whole);
        };
        const double one_holes = share(one.holes, one.visible);
        const double nine_holes = share(nine.holes, nine.visible);
        // A pixel is 0.77 texels wide.
        const double growth_texels = 0.77 * share(nine.grown, nine.rim);
        CAPTURE(in_room, one_holes, nine_holes, growth_texels, built.quality.mean_layers);
        CHECK(one.visible > (in_room ? 25'000 : 1500));
        CHECK(one_holes > 0.01); // what is hidden from one eye is not there
        CHECK(nine_holes < 0.001);
        CHECK(growth_texels < 0.75);
        CHECK(built.quality.mean_layers < 3.0);
    }
}

TEST_CASE("a build is the same on every run, and far from the origin nearly so") {
    const View central = central_view();
    const AnalyticScene scene = ball_scene();
    const std::vector<ConstructionView> views = pictures(scene, construction_views(central, 8.0));
    const BuiltLayeredImage built = build(scene, central, views);
    CHECK(build(scene, central, views).image == built.image);

    const dvec3 far(1e7, -2e7, 3e6);
    AnalyticScene moved = scene;
    for (AnalyticScene::Ball& ball : moved.balls) {
        ball.middle += far;
    }
    View there = central;
    there.eye += far;
    const BuiltLayeredImage other =
        build(moved, there, pictures(moved, construction_views(there, 8.0)));
    // Rounding of eyes and frames to some 1e-9 m moves few pixels over a step.
    const double share =
        static_cast<double>(other.quality.samples) / static_cast<double>(built.quality.samples);
    CHECK(share == Approx(1.0).margin(0.002));
}
