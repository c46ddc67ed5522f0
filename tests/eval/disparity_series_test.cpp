#include <farfield/eval/disparity_series.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <vector>

namespace {

using farfield::DisparitySeries;
using farfield::DisparitySummary;
using farfield::FrameDisparity;
using farfield::NodeDisparity;
namespace eval = farfield::eval;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// One image with one pixel.
struct Image {
    std::uint32_t node = 0;
    double disparity_px = 0.0;
    double sampling_px = 0.0;
};

FrameDisparity frame_of(std::optional<double> error_px, std::initializer_list<Image> images) {
    FrameDisparity frame;
    frame.error_px = error_px;
    if (error_px) {
        frame.over_bound = 0;
    }
    for (const Image& image : images) {
        NodeDisparity node;
        node.node = image.node;
        node.pixels = 1;
        node.disparity_px = image.disparity_px;
        node.sampling_px = image.sampling_px;
        if (error_px) {
            const double promise = *error_px + image.sampling_px;
            node.over_bound = image.disparity_px > promise ? 1 : 0;
            *frame.over_bound += node.over_bound;
            frame.bound_px = std::max(frame.bound_px.value_or(0.0), promise);
        }
        ++frame.image_pixels;
        frame.histogram.add(image.disparity_px);
        frame.nodes.push_back(node);
    }
    return frame;
}

const std::vector<std::uint32_t> kNothing;

} // namespace

TEST_CASE("a series without frames has no figures", "[disparity_series]") {
    const DisparitySummary summary = DisparitySeries{}.summary();
    CHECK(summary.frames == 0);
    CHECK_FALSE(summary.median_px.has_value());
    CHECK_FALSE(summary.p99_px.has_value());
    CHECK_FALSE(summary.max_px.has_value());
    CHECK_FALSE(summary.bound_px.has_value());
    CHECK_FALSE(summary.over_bound.has_value());
    CHECK_FALSE(summary.geometry_max_px.has_value());
    CHECK_FALSE(summary.tightness.has_value());
    CHECK(summary.worst.empty());
}

TEST_CASE("figures are of the pixels of all frames", "[disparity_series]") {
    DisparitySeries series;
    FrameDisparity first = frame_of(2.0, {{1, 0.5, 0.0}, {2, 1.5, 0.7}, {3, 4.0, 1.0}});
    first.geometry_pixels = 10;
    first.geometry_max_px = 1e-4;
    first.unmeasured_pixels = 2;
    FrameDisparity second = frame_of(2.0, {{2, 1.0, 0.7}, {5, kInfinity, 0.3}});
    second.geometry_pixels = 5;
    second.geometry_max_px = 3e-5;
    second.infinite_pixels = 1;
    series.add(0, first, kNothing);
    series.add(1, second, kNothing);
    const DisparitySummary summary = series.summary();
    CHECK(summary.frames == 2);
    CHECK(summary.image_pixels == 5);
    CHECK(summary.geometry_pixels == 15);
    CHECK(summary.unmeasured_pixels == 2);
    CHECK(summary.infinite_pixels == 1);
    CHECK(*summary.median_px == Approx(1.5).epsilon(1.0 / 128.0));
    CHECK(summary.p99_px == kInfinity);
    CHECK(summary.max_px == kInfinity);
    CHECK(summary.bound_px == 3.0);
    CHECK(summary.over_bound == 2U);
    CHECK(summary.geometry_max_px == 1e-4);
    CHECK(summary.histogram.count() == 5);
}

TEST_CASE("a technique without a promise has disparity and no bound", "[disparity_series]") {
    DisparitySeries series;
    series.add(0, frame_of(std::nullopt, {{1, 5.0, 0.0}}), kNothing);
    series.add(1, frame_of(std::nullopt, {{1, 1.0, 0.0}}), std::vector<std::uint32_t>{1});
    const DisparitySummary summary = series.summary();
    CHECK(summary.max_px == 5.0);
    CHECK_FALSE(summary.bound_px.has_value());
    CHECK_FALSE(summary.over_bound.has_value());
    CHECK_FALSE(summary.tightness.has_value());
    CHECK(summary.remade_images == 0);
    CHECK(summary.worst.empty());
}

