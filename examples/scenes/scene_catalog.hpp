#pragma once

#include <farfield/core/result.hpp>
#include <farfield/eval/camera_path.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

namespace farfield::scenes {

/// A number that a scene can be made with, `--name VALUE` of the programs.
struct SceneParameter {
    std::string_view name;
    double default_value = 0.0;
    bool whole = false;    ///< whole numbers only
    std::string_view help; ///< with unit and range
};

/// Values by parameter name; what is not named keeps its default.
using SceneValues = std::map<std::string, double, std::less<>>;

/// A scene, the walk through it and the picture that belongs to it.
struct CatalogScene {
    Scene scene;
    CameraPath path;
    double fov_deg = 60.0; ///< vertical
    int width = 640;       ///< [px]
    int height = 480;      ///< [px]
    /// Of its hierarchy, as `partition::BspOptions::max_items`. Things that stand apart though
    /// their boxes touch, as trees do, may have a leaf each.
    std::uint32_t max_items = 1;
};

/// One scene that programs offer by name.
struct CatalogEntry {
    std::string_view name;
    std::string_view help;
    std::span<const SceneParameter> parameters;
    /// @param values complete and checked: every parameter, whole where it has to be
    Result<CatalogScene> (*make)(const SceneValues& values) = nullptr;
};

/// All scenes, in the order in which programs list them.
[[nodiscard]] std::span<const CatalogEntry> scene_catalog() noexcept;

/// [degrees] Around the vertical, of the view of a molecule.
/// @par Source Chamberlain et al. 1996, section 4
inline constexpr double kMoleculeAngleDeg = 25.0;

/// A molecule with the walk and the picture of the scene `molecule`.
/// @return an error for a scene without instances or an angle that is not finite
[[nodiscard]] Result<CatalogScene> show_molecule(Scene scene, double angle_deg = kMoleculeAngleDeg);

/// Makes a scene by its name.
/// @return an error naming the scene or parameter that does not exist (with those that do), the
/// value that is not finite or not whole, or what the scene itself has to say
[[nodiscard]] Result<CatalogScene>
make_scene(std::string_view name, const SceneValues& values = {});

} // namespace farfield::scenes
