#pragma once

#include "run/world.hpp"
#include <farfield/core/result.hpp>
#include <farfield/image/proxy_pair.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace farfield::run {

/// Which coarse models the items of a world get. Names as the options of the programs.
struct ProxyOptions {
    /// grid: every k-th post of heights; refined: a tree of triangles over heights; empty: refined.
    std::string proxy = {};
    std::uint32_t coarse = 16;              ///< grid: squares a side
    std::uint32_t coarse_triangles = 16384; ///< refined: of the finest choice
};

/// Makes a pair of each item of a world's hierarchy that does not move. Coarse models become items
/// of `World::scene`, which no hierarchy holds, so this comes before backends are made of the
/// world.
/// @return pairs in the order of the fine items; an error that names the mesh and why it has none,
/// or the option
[[nodiscard]] Result<std::vector<ProxyPair>>
make_proxies(World& world, const ProxyOptions& options);

} // namespace farfield::run
