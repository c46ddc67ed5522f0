// Errors of keyframes on coarse models: Chen, Swan, Kuo, "LOD-Sprite Technique for Accelerated
// Terrain Rendering", 1999, section 3.2.
#include <farfield/metric/sprite_angle.hpp>
#include <farfield/technique/sprite_error.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace farfield::sprite_error {

namespace {

// Rays that graze a facet meet its plane anywhere: below this cosine they count as at it, as they
// do where projected fragments are compared with what the keyframe kept.
constexpr float kLeastCosine = 1.0F / 16.0F;
constexpr float kPi = std::numbers::pi_v<float>;
// Bounds are made of offsets, cosines and distances that are each rounded a few times.
constexpr float kBoundSlack = 1.0F + 1e-5F;
// Cosines of cones are rounded as the dot products that they bound.
constexpr float kCosineSlack = 4e-7F;

/// What of a node both frusta see.
enum class Sight : std::uint8_t { nothing, some, all };

Sight sight_of(const ProxyNode& node, const SpriteEyes& eyes, Sight parent) noexcept {
    if (parent == Sight::all) {
        return Sight::all;
    }
    const Overlap drawn = classify(eyes.drawn, node.bounds);
    if (drawn == Overlap::outside) {
        return Sight::nothing;
    }
    const Overlap seen = classify(eyes.seen, node.bounds);
    if (seen == Overlap::outside) {
        return Sight::nothing;
    }
    return drawn == Overlap::inside && seen == Overlap::inside ? Sight::all : Sight::some;
}

bool sees(const Frustum& frustum, const glm::vec3& point) noexcept {
    return std::all_of(frustum.planes.begin(), frustum.planes.end(), [&](const Plane& plane) {
        return signed_distance(plane, point) >= 0.0F;
    });
}

bool sees(const SpriteEyes& eyes, const glm::vec3& point) noexcept {
    return sees(eyes.drawn, point) && sees(eyes.seen, point);
}

float angle_with_offset(const SpriteEyes& eyes, const glm::vec3& point, float offset) noexcept {
    if (point == eyes.drawn_from || point == eyes.seen_from ||
        offset <= -glm::distance(point, eyes.drawn_from)) {
        return kPi;
    }
    return metric::sprite_angle_unchecked(eyes.drawn_from, eyes.seen_from, point, offset);
}

/// Least |n.d| of the facets under a node, and on which sides of them the eye is.
struct Facing {
    float cosine = kLeastCosine;
    bool front = true;
    bool back = true;
};

Facing facing_of(const ProxyNode& node, const glm::vec3& eye) noexcept {
    const glm::vec3 offset = center(node.bounds) - eye;
    const float distance = glm::length(offset);
    const float radius = 0.5F * glm::length(extent(node.bounds));
    Facing facing;
    if (!(distance > radius)) {
        return facing;
    }
    // Directions are in a cone of half-angle alpha around that to the middle, normals in one of
    // beta around the axis: the sum of both widens the angle between the two.
    const float sin_alpha = radius / distance;
    const float cos_alpha = std::sqrt(std::max(1.0F - sin_alpha * sin_alpha, 0.0F));
    const float cos_beta = std::max(node.cosine - kCosineSlack, -1.0F);
    const float sin_beta = std::sqrt(std::max(1.0F - cos_beta * cos_beta, 0.0F));
    const float cos_both = cos_alpha * cos_beta - sin_alpha * sin_beta;
    const float sin_both = sin_alpha * cos_beta + cos_alpha * sin_beta;
    if (cos_beta <= 0.0F || cos_both <= 0.0F) {
        return facing;
    }
    const float along = glm::dot(node.axis, offset) / distance;
    const float across = std::sqrt(std::max(1.0F - along * along, 0.0F));
    const float least = std::abs(along) * cos_both - across * sin_both - kCosineSlack;
    if (least > 0.0F) {
        facing.front = along < 0.0F;
        facing.back = along > 0.0F;
        facing.cosine = std::max(least, kLeastCosine);
    }
    return facing;
}

/// Depth first, the child with the greater bound first.
struct LargestWalk {
    const ProxyPair& pair;
    const SpriteEyes& eyes;
    SpriteError result;
    float best = 0.0F;

