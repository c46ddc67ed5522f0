#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace farfield {

/// Positions in the arrays that own the things they name. They do not mix and do not count.
enum class ItemId : std::uint32_t {};     ///< one instance of one mesh, as the engine numbers them
enum class NodeId : std::uint32_t {};     ///< node of a `Hierarchy`
enum class MeshId : std::uint32_t {};     ///< `Scene::meshes`
enum class MaterialId : std::uint32_t {}; ///< `Scene::materials`
enum class TextureId : std::uint32_t {};  ///< `Scene::textures`
enum class PageId : std::uint32_t {};     ///< image page of a backend
enum class LayeredImageId : std::uint32_t {}; ///< layered depth image of a backend

/// "None", for every id type.
template <typename Id>
inline constexpr Id kNone = static_cast<Id>(UINT32_MAX);

/// The array position that an id stands for.
template <typename Id>
requires std::is_enum_v<Id>
[[nodiscard]] constexpr std::size_t index_of(Id id) noexcept {
    return static_cast<std::size_t>(id);
}

/// The id of an array position. @pre index < UINT32_MAX
template <typename Id>
requires std::is_enum_v<Id>
[[nodiscard]] constexpr Id make_id(std::size_t index) noexcept {
    return static_cast<Id>(static_cast<std::uint32_t>(index));
}

} // namespace farfield
