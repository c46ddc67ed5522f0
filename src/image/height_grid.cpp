#include <farfield/image/height_grid.hpp>

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace farfield {

namespace {

/// Of the spacing: how far a vertex may be off its post along x and z.
constexpr double kOffPost = 1e-3;

tl::unexpected<Error> bad(const std::string& what, const std::string& value) {
    return fail(ErrorCode::invalid_argument, "height grid: " + what + " is " + value);
}

tl::unexpected<Error> no_grid(const Mesh& mesh, const std::string& why) {
    return fail(ErrorCode::unsupported, "mesh \"" + mesh.name + "\" is no grid of heights: " + why);
}

/// The different values of a coordinate, in order.
std::vector<float> places_along(const Mesh& mesh, int axis) {
    std::vector<float> places;
    places.reserve(mesh.positions.size());
    for (const glm::vec3& position : mesh.positions) {
        places.push_back(position[axis]);
    }
    std::sort(places.begin(), places.end());
    places.erase(std::unique(places.begin(), places.end()), places.end());
    return places;
}

std::uint32_t number_of(const std::vector<float>& places, float place) {
    return static_cast<std::uint32_t>(
        std::lower_bound(places.begin(), places.end(), place) - places.begin()
    );
}

bool evenly_spaced(const std::vector<float>& places, double spacing) {
    for (std::size_t i = 0; i < places.size(); ++i) {
        const double expected = double{places.front()} + static_cast<double>(i) * spacing;
        if (!(std::abs(double{places[i]} - expected) <= kOffPost * spacing)) {
            return false;
        }
    }
    return true;
}

/// That the triangles are all halves of all squares, each once.
Result<void> check_triangles(const Mesh& mesh, const GriddedMesh& gridded) {
    const HeightGrid& grid = gridded.grid;
    std::vector<std::uint32_t> post_of(gridded.vertices.size());
    for (std::size_t post = 0; post < post_of.size(); ++post) {
        post_of[gridded.vertices[post]] = static_cast<std::uint32_t>(post);
    }
    std::vector<std::uint8_t> halves(post_of.size(), 0); // by the square's first post
    const std::size_t squares = std::size_t{grid.columns - 1} * (grid.rows - 1);
    if (mesh.indices.size() != squares * 6) {
        return no_grid(
            mesh,
            std::to_string(mesh.indices.size() / 3) + " triangles for " + std::to_string(squares) +
                " squares"
        );
    }
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        std::array<std::uint32_t, 3> posts = {
            post_of[mesh.indices[i]], post_of[mesh.indices[i + 1]], post_of[mesh.indices[i + 2]]};
        std::sort(posts.begin(), posts.end());
        const std::uint32_t first = posts[0];
        const bool in_square = first % grid.columns + 1 < grid.columns;
        const bool diagonal = posts[2] == first + grid.columns + 1;
        const bool north = posts[1] == first + 1;
        const bool south = posts[1] == first + grid.columns;
        const auto half = static_cast<std::uint8_t>(north ? 1U : 2U);
        if (!in_square || !diagonal || !(north || south) || (halves[first] & half) != 0U) {
            return no_grid(
                mesh,
                "triangle " + std::to_string(i / 3) + " is no half of a square cut from " +
                    "(column, row) to (column + 1, row + 1), or is there twice"
            );
        }
        halves[first] = static_cast<std::uint8_t>(halves[first] | half);
    }
    return {};
}

} // namespace

Result<void> validate(const HeightGrid& grid) {
    if (grid.columns < 2 || grid.rows < 2) {
        return bad(
            "its size",
            std::to_string(grid.columns) + " x " + std::to_string(grid.rows) +
                ", expected 2 x 2 posts or more"
        );
    }
    const std::uint64_t posts = std::uint64_t{grid.columns} * grid.rows;
    if (posts > kMostPosts) {
        return bad("the number of posts", std::to_string(posts) + ", expected at most 2^28");
    }
    if (grid.heights.size() != posts) {
        return bad(
            "the number of heights",
            std::to_string(grid.heights.size()) + ", expected " + std::to_string(posts)
        );
    }
    if (!(grid.spacing_m > 0.0) ||
        !std::isfinite(grid.spacing_m * std::max(grid.columns, grid.rows))) {
        return bad("spacing_m", std::to_string(grid.spacing_m));
    }
    for (int axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(grid.origin[axis])) {
            return bad("origin", std::to_string(grid.origin[axis]));
        }
    }
    for (std::size_t i = 0; i < grid.heights.size(); ++i) {
        if (!std::isfinite(grid.heights[i])) {
            return bad("the height of post " + std::to_string(i), std::to_string(grid.heights[i]));
        }
    }
    return {};
}

Result<GriddedMesh> height_grid_of(const Mesh& mesh) {
    const std::vector<float> columns = places_along(mesh, 0);
    const std::vector<float> rows = places_along(mesh, 2);
    if (columns.size() < 2 || rows.size() < 2 ||
        mesh.positions.size() != columns.size() * rows.size()) {
        return no_grid(
            mesh,
            std::to_string(mesh.positions.size()) + " vertices at " +
                std::to_string(columns.size()) + " places along x and " +
                std::to_string(rows.size()) + " along z"
        );
    }
    GriddedMesh gridded;
    HeightGrid& grid = gridded.grid;
    grid.columns = static_cast<std::uint32_t>(columns.size());
    grid.rows = static_cast<std::uint32_t>(rows.size());
    grid.spacing_m =
        (double{columns.back()} - double{columns.front()}) / static_cast<double>(grid.columns - 1);
    if (!evenly_spaced(columns, grid.spacing_m) || !evenly_spaced(rows, grid.spacing_m)) {
        return no_grid(
            mesh, "vertices are not " + std::to_string(grid.spacing_m) + " m apart along x and z"
        );
    }
    grid.origin = mesh.origin + glm::dvec3(double{columns.front()}, 0.0, double{rows.front()});
    grid.heights.resize(mesh.positions.size());
    gridded.vertices.assign(mesh.positions.size(), UINT32_MAX);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        const glm::vec3& position = mesh.positions[i];
        const std::size_t post =
            grid.post(number_of(columns, position.x), number_of(rows, position.z));
        if (gridded.vertices[post] != UINT32_MAX) {
            return no_grid(
                mesh,
                "vertices " + std::to_string(gridded.vertices[post]) + " and " + std::to_string(i) +
                    " stand at one post"
            );
        }
        gridded.vertices[post] = static_cast<std::uint32_t>(i);
        grid.heights[post] = position.y;
    }
    if (Result<void> checked = check_triangles(mesh, gridded); !checked) {
        return tl::unexpected(std::move(checked).error());
    }
    return gridded;
}

} // namespace farfield
