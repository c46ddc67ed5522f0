#include <farfield/policy/cost_model.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

namespace {

using farfield::CostModel;

constexpr std::pair<const char*, double CostModel::*> kFields[] = {
    {"triangle_s", &CostModel::triangle_s},
    {"draw_call_s", &CostModel::draw_call_s},
    {"image_quad_s", &CostModel::image_quad_s},
    {"image_pixel_s", &CostModel::image_pixel_s},
    {"pass_s", &CostModel::pass_s},
    {"texel_s", &CostModel::texel_s},
    {"geometry_pixel_s", &CostModel::geometry_pixel_s},
    {"splat_s", &CostModel::splat_s},
    {"cube_s", &CostModel::cube_s},
    {"cell_s", &CostModel::cell_s}};

} // namespace

TEST_CASE("a cost model is refused by the name and value of its bad field") {
    CHECK(validate(CostModel{}).has_value());
    CHECK(validate(farfield::ray_casting_costs()).has_value());
    for (const auto& [name, field] : kFields) {
        for (const double bad :
             {-1.0,
              -std::numeric_limits<double>::denorm_min(),
              std::numeric_limits<double>::quiet_NaN(),
              std::numeric_limits<double>::infinity(),
              -std::numeric_limits<double>::infinity()}) {
            CostModel model;
            model.*field = bad;
            const auto result = validate(model);
            CAPTURE(name, bad);
            REQUIRE_FALSE(result.has_value());
            CHECK(result.error().code == farfield::ErrorCode::invalid_argument);
            CHECK_THAT(result.error().message, Catch::Contains(name));
            CHECK_THAT(result.error().message, Catch::Contains(std::to_string(bad)));
        }
    }
}

TEST_CASE("only triangles must cost something") {
    for (const auto& [name, field] : kFields) {
        CostModel model;
        model.*field = 0.0;
        CAPTURE(name);
        const auto result = validate(model);
        if (field == &CostModel::triangle_s) {
            REQUIRE_FALSE(result.has_value());
            CHECK_THAT(result.error().message, Catch::Contains("triangle_s is 0"));
        } else {
            CHECK(result.has_value());
        }
    }
}

TEST_CASE("costs are sums of counts times prices") {
    // Powers of two: every product and sum is exact.
    const CostModel model{
        .triangle_s = 0.5,
        .draw_call_s = 4.0,
        .image_quad_s = 16.0,
        .image_pixel_s = 0.25,
        .pass_s = 128.0,
        .texel_s = 2.0};
    CHECK(geometry_cost(model, 0, 0) == 0.0);
    CHECK(geometry_cost(model, 6, 0) == 3.0);
    CHECK(geometry_cost(model, 6, 5) == 23.0);
    CHECK(image_cost(model, 0.0) == 16.0);
    CHECK(image_cost(model, 40.0) == 26.0);
    CHECK(creation_cost(model, 0.0, 0) == 128.0);
    CHECK(creation_cost(model, 1000.0, 3) == 1134.0);
    // Counts beyond 2^53 are rounded, not wrapped.
    CHECK(geometry_cost(model, UINT64_MAX, UINT64_MAX) == 4.5 * 0x1p64);
    CHECK(creation_cost(model, 0.0, UINT64_MAX) == 0x1p65);
}
