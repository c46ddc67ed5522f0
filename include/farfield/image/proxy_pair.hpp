#pragma once

#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/math/box3.hpp>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace farfield {

/// A point C of a fine model, and the facet of the coarse one that stands for what is around it.
struct ProxySample {
    glm::vec3 point{0.0F};   ///< [m] relative to `ProxyPair::origin`
    std::uint32_t facet = 0; ///< into `ProxyPair::facets`

    friend bool operator==(const ProxySample&, const ProxySample&) = default;
};

/// The plane of a triangle of a coarse model: dot(normal, x) = plane.
struct ProxyFacet {
    glm::vec3 normal{0.0F, 1.0F, 0.0F}; ///< unit
    float plane = 0.0F;                 ///< [m]

    friend bool operator==(const ProxyFacet&, const ProxyFacet&) = default;
};

/// Signed height of a point over a plane. [m] A ray of direction d that meets the point meets the
/// plane a height / -dot(normal, d) farther on.
[[nodiscard]] inline float height_over(const ProxyFacet& facet, const glm::vec3& point) noexcept {
    return glm::dot(facet.normal, point) - facet.plane;
}

/// What a stack of a walk down a tree of nodes has to hold.
inline constexpr std::uint32_t kMostProxyLevels = 40;

/// Node of a tree over the samples, so that a bound of many of them is had at once. At most
/// `kMostProxyLevels` lie on the way from the root to a leaf, both counted. 64 bytes.
struct alignas(64) ProxyNode {
    Box3f bounds;       ///< around the samples
    float below = 0.0F; ///< [m] least height of a sample over the plane of its own facet
    float above = 0.0F; ///< [m] the greatest
    glm::vec3 axis{0.0F, 1.0F, 0.0F}; ///< unit
    /// dot(axis, normal) >= cosine for the facets of all samples; -1: they face anywhere.
    float cosine = -1.0F;
    std::uint32_t first = 0;       ///< into `ProxyPair::samples`
    std::uint32_t count = 0;       ///< of the whole subtree, >= 1
    std::uint32_t first_child = 0; ///< children are first_child and first_child + 1; 0: a leaf

    friend bool operator==(const ProxyNode&, const ProxyNode&) = default;
};
static_assert(sizeof(ProxyNode) == 64);

/// What says whether a triangle of a refinable coarse model has to be split. It is the same for
/// both triangles that share the split edge, and nested: a split triangle's sphere holds the
/// spheres of its children, and its offset is no less than theirs. So where a decision is a
/// function of it that never falls with either, two triangles along an edge decide alike, every
/// triangle that is split has parents that are, and the chosen triangles meet without cracks.
struct ProxySplit {
    glm::vec3 center{0.0F}; ///< [m]
    /// [m] >= 0. The sphere holds these triangles, all below them, and the fine surface that they
    /// stand for.
    float radius = 0.0F;
    /// [m] >= 0. The farthest that the fine surface over these triangles or any below them is from
    /// the plane of the triangle that stands for it.
    float offset = 0.0F;

    friend bool operator==(const ProxySplit&, const ProxySplit&) = default;
};

/// A fine model and a coarse one that pictures of it can be projected on, with what it takes to
/// say how wrong that is. Plain data. All floats are in the world, relative to `origin`.
///
/// Facet i is the plane of triangle i of the coarse item's mesh. Where the coarse model is
/// refinable, that mesh has the triangles of all levels, and what is drawn is a choice of them: the
/// first `root_count`, with triangles replaced by their two children again and again. Each such
/// choice covers the whole. Its samples are matched to the finest triangles.
struct ProxyPair {
    /// How well the coarse model stands for the fine one; the finest one where it is refinable.
    struct Quality {
        std::uint32_t facets = 0;  ///< triangles
        std::uint32_t samples = 0; ///< points of the fine model
        double rms_m = 0.0;        ///< [m] of the distances of the samples
        /// [m] The farthest that a point of either surface is from the other, as measured by its
        /// builder.
        double hausdorff_m = 0.0;

        friend bool operator==(const Quality&, const Quality&) = default;
    };

    ItemId fine = kNone<ItemId>;
    ItemId coarse = kNone<ItemId>; ///< of the geometry source; no hierarchy holds it
    glm::dvec3 origin{0.0};        ///< [m] world
    std::vector<ProxySample> samples;
    std::vector<ProxyFacet> facets;
    std::vector<ProxyNode> nodes; ///< node 0 is the root; children come after their parent
    /// [m] The farthest that a point of the fine model is from the coarse one; the coarsest choice
    /// where it is refinable. No less than the height of any sample over its facet.
    float offset_m = 0.0F;

    std::vector<ProxySplit> splits; ///< by triangle; empty: not refinable
    /// By triangle: the first of two triangles that replace it; none: UINT32_MAX. Children come
    /// after their parent.
    std::vector<std::uint32_t> children;
    std::uint32_t root_count = 0; ///< the first triangles, which are children of none

    Quality quality;

    friend bool operator==(const ProxyPair&, const ProxyPair&) = default;
};

/// Whether what is drawn of the coarse model is a choice.
[[nodiscard]] inline bool is_refinable(const ProxyPair& pair) noexcept {
    return !pair.splits.empty();
}

/// Bytes held by the arrays; the coarse item's mesh is not among them.
[[nodiscard]] std::uint64_t memory_bytes(const ProxyPair& pair) noexcept;

/// Checks all that a technique relies on: two items; finite numbers, unit normals and axes; facets
/// of samples; each sample in one leaf, children behind their parents, boxes, heights and cones
/// that hold those of all samples below; `offset_m`; triangles that are roots or children of one,
/// spheres and offsets that are nested; `quality`. What can be wrong by rounding alone passes.
///
/// Blind spots: whether triangles that share a split edge have the same split, and whether the
/// coarse item's mesh is the one that the pair speaks of.
/// @return an error that names the array, the element, the field and the value
/// @par Cost O(n log n) for n samples
[[nodiscard]] Result<void> validate(const ProxyPair& pair);

} // namespace farfield
