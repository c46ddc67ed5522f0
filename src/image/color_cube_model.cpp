#include "image/cube_cells.hpp"
#include <farfield/image/color_cube_model.hpp>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <tuple>
#include <utility>

namespace farfield {

namespace {

/// Levels below a root: what `ColorCubeOptions::max_depth` allows.
constexpr std::uint32_t kDeepest = 20;
/// The smallest edge of a root of which a sixteenth of a cell at `kDeepest` is still a number of
/// full precision. [m]
constexpr float kSmallestEdge = 1e-30F;
/// Rotations are kept in float and come from files: a ten-thousandth off is a tenth of a pixel in a
/// thousand.
constexpr float kOrthonormal = 1e-4F;
constexpr std::uint32_t kNobody = UINT32_MAX;
/// The highest bit of a gain's first byte tells of a sheet; the others have none.
constexpr std::uint8_t kMostStored = 0x7F;

std::string text(float value) {
    std::array<char, 32> buffer{};
    const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
    return error == std::errc{} ? std::string(buffer.data(), end) : std::string("?");
}

std::string text(const glm::vec3& v) {
    return text(v.x) + ' ' + text(v.y) + ' ' + text(v.z);
}

tl::unexpected<Error> bad(std::string message) {
    return fail(ErrorCode::bad_data, "colour cubes: " + std::move(message));
}

tl::unexpected<Error> bad(const std::string& where, const char* field, const std::string& value) {
    return bad(where + ": " + field + " is " + value);
}

bool is_finite(const glm::vec3& v) noexcept {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// One tree of a model, checked step by step.
class TreeCheck {
  public:
    TreeCheck(const ColorCubeModel& model, std::size_t index)
        : tree_(&model.trees[index]), model_(&model), last_(index + 1 == model.trees.size()),
          name_("tree " + std::to_string(index)) {}

    [[nodiscard]] Result<void> check() {
        Result<void> checked = check_place();
        checked = checked ? check_numbers() : checked;
        checked = checked ? check_links() : checked;
        checked = checked ? check_lists() : checked;
        return checked ? check_colors() : checked;
    }

  private:
    [[nodiscard]] std::string cell_name(std::size_t cell) const {
        return name_ + ", cell " + std::to_string(cell);
    }

    [[nodiscard]] Result<void> check_place() const {
        const ColorCubeTree& tree = *tree_;
        if (!is_finite(tree.lo)) {
            return bad(name_, "lo", text(tree.lo));
        }
        if (!(tree.edge >= kSmallestEdge) || !is_finite(tree.lo + tree.edge)) {
            return bad(name_, "edge", text(tree.edge) + " from " + text(tree.lo));
        }
        if (tree.bounds != Box3f{} && (is_empty(tree.bounds) || !is_finite(tree.bounds))) {
            return bad(name_, "bounds", text(tree.bounds.lo) + " to " + text(tree.bounds.hi));
        }
        if (!(tree.overhang >= 0.0F) || !std::isfinite(tree.overhang)) {
            return bad(name_, "overhang", text(tree.overhang));
        }
        if (tree.cells.empty() || tree.cells.size() >= UINT32_MAX) {
            return bad(name_, "the number of cells", std::to_string(tree.cells.size()));
        }
        return {};
    }

    /// What the numbers among the contents stand for.
    [[nodiscard]] Result<void> check_numbers() {
        const ColorCubeTree& tree = *tree_;
        const std::size_t references = last_ ? model_->references.size() : 0;
        if (tree.reference_count != references) {
            return bad(
                name_,
                "reference_count",
                std::to_string(tree.reference_count) + ", expected " + std::to_string(references)
            );
        }
        if (tree.item_primitives.size() != tree.items.size()) {
            return bad(
                name_,
                "the number of item_primitives",
                std::to_string(tree.item_primitives.size()) + ", expected " +
                    std::to_string(tree.items.size())
            );
        }
        if (!last_ && (!tree.items.empty() || tree.primitives.size() != 1)) {
            return bad(
                name_ + " is referred to and has " + std::to_string(tree.items.size()) +
                " items and " + std::to_string(tree.primitives.size()) +
                " groups of primitives, expected none and one"
            );
        }
        numbers_ = references + tree.items.size();
        for (std::size_t i = 0; i < tree.primitives.size(); ++i) {
            const CubePrimitives& group = tree.primitives[i];
            const std::string where = name_ + ", primitives " + std::to_string(i);
            if (group.first != numbers_) {
                return bad(
                    where,
                    "first",
                    std::to_string(group.first) + ", expected " + std::to_string(numbers_)
                );
            }
            if ((group.item == kNone<ItemId>) == last_) {
                return bad(
                    where,
                    "item",
                    std::to_string(index_of(group.item)) +
                        (last_ ? ", expected one of the scene" : ", expected none")
                );
            }
            numbers_ += group.count;
        }
        // Each is in a leaf at least, so there are as many entries: what follows is bounded by
        // them.
        if (numbers_ >= ColorCubeTree::kLast || numbers_ > tree.contents.size()) {
            return bad(
                name_ + " has " + std::to_string(tree.contents.size()) + " contents for " +
                std::to_string(numbers_) + " references, items and primitives"
            );
        }
        return {};
    }

    /// Parents before children, each cell under one of them.
    [[nodiscard]] Result<void> check_links() const {
        const ColorCubeTree& tree = *tree_;
        const std::size_t cells = tree.cells.size();
        constexpr std::uint8_t kUnknown = 0xFF;
        std::vector<std::uint8_t> depths(cells, kUnknown);
        depths[0] = 0;
        std::uint32_t deepest = 0;
        std::uint32_t leaves = 0;
        for (std::size_t i = 0; i < cells; ++i) {
            const CubeCell& cell = tree.cells[i];
            if (depths[i] == kUnknown) {
                return bad(cell_name(i) + " is no child of a cell before it");
            }
            for (std::size_t axis = 0; axis < 3; ++axis) {
                if ((cell.extent[axis] & 15U) > cell.extent[axis] >> 4U) {
                    return bad(
                        cell_name(i),
                        "extent",
                        std::to_string(cell.extent[axis] & 15U) + " to " +
                            std::to_string(cell.extent[axis] >> 4U) + " along axis " +
                            std::to_string(axis)
                    );
                }
            }
            if (cell.octants == 0) {
                ++leaves;
                deepest = std::max<std::uint32_t>(deepest, depths[i]);
                continue;
            }
            const std::uint64_t end = std::uint64_t{cell.first} + child_count(cell);
            if (cell.first <= i || end > cells) {
                return bad(
                    cell_name(i),
                    "first",
                    std::to_string(cell.first) + " of " + std::to_string(child_count(cell)) +
                        " children, expected cells after it of " + std::to_string(cells)
                );
            }
            if (depths[i] == kDeepest) {
                return bad(
                    cell_name(i) + " has children " + std::to_string(kDeepest + 1) +
                    " levels below the root"
                );
            }
            for (std::size_t child = cell.first; child < end; ++child) {
                if (depths[child] != kUnknown) {
                    return bad(
                        cell_name(i),
                        "first",
                        std::to_string(cell.first) + ", but cell " + std::to_string(child) +
                            " is the child of another cell"
                    );
                }
                depths[child] = static_cast<std::uint8_t>(depths[i] + 1);
            }
        }
        if (tree.quality.depth != deepest || tree.quality.leaves != leaves) {
            return bad(
                name_,
                "quality",
                std::to_string(tree.quality.leaves) + " leaves and depth " +
                    std::to_string(tree.quality.depth) + ", expected " + std::to_string(leaves) +
                    " and " + std::to_string(deepest)
            );
        }
        return {};
    }

    /// Contents of leaves: each entry in one list, each number where it has to be.
    [[nodiscard]] Result<void> check_lists() const {
        const ColorCubeTree& tree = *tree_;
        std::vector<std::uint32_t> last_leaf(numbers_, kNobody);
        std::vector<bool> listed(tree.contents.size(), false);
        std::size_t entries = 0;
        for (std::size_t i = 0; i < tree.cells.size(); ++i) {
            if (tree.cells[i].octants != 0) {
                continue;
            }
            bool ended = tree.cells[i].first == CubeCell::kNothing;
            for (std::size_t k = tree.cells[i].first; !ended; ++k) {
                if (k >= tree.contents.size()) {
                    return bad(
                        cell_name(i),
                        "first",
                        std::to_string(tree.cells[i].first) + ", whose list does not end within " +
                            std::to_string(tree.contents.size()) + " contents"
                    );
                }
                const std::uint32_t number = tree.contents[k] & ~ColorCubeTree::kLast;
                ended = (tree.contents[k] & ColorCubeTree::kLast) != 0;
                const auto entry_is = [&](const char* what) {
                    return bad(
                        cell_name(i) + ": entry " + std::to_string(k) + " of the contents is " +
                        std::to_string(number) + ", " + what
                    );
                };
                if (listed[k]) {
                    return entry_is("which is in the list of another leaf");
                }
                if (number >= numbers_) {
                    return entry_is("which does not exist");
                }
                if (last_leaf[number] == i) {
                    return entry_is("which the leaf has already");
                }
                listed[k] = true;
                last_leaf[number] = static_cast<std::uint32_t>(i);
                ++entries;
            }
        }
        if (entries != tree.contents.size()) {
            return bad(
                name_ + ": " + std::to_string(tree.contents.size() - entries) +
                " of the contents are in no leaf"
            );
        }
        const auto missing = std::find(last_leaf.begin(), last_leaf.end(), kNobody);
        if (missing != last_leaf.end()) {
            return bad(
                name_ + ": number " + std::to_string(missing - last_leaf.begin()) + " of " +
                std::to_string(numbers_) + " is in no leaf"
            );
        }
        return {};
    }

    [[nodiscard]] Result<void> check_level_factors() const {
        const ColorCubeTree& tree = *tree_;
        const std::size_t levels = std::size_t{tree.quality.depth} + 1;
        if (!tree.level_factors.empty() && tree.gains.empty()) {
            return bad(name_ + " has level_factors and no gains");
        }
        if (!tree.level_factors.empty() && tree.level_factors.size() != levels) {
            return bad(
                name_,
                "the number of level_factors",
                std::to_string(tree.level_factors.size()) + ", expected " + std::to_string(levels)
            );
        }
        for (std::size_t level = 0; level < tree.level_factors.size(); ++level) {
            for (std::size_t i = 0; i < std::tuple_size_v<LevelFactors>; ++i) {
                const float factor = tree.level_factors[level][i];
                if (!(factor >= kLeastLevelFactor && factor <= kMostLevelFactor)) {
                    return bad(
                        name_ + ", level " + std::to_string(level) + ": factor " +
                        std::to_string(i) + " is " + text(factor)
                    );
                }
            }
        }
        return {};
    }

    [[nodiscard]] Result<void> check_colors() const {
        const ColorCubeTree& tree = *tree_;
        const std::size_t cells = tree.cells.size();
        if (tree.light_sets == 0 ||
            tree.cubes.size() != std::uint64_t{tree.light_sets} * std::uint64_t{cells}) {
            return bad(
                name_,
                "the number of cubes",
                std::to_string(tree.cubes.size()) + " for " + std::to_string(tree.light_sets) +
                    " light_sets of " + std::to_string(cells) + " cells"
            );
        }
        if (!tree.gains.empty() && tree.gains.size() != cells) {
            return bad(
                name_,
                "the number of gains",
                std::to_string(tree.gains.size()) + " for " + std::to_string(cells) + " cells"
            );
        }
        for (std::size_t i = 0; i < tree.gains.size(); ++i) {
            for (std::size_t axis = 1; axis < 3; ++axis) {
                const std::uint8_t stored = tree.gains[i].stored[axis];
                if (stored > kMostStored) {
                    return bad(
                        cell_name(i) + ": gain " + std::to_string(axis) + " is stored as " +
                        std::to_string(stored) + ", expected at most 127"
                    );
                }
            }
        }
        if (Result<void> checked = check_level_factors(); !checked) {
            return checked;
        }
        for (std::size_t i = 0; i < tree.cubes.size(); ++i) {
            for (std::size_t face = 0; face < 6; ++face) {
                const glm::u8vec4& color = tree.cubes[i].faces[face];
                if (color.r > color.a || color.g > color.a || color.b > color.a) {
                    return bad(
                        cell_name(i % cells) + ", light set " + std::to_string(i / cells),
                        "face",
                        std::to_string(face) + " with " + std::to_string(color.r) + ' ' +
                            std::to_string(color.g) + ' ' + std::to_string(color.b) +
                            ", more than its alpha " + std::to_string(color.a)
                    );
                }
            }
        }
        return {};
    }

    const ColorCubeTree* tree_;
    const ColorCubeModel* model_;
    bool last_;
    std::string name_;
    std::uint64_t numbers_ = 0; ///< references, items and primitives
};

Result<void> check_reference(const ColorCubeModel& model, std::size_t index) {
    const CubeReference& reference = model.references[index];
    const std::string where = "reference " + std::to_string(index);
    const std::size_t shared = model.trees.size() - 1;
    if (reference.tree >= shared) {
        return bad(
            where,
            "tree",
            std::to_string(reference.tree) + ", expected one before the last of " +
                std::to_string(shared + 1)
        );
    }
    const std::uint32_t sets = model.trees[reference.tree].light_sets;
    if (reference.light_set >= sets) {
        return bad(
            where, "light_set", std::to_string(reference.light_set) + " of " + std::to_string(sets)
        );
    }
    if (!(reference.scale > 0.0F) || !std::isfinite(reference.scale)) {
        return bad(where, "scale", text(reference.scale));
    }
    const glm::mat3& rotation = reference.rotation;
    const glm::mat3 square = glm::transpose(rotation) * rotation;
    bool proper = glm::determinant(rotation) > 0.0F;
    for (int column = 0; column < 3; ++column) {
        for (int row = 0; row < 3; ++row) {
            const float expected = column == row ? 1.0F : 0.0F;
            proper = proper && std::abs(square[column][row] - expected) <= kOrthonormal;
        }
    }
    if (!proper) { // as well where something is no number
        return bad(
            where,
            "rotation",
            "no rotation: " + text(rotation[0]) + ", " + text(rotation[1]) + ", " +
                text(rotation[2])
        );
    }
    if (!is_finite(reference.translation)) {
        return bad(where, "translation", text(reference.translation));
    }
    return {};
}

/// Each item of the scene is a reference, whole or a group of primitives of the last tree.
Result<void> check_items(const ColorCubeModel& model) {
    const ColorCubeTree& scene = model.trees.back();
    const std::uint64_t shown =
        std::uint64_t{model.references.size()} + scene.items.size() + scene.primitives.size();
    if (shown != model.item_count) {
        return bad(
            "item_count is " + std::to_string(model.item_count) + ", but " + std::to_string(shown) +
            " items are referred to, whole or in primitives"
        );
    }
    std::vector<bool> seen(model.item_count, false);
    const auto see = [&](ItemId item, const char* what, std::size_t index) -> Result<void> {
        const std::size_t number = index_of(item);
        if (number >= seen.size() || seen[number]) {
            return bad(
                what + std::to_string(index) + ": item is " + std::to_string(number) +
                (number >= seen.size() ? " of " + std::to_string(seen.size())
                                       : std::string(", which is there already"))
            );
        }
        seen[number] = true;
        return {};
    };
    Result<void> checked;
    for (std::size_t i = 0; checked && i < model.references.size(); ++i) {
        checked = see(model.references[i].item, "reference ", i);
    }
    for (std::size_t i = 0; checked && i < scene.items.size(); ++i) {
        checked = see(scene.items[i], "last tree, items ", i);
    }
    for (std::size_t i = 0; checked && i < scene.primitives.size(); ++i) {
        checked = see(scene.primitives[i].item, "last tree, primitives ", i);
    }
    return checked;
}

} // namespace

std::vector<Box3f> contents_boxes(const ColorCubeTree& tree) {
    const std::vector<image::CellPlace> places = image::places_of(tree);
    std::vector<Box3f> boxes(tree.cells.size());
    boxes[0] = contents_box(tree.cells[0], root_range(tree), places[0].lo, places[0].edge);
    for (std::size_t i = 0; i < tree.cells.size(); ++i) {
        const CubeCell& cell = tree.cells[i];
        for (std::uint32_t k = 0; cell.octants != 0 && k < child_count(cell); ++k) {
            const std::size_t child = cell.first + k;
            const image::CellPlace& place = places[child];
            boxes[child] = contents_box(tree.cells[child], boxes[i], place.lo, place.edge);
        }
    }
    return boxes;
}

std::uint64_t memory_bytes(const ColorCubeTree& tree) noexcept {
    return tree.cells.size() * sizeof(CubeCell) + tree.cubes.size() * sizeof(ColorCube) +
           tree.gains.size() * sizeof(CubeGain) + tree.level_factors.size() * sizeof(LevelFactors) +
           tree.contents.size() * sizeof(std::uint32_t) +
           tree.items.size() * (sizeof(ItemId) + sizeof(std::uint32_t)) +
           tree.primitives.size() * sizeof(CubePrimitives);
}

std::uint64_t memory_bytes(const ColorCubeModel& model) noexcept {
    std::uint64_t bytes = model.references.size() * sizeof(CubeReference);
    for (const ColorCubeTree& tree : model.trees) {
        bytes += memory_bytes(tree);
    }
    return bytes;
}

Result<void> validate(const ColorCubeModel& model) {
    if (model.trees.empty()) {
        return bad("there is no tree");
    }
    const glm::dvec3& origin = model.origin;
    if (!std::isfinite(origin.x) || !std::isfinite(origin.y) || !std::isfinite(origin.z)) {
        return bad(
            "origin is " + std::to_string(origin.x) + ' ' + std::to_string(origin.y) + ' ' +
            std::to_string(origin.z)
        );
    }
    Result<void> checked = check_items(model);
    for (std::size_t i = 0; checked && i < model.references.size(); ++i) {
        checked = check_reference(model, i);
    }
    for (std::size_t i = 0; checked && i < model.trees.size(); ++i) {
        checked = TreeCheck(model, i).check();
    }
    return checked;
}

} // namespace farfield
