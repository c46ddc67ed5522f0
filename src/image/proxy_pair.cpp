#include <farfield/image/proxy_pair.hpp>

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>

namespace farfield {

namespace {

/// A sum of four products in float is off by less than four units of rounding of its largest term;
/// twice that, for bounds are rounded as well, and by other compilers in another way.
constexpr float kRounding = 8.0F * std::numeric_limits<float>::epsilon();

std::string text(float value) {
    std::array<char, 32> buffer{};
    const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
    return error == std::errc{} ? std::string(buffer.data(), end) : std::string("?");
}

template <typename Vector>
std::string text(const Vector& v) {
    return std::to_string(v.x) + ' ' + std::to_string(v.y) + ' ' + std::to_string(v.z);
}

tl::unexpected<Error> bad(const std::string& where, const char* field, const std::string& value) {
    return fail(ErrorCode::bad_data, "proxy pair: " + where + ": " + field + " is " + value);
}

std::string named(const char* array, std::size_t index) {
    return std::string(array) + " " + std::to_string(index);
}

bool is_finite(const glm::vec3& v) noexcept {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

bool is_unit(const glm::vec3& v) noexcept {
    return std::abs(glm::dot(v, v) - 1.0F) <= kRounding;
}

float size_of(const glm::vec3& v) noexcept {
    return std::abs(v.x) + std::abs(v.y) + std::abs(v.z);
}

/// How far the height of a sample may be off by rounding. [m]
float slack_of(const ProxySample& sample, const ProxyFacet& facet) noexcept {
    return kRounding * (size_of(sample.point) + std::abs(facet.plane));
}

Result<void> check_whole(const ProxyPair& pair) {
    if (pair.fine == kNone<ItemId> || pair.coarse == kNone<ItemId> || pair.fine == pair.coarse) {
        return bad(
            "items",
            "coarse",
            std::to_string(index_of(pair.coarse)) + " and fine " +
                std::to_string(index_of(pair.fine)) + ", expected two items"
        );
    }
    const glm::dvec3& origin = pair.origin;
    if (!std::isfinite(origin.x) || !std::isfinite(origin.y) || !std::isfinite(origin.z)) {
        return bad("whole", "origin", text(origin));
    }
    if (!std::isfinite(pair.offset_m) || pair.offset_m < 0.0F) {
        return bad("whole", "offset_m", text(pair.offset_m));
    }
    for (const auto& [name, size] :
         {std::pair{"samples", pair.samples.size()},
          std::pair{"facets", pair.facets.size()},
          std::pair{"nodes", pair.nodes.size()}}) {
        if (size == 0 || size >= UINT32_MAX) {
            return bad(name, "their number", std::to_string(size));
        }
    }
    const ProxyPair::Quality& quality = pair.quality;
    if (quality.samples != pair.samples.size()) {
        return bad(
            "quality",
            "samples",
            std::to_string(quality.samples) + ", expected " + std::to_string(pair.samples.size())
        );
    }
    if (!(quality.rms_m >= 0.0) || !(quality.hausdorff_m >= 0.0) || !std::isfinite(quality.rms_m) ||
        !std::isfinite(quality.hausdorff_m)) {
        return bad(
            "quality",
            "hausdorff_m",
            std::to_string(quality.hausdorff_m) + " and rms_m " + std::to_string(quality.rms_m)
        );
    }
    return {};
}

Result<void> check_samples(const ProxyPair& pair) {
    for (std::size_t i = 0; i < pair.facets.size(); ++i) {
        const ProxyFacet& facet = pair.facets[i];
        if (!is_finite(facet.normal) || !is_unit(facet.normal)) {
            return bad(named("facet", i), "normal", text(facet.normal) + ", expected a unit one");
        }
        if (!std::isfinite(facet.plane)) {
            return bad(named("facet", i), "plane", text(facet.plane));
        }
    }
    for (std::size_t i = 0; i < pair.samples.size(); ++i) {
        const ProxySample& sample = pair.samples[i];
        if (!is_finite(sample.point)) {
            return bad(named("sample", i), "point", text(sample.point));
        }
        if (sample.facet >= pair.facets.size()) {
            return bad(
                named("sample", i),
                "facet",
                std::to_string(sample.facet) + " of " + std::to_string(pair.facets.size())
            );
        }
        const ProxyFacet& facet = pair.facets[sample.facet];
        const float height = height_over(facet, sample.point);
        if (!(std::abs(height) <= pair.offset_m + slack_of(sample, facet))) {
            return bad(
                named("sample", i),
                "height over its facet",
                text(height) + ", more than offset_m " + text(pair.offset_m)
            );
        }
    }
    return {};
}

/// That a node holds what its samples are.
Result<void> check_contents(const ProxyPair& pair, std::size_t index) {
    const ProxyNode& node = pair.nodes[index];
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const ProxySample& sample = pair.samples[i];
        const ProxyFacet& facet = pair.facets[sample.facet];
        if (!contains(node.bounds, sample.point)) {
            return bad(
                named("node", index),
                "bounds",
                text(node.bounds.lo) + " to " + text(node.bounds.hi) + " without " +
                    named("sample", i)
            );
        }
        const float height = height_over(facet, sample.point);
        const float slack = slack_of(sample, facet);
        if (!(height >= node.below - slack && height <= node.above + slack)) {
            return bad(
                named("node", index),
                "below",
                text(node.below) + " and above " + text(node.above) + ", " + named("sample", i) +
                    " is " + text(height)
            );
        }
        if (!(glm::dot(node.axis, facet.normal) >= node.cosine - kRounding)) {
            return bad(
                named("node", index),
                "cosine",
                text(node.cosine) + ", the facet of " + named("sample", i) + " is outside the cone"
            );
        }
    }
    return {};
}

/// Children behind their parents, the samples of a parent shared out among them.
Result<void> check_nodes(const ProxyPair& pair) {
    const std::size_t count = pair.nodes.size();
    std::vector<std::uint8_t> levels(count, 0); // 0: no parent yet
    levels[0] = 1;
    if (pair.nodes[0].first != 0 || pair.nodes[0].count != pair.samples.size()) {
        return bad(
            named("node", 0),
            "count",
            std::to_string(pair.nodes[0].count) + " from " + std::to_string(pair.nodes[0].first) +
                ", expected all " + std::to_string(pair.samples.size()) + " samples"
        );
    }
    for (std::size_t i = 0; i < count; ++i) {
        const ProxyNode& node = pair.nodes[i];
        if (levels[i] == 0) {
            return bad(named("node", i), "its parent", "none");
        }
        if (levels[i] > kMostProxyLevels) {
            return bad(named("node", i), "its level", std::to_string(levels[i]));
        }
        if (!is_finite(node.axis) || !is_unit(node.axis)) {
            return bad(named("node", i), "axis", text(node.axis) + ", expected a unit one");
        }
        // A node that holds its samples has numbers that exist, as long as it has samples.
        if (Result<void> held = check_contents(pair, i); !held) {
            return held;
        }
        if (node.first_child == 0) {
            continue;
        }
        const std::size_t child = node.first_child;
        if (child <= i || child + 1 >= count) {
            return bad(
                named("node", i),
                "first_child",
                std::to_string(child) + ", expected two after it of " + std::to_string(count)
            );
        }
        const ProxyNode& first = pair.nodes[child];
        const ProxyNode& second = pair.nodes[child + 1];
        if (first.first != node.first || first.count == 0 || second.count == 0 ||
            second.first != first.first + first.count ||
            std::uint64_t{first.count} + second.count != node.count) {
            return bad(
                named("node", i),
                "first_child",
                std::to_string(child) + ", whose samples and those of the next are not its own"
            );
        }
        if (levels[child] != 0 || levels[child + 1] != 0) {
            return bad(
                named("node", i),
                "first_child",
                std::to_string(child) + ", which another node has as well"
            );
        }
        levels[child] = static_cast<std::uint8_t>(levels[i] + 1);
        levels[child + 1] = levels[child];
    }
    return {};
}

/// That the split of a triangle holds that of a child.
bool holds(const ProxySplit& outer, const ProxySplit& inner) noexcept {
    const glm::dvec3 apart = glm::dvec3(inner.center) - glm::dvec3(outer.center);
    const double reach = glm::length(apart) + double{inner.radius};
    return reach <= double{outer.radius} * (1.0 + double{kRounding}) &&
           inner.offset <= outer.offset;
}

Result<void> check_split(const ProxyPair& pair, std::size_t i) {
    const ProxySplit& split = pair.splits[i];
    if (!is_finite(split.center)) {
        return bad(named("split", i), "center", text(split.center));
    }
    if (!std::isfinite(split.radius) || split.radius < 0.0F) {
        return bad(named("split", i), "radius", text(split.radius));
    }
    if (!std::isfinite(split.offset) || split.offset < 0.0F || split.offset > pair.offset_m) {
        return bad(
            named("split", i),
            "offset",
            text(split.offset) + ", expected 0 to offset_m " + text(pair.offset_m)
        );
    }
    return {};
}

Result<void> check_triangles(const ProxyPair& pair) {
    const std::size_t count = is_refinable(pair) ? pair.facets.size() : 0;
    if (pair.splits.size() != count || pair.children.size() != count || pair.root_count > count ||
        (count > 0 && pair.root_count == 0)) {
        return bad(
            "triangles",
            "their number",
            std::to_string(pair.splits.size()) + " splits, " +
                std::to_string(pair.children.size()) + " children and " +
                std::to_string(pair.root_count) + " roots of " +
                std::to_string(pair.facets.size()) + " facets"
        );
    }
    for (std::size_t i = 0; i < count; ++i) {
        if (Result<void> checked = check_split(pair, i); !checked) {
            return checked;
        }
    }
    std::vector<bool> has_parent(count, false);
    std::uint32_t leaves = 0;
    for (std::size_t i = 0; i < count; ++i) {
        if (has_parent[i] != (i >= pair.root_count)) {
            return bad(
                named("triangle", i),
                "its place",
                (has_parent[i] ? "below another, but it is one of " : "below none before it, of ") +
                    std::to_string(pair.root_count) + " roots"
            );
        }
        const std::size_t child = pair.children[i];
        if (child == UINT32_MAX) {
            ++leaves;
            continue;
        }
        if (child <= i || child + 1 >= count || has_parent[child] || has_parent[child + 1]) {
            return bad(
                named("triangle", i),
                "children",
                std::to_string(child) + ", expected two after it of " + std::to_string(count) +
                    " that are below no other"
            );
        }
        for (const std::size_t below : {child, child + 1}) {
            has_parent[below] = true;
            if (!holds(pair.splits[i], pair.splits[below])) {
                return bad(
                    named("split", i),
                    "radius",
                    text(pair.splits[i].radius) + " and offset " + text(pair.splits[i].offset) +
                        ", which do not hold " + named("split", below)
                );
            }
        }
    }
    const std::size_t facets = count > 0 ? leaves : pair.facets.size();
    if (pair.quality.facets != facets) {
        return bad(
            "quality",
            "facets",
            std::to_string(pair.quality.facets) + ", expected " + std::to_string(facets)
        );
    }
    return {};
}

template <typename T>
std::uint64_t bytes_of(const std::vector<T>& array) noexcept {
    return std::uint64_t{array.size()} * sizeof(T);
}

} // namespace

std::uint64_t memory_bytes(const ProxyPair& pair) noexcept {
    return bytes_of(pair.samples) + bytes_of(pair.facets) + bytes_of(pair.nodes) +
           bytes_of(pair.splits) + bytes_of(pair.children);
}

Result<void> validate(const ProxyPair& pair) {
    Result<void> checked = check_whole(pair);
    checked = checked ? check_samples(pair) : checked;
    checked = checked ? check_nodes(pair) : checked;
    return checked ? check_triangles(pair) : checked;
}

} // namespace farfield
