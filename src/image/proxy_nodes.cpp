#include <farfield/core/assert.hpp>
#include <farfield/image/build_proxy.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace farfield {

namespace {

/// Samples of a leaf: a node is as large as four of them and costs as much as some.
constexpr std::uint32_t kLeafSamples = 16;

/// A node over its samples, which are in order; children are yet to be made.
ProxyNode node_over(const ProxyPair& pair, std::uint32_t first, std::uint32_t count) {
    ProxyNode node;
    node.first = first;
    node.count = count;
    glm::dvec3 sum(0.0);
    for (std::uint32_t i = first; i < first + count; ++i) {
        const ProxySample& sample = pair.samples[i];
        const ProxyFacet& facet = pair.facets[sample.facet];
        const float height = height_over(facet, sample.point);
        node.bounds = unite(node.bounds, sample.point);
        node.below = i == first ? height : std::min(node.below, height);
        node.above = i == first ? height : std::max(node.above, height);
        sum += glm::dvec3(facet.normal);
    }
    const double length = glm::length(sum);
    // Normals that all but cancel have no mean; then they face anywhere.
    if (length < 1e-3 * count) {
        return node;
    }
    node.axis = glm::vec3(sum / length);
    node.cosine = 1.0F;
    for (std::uint32_t i = first; i < first + count; ++i) {
        const glm::vec3& normal = pair.facets[pair.samples[i].facet].normal;
        node.cosine = std::min(node.cosine, glm::dot(node.axis, normal));
    }
    return node;
}

void divide(ProxyPair& pair, std::size_t at) {
    const ProxyNode node = pair.nodes[at];
    if (node.count <= kLeafSamples) {
        return;
    }
    const glm::vec3 size = extent(node.bounds);
    int axis = size.y > size.x ? 1 : 0;
    axis = size.z > size[axis] ? 2 : axis;
    const std::uint32_t half = node.count / 2;
    const auto begin = pair.samples.begin() + node.first;
    // Samples that are equal here are halved by their other coordinates, the same everywhere.
    std::nth_element(
        begin,
        begin + half,
        begin + node.count,
        [axis](const ProxySample& a, const ProxySample& b) {
            for (const int i : {axis, (axis + 1) % 3, (axis + 2) % 3}) {
                if (a.point[i] != b.point[i]) {
                    return a.point[i] < b.point[i];
                }
            }
            return a.facet < b.facet;
        }
    );
    const std::size_t child = pair.nodes.size();
    pair.nodes[at].first_child = static_cast<std::uint32_t>(child);
    pair.nodes.push_back(node_over(pair, node.first, half));
    pair.nodes.push_back(node_over(pair, node.first + half, node.count - half));
    divide(pair, child);
    divide(pair, child + 1);
}

} // namespace

void build_proxy_nodes(ProxyPair& pair) {
    FARFIELD_ASSERT(!pair.samples.empty());
    pair.nodes.clear();
    pair.nodes.push_back(node_over(pair, 0, static_cast<std::uint32_t>(pair.samples.size())));
    divide(pair, 0);
}

} // namespace farfield
