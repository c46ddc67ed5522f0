#pragma once

#include "broadleaf.hpp"
#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>

namespace farfield::scenes {

/// One tree or a wood of many instances of it, block beside block.
/// @par Source Chamberlain et al. 1996, section 4: 52,470 triangles a tree and the numbers of them;
/// how they look and stand is ours
struct TreesOptions {
    int count = 16384; ///< a power of four, 1 to 4194304
    BroadleafOptions tree;
    std::uint64_t seed = 4; ///< of the quarter turns
    bool ground = false;    ///< a flat quad below all trees
};

/// [m] From trunk to trunk: a little less than the width of a tree, so that crowns touch.
[[nodiscard]] double trees_spacing(const TreesOptions& options) noexcept;

/// Grows the trees: y up, the middle of the block at 0. Mesh 0 is the tree, splittable when it
/// stands alone; with `ground`, mesh 1 and the last instance are the quad. Four blocks beside each
/// other, two by two, are the next larger block: instances are in the order of the Z curve, so 4^k
/// of them from a multiple of 4^k on are a square block. Each tree has its own quarter turn around
/// y and nothing else, entries of its matrix are exactly 0, 1 and -1; a tree alone is not turned.
/// @return the scene; an error naming the option and its value
[[nodiscard]] Result<Scene> make_trees(const TreesOptions& options = {});

} // namespace farfield::scenes