TEST_CASE("tightness is what images used before they were made anew", "[disparity_series]") {
    const std::vector<std::uint32_t> five = {5};
    DisparitySeries series;
    series.add(0, frame_of(2.0, {{5, 0.3, 0.3}}), five); // made, not made anew
    series.add(1, frame_of(2.0, {{5, 1.2, 0.3}}), kNothing);
    series.add(2, frame_of(2.0, {{5, 2.1, 0.3}}), kNothing);
    CHECK_FALSE(series.summary().tightness.has_value());
    series.add(3, frame_of(2.0, {{5, 0.2, 0.3}}), std::vector<std::uint32_t>{5, 5, 9});
    CHECK(series.summary().remade_images == 1);
    CHECK(*series.summary().tightness == Approx(0.9).epsilon(1.0 / 128.0)); // (2.1 - 0.3) / 2

    // Hidden for a frame before it was made anew: what it would have used is not known.
    series.add(4, frame_of(2.0, {}), kNothing);
    series.add(5, frame_of(2.0, {{5, 0.2, 0.0}}), five);
    CHECK(series.summary().remade_images == 1);

    // Made anew, but no longer in the picture: the frame before counts all the same.
    series.add(6, frame_of(2.0, {}), five);
    CHECK(series.summary().remade_images == 2);

    // Frames left out.
    series.add(8, frame_of(2.0, {{5, 1.0, 0.0}}), kNothing);
    series.add(10, frame_of(2.0, {{5, 1.0, 0.0}}), five);
    CHECK(series.summary().remade_images == 2);

    // Error of sampling that was smaller than its bound: 0, not less.
    series.add(11, frame_of(2.0, {{6, 0.1, 0.7}}), kNothing);
    series.add(12, frame_of(2.0, {{6, 0.1, 0.7}}), std::vector<std::uint32_t>{6});
    const DisparitySummary summary = series.summary();
    CHECK(summary.remade_images == 3);
    CHECK(*summary.tightness == Approx(0.1).epsilon(1.0 / 128.0)); // of 0, 0.1 and 0.9
}

TEST_CASE("the worst nodes come first, each in its worst frame", "[disparity_series]") {
    DisparitySeries series;
    series.add(3, frame_of(1.0, {{1, 1.5, 0.0}, {2, 3.0, 1.0}, {4, 0.9, 0.0}}), kNothing);
    series.add(4, frame_of(1.0, {{1, 2.5, 0.25}, {2, 2.5, 1.0}, {7, 2.25, 0.0}}), kNothing);
    series.add(5, frame_of(1.0, {{1, 1.0, 0.0}, {9, 2.0, 0.0}}), kNothing);
    const DisparitySummary summary = series.summary();
    CHECK(summary.over_bound == 6U);
    REQUIRE(summary.worst.size() == 4);
    // Beyond by 1.25, 1.25, 1 and 1: among equals the lower node comes first.
    CHECK(summary.worst[0] == farfield::NodeOvershoot{1, 4, 2.5, 1.25, 1});
    CHECK(summary.worst[1] == farfield::NodeOvershoot{7, 4, 2.25, 1.0, 1});
    CHECK(summary.worst[2] == farfield::NodeOvershoot{2, 3, 3.0, 2.0, 1});
    CHECK(summary.worst[3] == farfield::NodeOvershoot{9, 5, 2.0, 1.0, 1});
    const DisparitySummary two = series.summary(2);
    REQUIRE(two.worst.size() == 2);
    CHECK(two.worst[1].node == 7);
    CHECK(series.summary(0).worst.empty());
}

TEST_CASE("images that a plan makes are listed once", "[disparity_series]") {
    farfield::FramePlan plan;
    CHECK(eval::images_made(plan).empty());
    for (const std::uint32_t node : {8U, 3U, 8U, UINT32_MAX}) {
        plan.passes.emplace_back().node = node;
    }
    CHECK(eval::images_made(plan) == std::vector<std::uint32_t>{3, 8});
}
