#include <farfield/core/assert.hpp>
#include <farfield/image/build_proxy.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace farfield {

namespace {

/// Sums of normals over any box of posts.
class NormalSums {
  public:
    NormalSums(const Mesh& fine, const GriddedMesh& gridded)
        : columns_(gridded.grid.columns), rows_(gridded.grid.rows),
          sums_(std::size_t{columns_ + 1} * (rows_ + 1), glm::dvec3(0.0)) {
        for (std::uint32_t row = 0; row < rows_; ++row) {
            glm::dvec3 in_row(0.0);
            for (std::uint32_t column = 0; column < columns_; ++column) {
                const std::uint32_t vertex = gridded.vertices[gridded.grid.post(column, row)];
                in_row += glm::dvec3(fine.normals[vertex]);
                sums_[place(column + 1, row + 1)] = sums_[place(column + 1, row)] + in_row;
            }
        }
    }

    /// Mean over the posts no farther than `half` along either axis.
    [[nodiscard]] glm::vec3 mean(std::uint32_t post, std::uint32_t half) const {
        const std::uint32_t column = post % columns_;
        const std::uint32_t row = post / columns_;
        const std::uint32_t left = column - std::min(column, half);
        const std::uint32_t top = row - std::min(row, half);
        const std::uint32_t right = std::min(column + half + 1, columns_);
        const std::uint32_t bottom = std::min(row + half + 1, rows_);
        const glm::dvec3 sum = sums_[place(right, bottom)] - sums_[place(left, bottom)] -
                               sums_[place(right, top)] + sums_[place(left, top)];
        // Normals of a surface over a plane have no opposites.
        return glm::vec3(glm::normalize(sum));
    }

  private:
    [[nodiscard]] std::size_t place(std::uint32_t column, std::uint32_t row) const {
        return std::size_t{row} * (columns_ + 1) + column;
    }

    std::uint32_t columns_;
    std::uint32_t rows_;
    std::vector<glm::dvec3> sums_; ///< of all posts before a column and before a row
};

} // namespace

Mesh make_coarse_mesh(const Mesh& fine, const GriddedMesh& gridded, const HeightProxy& proxy) {
    FARFIELD_ASSERT(gridded.vertices.size() == fine.positions.size() && !fine.parts.empty());
    const HeightGrid& grid = gridded.grid;
    // By post: the vertex, and the shortest edge there, in posts: what it stands for.
    std::vector<std::uint32_t> vertex_at(grid.heights.size(), UINT32_MAX);
    std::vector<std::uint32_t> shortest(grid.heights.size(), UINT32_MAX);
    const auto apart = [&](std::uint32_t a, std::uint32_t b) {
        const auto across = [](std::uint32_t i, std::uint32_t j) {
            return std::max(i, j) - std::min(i, j);
        };
        return std::max(
            across(a % grid.columns, b % grid.columns), across(a / grid.columns, b / grid.columns)
        );
    };
    std::vector<std::uint32_t> posts; // by vertex
    Mesh mesh;
    mesh.name = fine.name + ", coarse";
    mesh.origin = fine.origin;
    for (std::size_t i = 0; i < proxy.posts.size(); ++i) {
        const std::uint32_t post = proxy.posts[i];
        if (vertex_at[post] == UINT32_MAX) {
            vertex_at[post] = static_cast<std::uint32_t>(posts.size());
            posts.push_back(post);
        }
        mesh.indices.push_back(vertex_at[post]);
        const std::uint32_t next = proxy.posts[i % 3 == 2 ? i - 2 : i + 1];
        const std::uint32_t length = apart(post, next);
        shortest[post] = std::min(shortest[post], length);
        shortest[next] = std::min(shortest[next], length);
    }
    const NormalSums sums(fine, gridded);
    for (const std::uint32_t post : posts) {
        const std::uint32_t vertex = gridded.vertices[post];
        mesh.positions.push_back(fine.positions[vertex]);
        mesh.normals.push_back(sums.mean(post, shortest[post] / 2));
        if (!fine.colors.empty()) {
            mesh.colors.push_back(fine.colors[vertex]);
        }
        if (!fine.texcoords.empty()) {
            mesh.texcoords.push_back(fine.texcoords[vertex]);
        }
    }
    mesh.parts.push_back(
        {0, static_cast<std::uint32_t>(mesh.indices.size()), fine.parts.front().material}
    );
    update_bounds(mesh);
    return mesh;
}

std::vector<ProxyItems> add_coarse_mesh(Scene& scene, MeshId fine, Mesh coarse, std::size_t items) {
    FARFIELD_ASSERT(items <= scene.instances.size());
    const auto mesh = make_id<MeshId>(scene.meshes.size());
    scene.meshes.push_back(std::move(coarse));
    std::vector<ProxyItems> added;
    for (std::size_t i = 0; i < items; ++i) {
        if (scene.instances[i].mesh == fine) {
            added.push_back({make_id<ItemId>(i), make_id<ItemId>(scene.instances.size())});
            scene.instances.push_back({mesh, scene.instances[i].object_to_world});
        }
    }
    return added;
}

} // namespace farfield