    void visit(const ProxyNode& node, Sight sight) noexcept {
        if (node.first_child == 0) {
            for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
                const ProxySample& sample = pair.samples[i];
                if (sight == Sight::all || sees(eyes, sample.point)) {
                    ++result.samples;
                    best = std::max(best, of_sample(pair, sample, eyes));
                }
            }
            return;
        }
        std::array<std::uint32_t, 2> children{node.first_child, node.first_child + 1};
        std::array<Sight, 2> sights{};
        std::array<float, 2> bounds{};
        for (std::size_t i = 0; i < 2; ++i) {
            const ProxyNode& child = pair.nodes[children[i]];
            ++result.nodes;
            sights[i] = sight_of(child, eyes, sight);
            bounds[i] = sights[i] == Sight::nothing ? -1.0F : bound_of_node(child, eyes);
        }
        const std::size_t first = bounds[1] > bounds[0] ? 1 : 0;
        for (const std::size_t i : {first, 1 - first}) {
            if (bounds[i] > best) {
                visit(pair.nodes[children[i]], sights[i]);
            }
        }
    }
};

/// Calls `use` with ranges of samples, and whether all of them are in sight.
template <typename Use>
void for_seen(
    const ProxyPair& pair,
    const SpriteEyes& eyes,
    std::uint32_t index,
    Sight parent,
    std::uint32_t& nodes,
    const Use& use
) noexcept {
    const ProxyNode& node = pair.nodes[index];
    ++nodes;
    const Sight sight = sight_of(node, eyes, parent);
    if (sight == Sight::nothing) {
        return;
    }
    if (sight == Sight::all || node.first_child == 0) {
        use(node, sight == Sight::all);
        return;
    }
    for_seen(pair, eyes, node.first_child, sight, nodes, use);
    for_seen(pair, eyes, node.first_child + 1, sight, nodes, use);
}

/// Sums up squares.
struct Mean {
    double sum = 0.0;
    double largest = 0.0;
    std::uint32_t count = 0;

    void add(double angle) noexcept {
        sum += angle * angle;
        largest = std::max(largest, angle);
        ++count;
    }
    [[nodiscard]] SpriteError result(std::uint32_t nodes) const noexcept {
        const double rms = count == 0 ? 0.0 : std::sqrt(sum / count);
        return {.rms_rad = rms, .largest_rad = largest, .samples = count, .nodes = nodes};
    }
};

} // namespace

float offset_along_ray(
    const ProxyFacet& facet, const glm::vec3& point, const glm::vec3& drawn_from
) noexcept {
    const glm::vec3 offset = point - drawn_from;
    const float distance = glm::length(offset);
    const float cosine = distance > 0.0F ? glm::dot(facet.normal, offset) / distance : 0.0F;
    const float size = std::max(std::abs(cosine), kLeastCosine);
    return height_over(facet, point) / (cosine > 0.0F ? -size : size);
}

float of_sample(const ProxyPair& pair, const ProxySample& sample, const SpriteEyes& eyes) noexcept {
    return angle_with_offset(
        eyes,
        sample.point,
        offset_along_ray(pair.facets[sample.facet], sample.point, eyes.drawn_from)
    );
}

float bound_of_node(const ProxyNode& node, const SpriteEyes& eyes) noexcept {
    const float drawn_distance = distance(node.bounds, eyes.drawn_from) / kBoundSlack;
    const float seen_distance = distance(node.bounds, eyes.seen_from) / kBoundSlack;
    if (drawn_distance <= 0.0F || seen_distance <= 0.0F) {
        return kPi;
    }
    const Facing facing = facing_of(node, eyes.drawn_from);
    float least = 0.0F;
    float most = 0.0F;
    if (facing.front) {
        least = std::min(least, node.below);
        most = std::max(most, node.above);
    }
    if (facing.back) {
        least = std::min(least, -node.above);
        most = std::max(most, -node.below);
    }
    least *= kBoundSlack / facing.cosine;
    most *= kBoundSlack / facing.cosine;
    if (-least >= drawn_distance) {
        return kPi;
    }
    const float turn =
        metric::largest_sprite_turn_unchecked(eyes.drawn_from, eyes.seen_from, node.bounds);
    const float bound = std::max(
        metric::sprite_angle_bound_unchecked(turn, seen_distance, least),
        metric::sprite_angle_bound_unchecked(turn, seen_distance, most)
    );
    return std::min(bound * kBoundSlack, kPi);
}

