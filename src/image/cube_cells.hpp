#pragma once

#include <farfield/core/executor.hpp>
#include <farfield/image/build_color_cubes.hpp>
#include <farfield/image/color_cube_model.hpp>
#include <farfield/math/box3.hpp>

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace farfield::image {

using Triangle3f = std::array<glm::vec3, 3>;

/// What the leaves of one tree hold, by number: references, then items, then triangles. Relative to
/// the origin of the tree.
struct CellContents {
    std::vector<Box3f> references;
    std::vector<Box3f> items;
    std::vector<Triangle3f> triangles;
    std::vector<float> costs; ///< of references and items, in triangles
    /// Box around the part of an item inside a box; may be no function.
    std::function<Box3f(std::size_t item, const Box3f& box)> part;

    [[nodiscard]] std::size_t size() const noexcept {
        return references.size() + items.size() + triangles.size();
    }
};

/// Where a cell is.
struct CellPlace {
    glm::vec3 lo{0.0F};
    float edge = 0.0F;
};

/// By cell.
[[nodiscard]] std::vector<CellPlace> places_of(const ColorCubeTree& tree);

/// Divides the cube at `tree.lo` of `tree.edge` until its cells are as `options` say, and fills in
/// cells, contents and quality of `tree`. @pre contents that are not empty, in the cube
void divide_cells(
    const CellContents& contents,
    const ColorCubeOptions& options,
    Executor& executor,
    ColorCubeTree& tree
);

} // namespace farfield::image
