#include "image/height_fields.hpp"
#include "support/random.hpp"
#include <farfield/image/height_grid.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

using namespace farfield;
using farfield::support::mesh_of;
using farfield::support::Random;
using farfield::support::wavy_grid;

namespace {

std::string refusal(const HeightGrid& grid) {
    const Result<void> checked = validate(grid);
    return checked ? std::string() : checked.error().message;
}

std::string refusal(const Mesh& mesh) {
    const auto found = height_grid_of(mesh);
    if (!found) {
        CHECK(found.error().code == ErrorCode::unsupported);
    }
    return found ? std::string() : found.error().message;
}

/// The same surface with its vertices and triangles in another order.
Mesh shuffled(const Mesh& mesh, std::uint64_t seed) {
    Random random(seed);
    std::vector<std::uint32_t> numbers(mesh.positions.size());
    std::iota(numbers.begin(), numbers.end(), 0U);
    for (std::size_t i = numbers.size(); i > 1; --i) {
        std::swap(numbers[i - 1], numbers[random.below(static_cast<unsigned>(i))]);
    }
    Mesh other = mesh;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        other.positions[numbers[i]] = mesh.positions[i];
    }
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const std::size_t from = mesh.indices.size() - 3 - i;
        for (std::size_t k = 0; k < 3; ++k) {
            other.indices[i + (k + 1) % 3] = numbers[mesh.indices[from + k]];
        }
    }
    return other;
}

} // namespace

TEST_CASE("Grids of too few, too many or wrong numbers are refused") {
    CHECK(refusal(wavy_grid(2, 2)).empty());
    CHECK_THAT(refusal(HeightGrid{}), Catch::Contains("its size is 0 x 0"));
    CHECK_THAT(refusal(wavy_grid(1, 9)), Catch::Contains("its size is 1 x 9"));
    HeightGrid grid = wavy_grid(5, 4);
    grid.heights.pop_back();
    CHECK_THAT(refusal(grid), Catch::Contains("the number of heights is 19, expected 20"));
    grid = wavy_grid(5, 4);
    grid.heights[7] = std::numeric_limits<float>::quiet_NaN();
    CHECK_THAT(refusal(grid), Catch::Contains("the height of post 7 is nan"));
    grid = wavy_grid(5, 4);
    grid.spacing_m = 0.0;
    CHECK_THAT(refusal(grid), Catch::Contains("spacing_m is 0"));
    grid.spacing_m = std::numeric_limits<double>::infinity();
    CHECK_THAT(refusal(grid), Catch::Contains("spacing_m is inf"));
    grid = wavy_grid(5, 4);
    grid.origin.y = std::numeric_limits<double>::quiet_NaN();
    CHECK_THAT(refusal(grid), Catch::Contains("origin is"));
    grid = wavy_grid(5, 4);
    grid.columns = 1U << 15U;
    grid.rows = 1U << 14U;
    CHECK_THAT(refusal(grid), Catch::Contains("at most 2^28"));
}

TEST_CASE("A grid is found again in its mesh, in whatever order that is") {
    for (const auto& [columns, rows] :
         {std::pair{2U, 2U}, std::pair{17U, 17U}, std::pair{9U, 40U}}) {
        const HeightGrid grid = wavy_grid(columns, rows, columns);
        const Mesh mesh = mesh_of(grid);
        const auto found = height_grid_of(mesh);
        REQUIRE(found.has_value());
        CHECK(found->grid == grid);
        const Mesh other = shuffled(mesh, rows);
        const auto again = height_grid_of(other);
        REQUIRE(again.has_value());
        CHECK(again->grid == grid);
        for (std::size_t post = 0; post < grid.heights.size(); ++post) {
            REQUIRE(other.positions[again->vertices[post]] == mesh.positions[post]);
        }
    }
}

TEST_CASE("Meshes that are no grid are told so") {
    CHECK_THAT(refusal(Mesh{}), Catch::Contains("0 vertices at 0 places along x"));
    const Mesh mesh = mesh_of(wavy_grid(6, 5));
    Mesh other = mesh;
    other.positions[8].x += 0.1F;
    CHECK_THAT(refusal(other), Catch::Contains("30 vertices at 7 places along x and 5 along z"));
    other = mesh;
    for (glm::vec3& position : other.positions) {
        position.z *= 1.01F;
    }
    CHECK_THAT(refusal(other), Catch::Contains("are not 3.0"));
    other = mesh;
    other.positions[3] = other.positions[9];
    CHECK_THAT(refusal(other), Catch::Contains("vertices 3 and 9 stand at one post"));
    other = mesh;
    other.indices.resize(other.indices.size() - 3);
    CHECK_THAT(refusal(other), Catch::Contains("39 triangles for 20 squares"));
    other = mesh;
    std::copy_n(other.indices.begin(), 3, other.indices.begin() + 3);
    CHECK_THAT(refusal(other), Catch::Contains("triangle 1 is no half of a square"));
    other = mesh; // the square is cut the other way
    const std::vector<std::uint32_t> cut = {0, 6, 1, 1, 6, 7};
    std::copy(cut.begin(), cut.end(), other.indices.begin());
    CHECK_THAT(refusal(other), Catch::Contains("triangle 0 is no half of a square"));
    other = mesh; // across the seam of two rows
    const std::vector<std::uint32_t> across = {5, 11, 12};
    std::copy(across.begin(), across.end(), other.indices.begin());
    CHECK_THAT(refusal(other), Catch::Contains("triangle 0 is no half of a square"));
}