SpriteError largest(const ProxyPair& pair, const SpriteEyes& eyes, float ignore_rad) noexcept {
    const ProxyNode& root = pair.nodes[0];
    LargestWalk walk{pair, eyes, {}, ignore_rad};
    walk.result.nodes = 1;
    const Sight sight = sight_of(root, eyes, Sight::some);
    if (sight != Sight::nothing && bound_of_node(root, eyes) > ignore_rad) {
        walk.visit(root, sight);
    }
    walk.result.largest_rad = double{walk.best};
    return walk.result;
}

SpriteError rms(const ProxyPair& pair, const SpriteEyes& eyes, std::uint32_t most) noexcept {
    std::uint32_t nodes = 0;
    std::uint32_t step = 1;
    if (most > 0) {
        std::uint32_t seen = 0;
        for_seen(pair, eyes, 0, Sight::some, nodes, [&](const ProxyNode& node, bool /*whole*/) {
            seen += node.count;
        });
        nodes = 0;
        step = std::max(seen / most, 1U);
    }
    Mean mean;
    std::uint32_t skip = step / 2; // samples before the next one that is measured
    for_seen(pair, eyes, 0, Sight::some, nodes, [&](const ProxyNode& node, bool whole) {
        std::uint32_t i = skip;
        for (; i < node.count; i += step) {
            const ProxySample& sample = pair.samples[node.first + i];
            if (whole || sees(eyes, sample.point)) {
                mean.add(double{of_sample(pair, sample, eyes)});
            }
        }
        skip = i - node.count;
    });
    return mean.result(nodes);
}

SpriteError paper(
    const ProxyPair& pair, const SpriteEyes& eyes, std::span<const std::uint32_t> samples
) noexcept {
    const glm::vec3 middle = center(pair.nodes[0].bounds);
    const float turn = middle == eyes.drawn_from
                           ? kPi
                           : metric::sprite_turn_unchecked(eyes.drawn_from, eyes.seen_from, middle);
    Mean mean;
    for (const std::uint32_t index : samples) {
        const ProxySample& sample = pair.samples[index];
        const ProxyFacet& facet = pair.facets[sample.facet];
        const float height = height_over(facet, sample.point);
        const bool behind = glm::dot(facet.normal, sample.point - eyes.drawn_from) > 0.0F;
        const float far = glm::distance(sample.point, eyes.seen_from);
        mean.add(double{
            far > 0.0F ? metric::shared_sprite_angle_unchecked(turn, far, behind ? -height : height)
                       : kPi});
    }
    return mean.result(0);
}

std::vector<std::uint32_t> middle_samples(const ProxyPair& pair) {
    struct Middle {
        glm::dvec3 sum{0.0};
        std::uint32_t count = 0;
        std::uint32_t nearest = UINT32_MAX;
        double distance = std::numeric_limits<double>::infinity();
    };
    std::vector<Middle> middles(pair.facets.size());
    for (const ProxySample& sample : pair.samples) {
        middles[sample.facet].sum += glm::dvec3(sample.point);
        ++middles[sample.facet].count;
    }
    for (std::size_t i = 0; i < pair.samples.size(); ++i) {
        Middle& middle = middles[pair.samples[i].facet];
        const double distance =
            glm::distance(glm::dvec3(pair.samples[i].point), middle.sum / double(middle.count));
        if (distance < middle.distance) {
            middle.distance = distance;
            middle.nearest = static_cast<std::uint32_t>(i);
        }
    }
    std::vector<std::uint32_t> chosen;
    for (const Middle& middle : middles) {
        if (middle.count > 0) {
            chosen.push_back(middle.nearest);
        }
    }
    return chosen;
}

bool is_near(const ProxyPair& pair, const glm::vec3& eye, float margin) noexcept {
    const auto visit = [&](const auto& self, const ProxyNode& node) -> bool {
        const float reach = std::max(std::max(-node.below, node.above), 0.0F) + margin;
        if (distance(node.bounds, eye) > reach) {
            return false;
        }
        return node.first_child == 0 || self(self, pair.nodes[node.first_child]) ||
               self(self, pair.nodes[node.first_child + 1]);
    };
    return visit(visit, pair.nodes[0]);
}

} // namespace farfield::sprite_error
