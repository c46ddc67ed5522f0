#include "technique/sprite_cut.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace farfield {

namespace {

// As for samples: rays that graze a facet count as at this cosine.
constexpr double kLeastCosine = 1.0 / 16.0;
// Doubling from any angle that floats tell from 0 goes beyond pi before that.
constexpr int kMostDoublings = 64;

double distance_to_segment(
    const glm::dvec3& point, const glm::dvec3& from, const glm::dvec3& to
) noexcept {
    const glm::dvec3 along = to - from;
    const double length_sq = glm::dot(along, along);
    const double part =
        length_sq > 0.0 ? std::clamp(glm::dot(point - from, along) / length_sq, 0.0, 1.0) : 0.0;
    return glm::distance(point, from + along * part);
}

enum class Place : std::uint8_t { outside, partial, inside };

Place place_of(const ProxySplit& split, const Frustum& frustum) noexcept {
    Place place = Place::inside;
    for (const Plane& plane : frustum.planes) {
        const float height = signed_distance(plane, split.center);
        if (height < -split.radius) {
            return Place::outside;
        }
        if (height < split.radius) {
            place = Place::partial;
        }
    }
    return place;
}

/// Down from the roots; stops where there are too many.
struct CutWalk {
    const ProxyPair& pair;
    const CutQuery& query;
    std::vector<std::uint32_t>& out;
    glm::dvec3 axis;
    std::size_t first;
    CutLimit limit;
    float offset_m = 0.0F;

    [[nodiscard]] bool is_full() const noexcept { return out.size() - first > query.most; }

    void visit(std::uint32_t triangle, bool inside) noexcept {
        const ProxySplit& split = pair.splits[triangle];
        if (!inside) {
            const Place place = place_of(split, query.frustum);
            if (place == Place::outside) {
                return;
            }
            inside = place == Place::inside;
        }
        if (is_full()) {
            return;
        }
        const std::uint32_t child = pair.children[triangle];
        if (child != UINT32_MAX && is_split(split)) {
            // The nearer first: what it hides is not shaded then.
            const std::uint32_t nearer = is_nearer(child + 1, child) ? 1U : 0U;
            visit(child + nearer, inside);
            visit(child + 1 - nearer, inside);
            return;
        }
        offset_m = std::max(offset_m, split.offset);
        out.push_back(triangle);
    }

    [[nodiscard]] bool is_nearer(std::uint32_t triangle, std::uint32_t other) const noexcept {
        const glm::dvec3 offset = glm::dvec3(pair.splits[triangle].center) - query.seen_from;
        const glm::dvec3 other_offset = glm::dvec3(pair.splits[other].center) - query.seen_from;
        return glm::dot(offset, offset) < glm::dot(other_offset, other_offset);
    }

    [[nodiscard]] bool is_split(const ProxySplit& split) const noexcept {
        return std::any_of(
            query.drawn_from.begin(),
            query.drawn_from.end(),
            [&](const glm::dvec3& drawn_from) {
                return exceeds(split, axis, drawn_from, query.seen_from, limit);
            }
        );
    }
};

} // namespace

CutLimit limit_of(double threshold_rad) noexcept {
    constexpr double kRight = std::numbers::pi / 2.0;
    CutLimit limit;
    limit.sine = std::sin(std::min(threshold_rad, kRight));
    limit.tangent =
        threshold_rad < kRight ? std::tan(threshold_rad) : std::numeric_limits<double>::infinity();
    limit.all = threshold_rad >= std::numbers::pi;
    return limit;
}

bool exceeds(
    const ProxySplit& split,
    const glm::dvec3& axis,
    const glm::dvec3& drawn_from,
    const glm::dvec3& seen_from,
    const CutLimit& limit
) noexcept {
    if (split.offset == 0.0F || limit.all) {
        return false;
    }
    const glm::dvec3 center(split.center);
    const double radius = double{split.radius};
    const double distance = glm::distance(center, seen_from) - radius;
    const double beside = distance_to_segment(center, drawn_from, seen_from) - radius;
    if (distance <= 0.0 || beside <= 0.0) {
        return true;
    }
    const glm::dvec3 ray = center - drawn_from;
    const double cosine = (std::abs(glm::dot(axis, ray)) - radius) / (glm::length(ray) + radius);
    const double offset = double{split.offset} / std::max(cosine, kLeastCosine);
    if (offset <= limit.sine * distance) {
        return false; // whatever the turn
    }
    // The turn is twice the angle of this tangent, so that its sine and cosine need no more.
    const double half = glm::distance(drawn_from, seen_from) / (2.0 * beside);
    const double scale = 1.0 / (1.0 + half * half);
    const double turn_sine = 2.0 * half * scale;
    const double turn_cosine = (1.0 - half * half) * scale;
    // Towards the eye an offset is worse than away from it. Beyond the turn where the angle is
    // greatest it is that of the sine, which is over the limit already.
    return distance * turn_cosine <= offset ||
           offset * turn_sine > limit.tangent * (distance - offset * turn_cosine);
}

Cut cut_coarse(
    const ProxyPair& pair, const CutQuery& query, std::vector<std::uint32_t>& out
) noexcept {
    CutWalk walk{pair, query, out, glm::dvec3(pair.nodes[0].axis), out.size(), {}};
    const auto first = static_cast<std::uint32_t>(walk.first);
    double threshold_rad = query.threshold_rad;
    for (int doubling = 0; doubling < kMostDoublings; ++doubling) {
        out.resize(walk.first);
        walk.offset_m = 0.0F;
        walk.limit = limit_of(threshold_rad);
        for (std::uint32_t root = 0; root < pair.root_count; ++root) {
            walk.visit(root, false);
        }
        if (!walk.is_full()) {
            return {first, out.size() - walk.first, threshold_rad, walk.offset_m, true};
        }
        if (walk.limit.all) {
            break;
        }
        threshold_rad *= 2.0;
    }
    out.resize(walk.first);
    return {first, 0, std::numbers::pi, pair.offset_m, false};
}

std::size_t finest_triangles(
    const ProxyPair& pair, const Frustum& frustum, std::vector<std::uint32_t>& out
) noexcept {
    const std::size_t before = out.size();
    const auto visit = [&](const auto& self, std::uint32_t triangle, bool inside) -> void {
        if (!inside) {
            const Place place = place_of(pair.splits[triangle], frustum);
            if (place == Place::outside) {
                return;
            }
            inside = place == Place::inside;
        }
        const std::uint32_t child = pair.children[triangle];
        if (child == UINT32_MAX) {
            out.push_back(triangle);
            return;
        }
        self(self, child, inside);
        self(self, child + 1, inside);
    };
    for (std::uint32_t root = 0; root < pair.root_count; ++root) {
        visit(visit, root, false);
    }
    return out.size() - before;
}

} // namespace farfield
