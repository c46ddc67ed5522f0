#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace farfield::io {

/// Which axis of a file points up. Coordinates are never turned; the scene says what up is.
enum class UpAxis : std::uint8_t { y, z };

/// How `load_scene` reads.
struct LoadOptions {
    UpAxis up = UpAxis::y;       ///< for the formats that do not say it: OBJ, OFF, PLY, STL
    bool flag_splittable = true; ///< calls `farfield::flag_splittable` with its defaults
    std::uint64_t max_file_bytes = 4ULL << 30U;    ///< larger files are refused; each file alone
    int max_texture_side = 8192;                   ///< [texel] larger textures are left out
    std::uint64_t max_texture_bytes = 1ULL << 30U; ///< of all textures, decoded
};

/// A scene and what had to be changed or left out to get it, one sentence each.
struct LoadedScene {
    Scene scene;
    std::vector<std::string> warnings;
};

/// Reads a mesh or scene file, chosen by its extension in upper or lower case.
///
/// - .obj: polygons (as fans), texcoords, normals, vertex colours, Kd, d and map_Kd of its
///   libraries. One mesh with a part a material; groups are ignored.
/// - .off: polygons, vertex colours and normals.
/// - .ply: text and both byte orders; polygons, normals, colours, texcoords. Other elements are
///   skipped.
/// - .stl: text and binary; equal corners become one vertex.
/// - .gltf, .glb: nodes, triangle primitives, base colour factor and texture, vertex colours, alpha
///   modes. A mesh stays one mesh however many nodes place it.
/// - .pdb: atoms as balls, a metre an angstrom, see `read_pdb` and `make_balls`.
/// - .png: a height field, see `load_height_field`.
///
/// OBJ, OFF and PLY are read in double; `Mesh::origin` is the centre of the positions, so a
/// georeferenced file keeps its digits. Indices, sizes and counts are checked against the file
/// before they are believed: memory stays within a small multiple of the file's length (and, for
/// textures, within the options). The result passes `farfield::validate`.
///
/// Alpha: OPAQUE is drawn opaque, MASK with its cutoff, BLEND (and a d below 1 of an OBJ material,
/// or its texture with alpha) as MASK with 0.5 and a warning. Textures that are missing, broken or
/// too large are left out with a warning.
///
/// @return `not_found` for a missing file or a missing buffer, `unsupported` for another extension
/// or a required feature we do not read, `bad_data` with the place and the value for everything
/// that is not what the format says, a file without triangles among it, `out_of_memory` for files
/// that unfold beyond all measure. Nothing is thrown.
[[nodiscard]] Result<LoadedScene>
load_scene(const std::filesystem::path& path, const LoadOptions& options = {});

} // namespace farfield::io
