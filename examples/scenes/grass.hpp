#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>

namespace farfield::scenes {

/// Square patches of grass along each side of the field.
inline constexpr int kGrassPatches = 25;

/// A field of grass on bare soil: thin things that cover the ground and never quite.
struct GrassOptions {
    /// Of all blades, two each; a multiple of 1250, 1250 to 2000000000.
    int triangles = 400'000;
    double field_m = 100.0;  ///< [m] side of the square, > 0
    bool ground = true;      ///< soil; without it the sky shows between blades
    std::uint64_t seed = 10; ///< of the blades and of the turns of the patches
};

/// Checks the ranges above and finiteness; the message names the option and its value.
[[nodiscard]] Result<void> validate(const GrassOptions& options);

/// Sows the field: y up, its middle at 0. Mesh 0 is one patch of blades, each a bent rhombus of two
/// triangles, 0.5 m high on average; instances of it, each with a quarter turn of its own, fill the
/// square row by row. Fewer blades are wider, so that they cover as much. With `ground`, mesh 1 and
/// the last instance are the soil, 3200 triangles at height 0, splittable. Blades lean a little
/// over the rim of their patch.
/// @return the scene; an error naming the option and its value
[[nodiscard]] Result<Scene> make_grass(const GrassOptions& options = {});

} // namespace farfield::scenes
