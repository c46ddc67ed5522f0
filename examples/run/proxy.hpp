#pragma once

#include "run/world.hpp"
#include <farfield/core/result.hpp>
#include <farfield/image/proxy_pair.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace farfield::run {

/// Which coarse models the items of a world get. Names as the options of the programs.
struct ProxyOptions {
    /// grid: every k-th post of heights; refined: a tree of triangles over heights; mesh: fewer
    /// triangles of any mesh; empty: refined for heights, mesh for others.
    std::string proxy = {};
    std::uint32_t coarse = 16; ///< grid: squares a side
    /// Of the finest choice of a refined one, 16384 if not given; of each mesh, 2000 if not given.
    std::optional<std::uint32_t> coarse_triangles = std::nullopt;

    friend bool operator==(const ProxyOptions&, const ProxyOptions&) = default;
};

/// Most samples of all pairs of meshes: 16 bytes each, and as many for what is built over them.
inline constexpr std::uint64_t kMostProxySamples = 16'000'000;

/// Makes a pair of each item of a world's hierarchy that does not move. Coarse models become items
/// of `World::scene`, which no hierarchy holds, so this comes before backends are made of the
/// world.
/// @return pairs in the order of the fine items; an error that names the mesh and why it has none,
/// or the option
[[nodiscard]] Result<std::vector<ProxyPair>>
make_proxies(World& world, const ProxyOptions& options);

} // namespace farfield::run
