#pragma once

#include "run/movers.hpp"
#include "scenes/scene_catalog.hpp"
#include <farfield/core/result.hpp>
#include <farfield/eval/camera_path.hpp>
#include <farfield/image/proxy_pair.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/bsp.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/partition/kdtree.hpp>
#include <farfield/scene/scene.hpp>
#include <farfield/technique/mesh_lod.hpp>

#include <glm/ext/matrix_double4x3.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace farfield::run {

/// Which scene, seen how, cut how. Names as the options of the programs.
struct WorldOptions {
    std::string scene = "island"; ///< of the catalogue, or a file
    scenes::SceneValues scene_values;
    std::string path; ///< file of a camera path; empty: the scene's own
    std::optional<double> step_m;
    std::string up; ///< axis that points up in a mesh file: "y" or "z"
    std::optional<int> frames;
    std::optional<int> whole_path; ///< the whole path in so many frames
    std::string size;              ///< WIDTHxHEIGHT; empty: the scene's own
    std::optional<double> fov_deg;
    std::string partition = "bsp"; ///< bsp, kdtree or octree
    partition::BspOptions bsp;
    partition::KdTreeOptions cells; ///< of a k-d tree, and all but `branching` of an octree
    std::optional<std::uint32_t> max_items;
    int movers = 0;      ///< balloons that go round among what is there
    bool levels = false; ///< levels of detail are made as well, for `mesh-lod`
};

/// A scene with its hierarchy and the walk through it. Backends draw `scene`, which has the levels
/// of detail and coarse models after the items of the hierarchy.
struct World {
    Scene scene;
    Hierarchy hierarchy;
    LodTable collapsed;           ///< levels by edge collapse
    LodTable clustered;           ///< levels by clustering
    std::vector<ProxyPair> pairs; ///< of items of the hierarchy; none unless `prepare` makes them
    std::vector<std::uint64_t> item_primitives;
    std::vector<glm::dmat4x3> item_frames;
    std::vector<Mover> movers;
    CameraPath path;
    double fov_deg = 60.0; ///< vertical
    int width = 640;       ///< [px]
    int height = 480;      ///< [px]
    int frames = 0;        ///< that are walked
    std::optional<int> whole_path;
    glm::dvec3 middle{0.0};        ///< of the scene's box
    double radius = 0.0;           ///< [m] half the diagonal of the scene's box
    double build_ms = 0.0;         ///< of the hierarchy
    std::uint64_t triangles = 0;   ///< of the items of the hierarchy
    std::uint64_t instances = 0;   ///< likewise
    std::uint64_t scene_bytes = 0; ///< without levels of detail

    /// The view of a frame of the walk.
    [[nodiscard]] View view(int frame) const;

    /// Puts what moves where it is in a frame of the walk, for techniques over the hierarchy and
    /// for who measures. Backends are told by `Backends::move`.
    [[nodiscard]] Result<void> move(int frame);
};

/// Makes or loads a scene, builds its hierarchy, and finds the walk through it. Warnings of loaders
/// go to standard error.
[[nodiscard]] Result<World> load_world(const WorldOptions& options);

} // namespace farfield::run
