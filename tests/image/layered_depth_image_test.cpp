#include "image/layered_images.hpp"
#include <farfield/image/layered_depth_image.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

/// 3 x 2 texels: two samples in texel 1, 0, one in texel 2, 1.
LayeredDepthImage small_image() {
    const auto fill = [](int column, int row, std::vector<LayeredSample>& samples) {
        if (column == 1 && row == 0) {
            samples = {sample_in(1, 0, 900), sample_in(1, 0, 100)};
        } else if (column == 2 && row == 1) {
            samples = {sample_in(2, 1, 65535, 0, 15)};
        }
    };
    return layered_image(straight_view(3, 2), 1.0, 8.0, fill);
}

void check_refused(const std::string& text, const std::function<void(LayeredDepthImage&)>& damage) {
    LayeredDepthImage image = small_image();
    damage(image);
    const Result<void> valid = validate(image);
    INFO(text);
    REQUIRE_FALSE(valid.has_value());
    CHECK(valid.error().code == ErrorCode::bad_data);
    CHECK_THAT(
        valid.error().message, Catch::StartsWith("layered depth image: ") && Catch::Contains(text)
    );
}

} // namespace

TEST_CASE("layered images of any content pass, even of none") {
    CHECK(validate(small_image()).has_value());
    const auto none = [](int, int, std::vector<LayeredSample>&) {};
    CHECK(validate(layered_image(straight_view(3, 2), 1.0, 8.0, none)).has_value());
    CHECK(validate(layered_image(straight_view(1, 1), 1.0, 8.0, none)).has_value());
    const auto full = [](int column, int row, std::vector<LayeredSample>& samples) {
        samples.assign(255, sample_in(column, row, 7)); // samples at one depth are in order
    };
    CHECK(validate(layered_image(straight_view(2, 2), 1.0, 8.0, full)).has_value());

    LayeredDepthImage pointed = small_image();
    pointed.points.resize(3);
    CHECK(validate(pointed).has_value());
}

TEST_CASE("what is wrong with a layered image is named") {
    const LayeredDepthImage image;
    REQUIRE_FALSE(validate(image).has_value());
    CHECK_THAT(validate(image).error().message, Catch::StartsWith("view: width"));

    check_refused("4097 x 1 texels, at most 4096", [](LayeredDepthImage& bad) {
        bad.view.width = 4097;
        bad.view.height = 1;
    });
    check_refused("3 x 5000 texels", [](LayeredDepthImage& bad) { bad.view.height = 5000; });
    const auto infinity = std::numeric_limits<double>::infinity();
    const auto nan = std::numeric_limits<double>::quiet_NaN();
    check_refused("depths of 0.0", [](LayeredDepthImage& bad) { bad.near_depth = 0.0; });
    check_refused("depths of nan", [&](LayeredDepthImage& bad) { bad.near_depth = nan; });
    check_refused("to 1.0", [](LayeredDepthImage& bad) { bad.far_depth = 1.0; });
    check_refused("to inf", [&](LayeredDepthImage& bad) { bad.far_depth = infinity; });
    check_refused("to nan", [&](LayeredDepthImage& bad) { bad.far_depth = nan; });
    check_refused("5 counts for 6 texels", [](LayeredDepthImage& bad) { bad.counts.pop_back(); });
    check_refused("4 starts of rows for 2", [](LayeredDepthImage& bad) { bad.rows.push_back(3); });
    check_refused("2 points for 3 samples", [](LayeredDepthImage& bad) { bad.points.resize(2); });
    check_refused("row 0 starts at 1", [](LayeredDepthImage& bad) { bad.rows[0] = 1; });
    check_refused("row 1 starts at 1, its samples at 2", [](LayeredDepthImage& bad) {
        bad.rows[1] = 1;
    });
    check_refused("texel 2, 1 has samples up to 4 of 3", [](LayeredDepthImage& bad) {
        bad.counts[5] = 2;
    });
    check_refused("3 samples, rows end at 9", [](LayeredDepthImage& bad) { bad.rows[2] = 9; });
    check_refused("4 samples, rows end at 3", [](LayeredDepthImage& bad) {
        bad.samples.push_back(bad.samples.back());
    });
    check_refused("sample 0 at 15, 8 sixteenths", [](LayeredDepthImage& bad) {
        bad.samples[0].x = 15;
    });
    check_refused("outside of texel 1, 0", [](LayeredDepthImage& bad) { bad.samples[1].y = 16; });
    check_refused("sample 2 has an extent of 0", [](LayeredDepthImage& bad) {
        bad.samples[2].extent = 0;
    });
    check_refused("sample 2 has an alpha of 254", [](LayeredDepthImage& bad) {
        bad.samples[2].color.a = 254;
    });
    check_refused("sample 1 is nearer than the one before", [](LayeredDepthImage& bad) {
        bad.samples[1].depth = 901;
    });
}

TEST_CASE("the bytes of a layered image are those of its arrays") {
    LayeredDepthImage image = small_image();
    CHECK(memory_bytes(LayeredDepthImage{}) == 0);
    const std::uint64_t bytes = 6 + 3 * sizeof(std::uint32_t) + 3 * sizeof(LayeredSample);
    CHECK(memory_bytes(image) == bytes);
    image.points.resize(3);
    CHECK(memory_bytes(image) == bytes + 3 * sizeof(PositionTexel));
}
