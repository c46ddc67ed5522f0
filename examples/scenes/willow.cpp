#include "willow.hpp"

#include "facets.hpp"
#include "random.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace farfield::scenes {

namespace {

using glm::dvec3;

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr int kMinTriangles = 2000;
constexpr int kMaxTriangles = 10'000'000;

// The tree is grown at its natural size, 14 m by 11 m, and stretched to the asked one at the end.
constexpr double kNaturalTriangles = 36230.0;
constexpr double kFootDepth = 0.56;       // below the ground, 4 % of the height
constexpr double kDomeCenterHeight = 6.6; // the branches end on an ellipsoid around this height
constexpr double kDomeRadius = 4.7;
constexpr double kDomeHeight = 6.4;
constexpr int kLimbs = 7;
constexpr int kPlumes = 64;
constexpr int kStrandsPerPlume = 8;

const dvec3 kBarkDark(62.0, 52.0, 40.0);
const dvec3 kBarkLight(112.0, 98.0, 76.0);
const dvec3 kLeafShade(40.0, 58.0, 24.0);
const dvec3 kLeafGreen(118.0, 142.0, 54.0);
const dvec3 kLeafTip(190.0, 196.0, 108.0);

/// A curve with a radius that shrinks along it.
struct Branch {
    std::vector<dvec3> points;
    double first_radius = 0.0;
    double last_radius = 0.0;
};

/// A hanging shoot: a curve that carries leaves along all its length.
struct Strand {
    std::vector<dvec3> points;
    double length = 0.0;
    double brightness = 0.0; ///< [-1.5, 1.5] mostly of the plume it belongs to
};

dvec3 bezier(const dvec3& a, const dvec3& b, const dvec3& c, double t) {
    const double s = 1.0 - t;
    return a * (s * s) + b * (2.0 * s * t) + c * (t * t);
}

dvec3 horizontal(double azimuth) {
    return {std::cos(azimuth), 0.0, std::sin(azimuth)};
}

/// Any unit vector at a right angle to a unit vector.
dvec3 perpendicular(const dvec3& axis) {
    const dvec3 other = std::abs(axis.y) < 0.9 ? dvec3(0.0, 1.0, 0.0) : dvec3(1.0, 0.0, 0.0);
    return glm::normalize(glm::cross(axis, other));
}

class Grower {
  public:
    explicit Grower(const WillowOptions& options)
        : options_(options), random_(options.seed),
          detail_(std::clamp(std::sqrt(options.triangles / kNaturalTriangles), 0.25, 4.0)) {}

    Mesh grow() {
        grow_wood();
        grow_foliage();
        stretch();
        mesh_.name = "willow";
        const auto index_count = static_cast<std::uint32_t>(mesh_.indices.size());
        mesh_.parts.push_back({0, index_count, kNone<MaterialId>});
        update_bounds(mesh_);
        return std::move(mesh_);
    }

  private:
    int scaled(int count, int least) const {
        return std::max(least, static_cast<int>(std::lround(count * detail_)));
    }

    void grow_wood() {
        const double lean = random_.between(0.0, kTwoPi);
        const dvec3 foot = dvec3(0.0, -kFootDepth, 0.0);
        const dvec3 fork = dvec3(0.0, 2.9, 0.0) + horizontal(lean) * 0.35;
        Branch trunk{{}, 0.62, 0.40};
        const int trunk_segments = scaled(8, 2);
        for (int i = 0; i <= trunk_segments; ++i) {
            const double t = static_cast<double>(i) / trunk_segments;
            trunk.points.push_back(bezier(foot, dvec3(0.0, 1.2, 0.0), fork, t));
        }
        add_tube(trunk, scaled(10, 3));

        std::array<std::array<dvec3, 3>, kLimbs> limbs;
        const int limb_segments = scaled(9, 3);
        for (int k = 0; k < kLimbs; ++k) {
            const double azimuth = (k + random_.between(-0.25, 0.25)) * kTwoPi / kLimbs;
            // One limb in the middle carries the top; the others lean outwards.
            const bool leader = k == 0;
            const double reach = leader ? 0.5 : random_.between(2.2, 3.2);
            const double top = leader ? 11.2 : random_.between(8.4, 10.2);
            const dvec3 start = fork + dvec3(0.0, random_.between(-0.7, -0.1), 0.0);
            const dvec3 end = horizontal(azimuth) * reach + dvec3(0.0, top, 0.0);
            const dvec3 middle = start + horizontal(azimuth) * (reach * 0.75) +
                                 dvec3(0.0, (top - start.y) * 0.42, 0.0);
            limbs[static_cast<std::size_t>(k)] = {start, middle, end};
            Branch limb{{}, leader ? 0.26 : 0.22, 0.03};
            for (int i = 0; i <= limb_segments; ++i) {
                const double t = static_cast<double>(i) / limb_segments;
                limb.points.push_back(bezier(start, middle, end, t) + wobble(0.08 * t));
            }
            add_tube(limb, scaled(7, 3));
        }
        grow_plumes(limbs);
    }

    /// Branches from the limbs to points spread evenly over the dome, and the strands they bear.
    void grow_plumes(const std::array<std::array<dvec3, 3>, kLimbs>& limbs) {
        // Turning by the golden angle spreads points on a dome without rows or seams.
        const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
        const int segments = scaled(6, 2);
        for (int i = 0; i < kPlumes; ++i) {
            const double azimuth = golden_angle * i + random_.between(-0.2, 0.2);
            const double sine = 0.99 - 1.02 * (i + 0.5) / kPlumes;
            const double cosine = std::sqrt(1.0 - sine * sine);
            const double size = random_.between(0.80, 1.04);
            const dvec3 outward = horizontal(azimuth);
            const dvec3 anchor = outward * (kDomeRadius * cosine * size) +
                                 dvec3(0.0, kDomeCenterHeight + kDomeHeight * sine * size, 0.0);

            std::size_t nearest = 0;
            double least = std::numeric_limits<double>::infinity();
            const double fraction = std::clamp((anchor.y - 4.5) / 8.0, 0.30, 0.97);
            for (std::size_t k = 0; k < limbs.size(); ++k) {
                const double gap =
                    glm::distance(bezier(limbs[k][0], limbs[k][1], limbs[k][2], fraction), anchor);
                if (gap < least) {
                    least = gap;
                    nearest = k;
                }
            }
            const dvec3 start =
                bezier(limbs[nearest][0], limbs[nearest][1], limbs[nearest][2], fraction);
            const dvec3 middle = (start + anchor) * 0.5 + dvec3(0.0, 0.28 * least, 0.0);
            Branch branch{{}, 0.07, 0.012};
            for (int step = 0; step <= segments; ++step) {
                const double t = static_cast<double>(step) / segments;
                branch.points.push_back(bezier(start, middle, anchor, t) + wobble(0.05 * t));
            }
            add_tube(branch, scaled(4, 3));

            const double brightness = random_.between(-1.0, 1.0);
            for (int strand = 0; strand < kStrandsPerPlume; ++strand) {
                const double t = strand == 0 ? 1.0 : random_.between(0.55, 1.0);
                grow_strand(
                    bezier(start, middle, anchor, t) + wobble(0.15),
                    azimuth + random_.between(-1.1, 1.1),
                    brightness
                );
            }
        }
    }

    /// A shoot leaves the branch outwards, bends over within a metre and then hangs.
    void grow_strand(const dvec3& start, double azimuth, double brightness) {
        const double fall = random_.between(0.55, 1.0);
        const double lowest = random_.between(0.6, 2.4);
        const double length = std::clamp((start.y - lowest) * fall + 0.8, 1.2, 8.5);
        dvec3 direction = horizontal(azimuth) * random_.between(0.5, 1.1) +
                          dvec3(0.0, random_.between(0.0, 0.8), 0.0);
        // Shoots of the top lie along the dome before they fall, or the branches would show.
        const double high = std::clamp((start.y - 8.0) / 5.0, 0.0, 1.0);
        const double bend = random_.between(0.28, 0.45) - 0.20 * high;
        Strand strand;
        strand.length = length;
        strand.brightness = brightness + random_.between(-0.5, 0.5);
        constexpr double kStep = 0.2;
        dvec3 point = start;
        strand.points.push_back(point);
        const int steps = static_cast<int>(std::ceil(length / kStep));
        for (int i = 0; i < steps; ++i) {
            direction = glm::normalize(glm::normalize(direction) + dvec3(0.0, -bend, 0.0));
            point += direction * (length / steps) + wobble(0.012);
            strand.points.push_back(point);
        }
        strands_.push_back(std::move(strand));
    }

    dvec3 wobble(double size) {
        return {
            random_.between(-size, size),
            random_.between(-size, size),
            random_.between(-size, size)};
    }

    /// Spends what the wood has left on leaves, in proportion to the length of each strand. An odd
    /// count ends with half a leaf.
    void grow_foliage() {
        const int left = options_.triangles - static_cast<int>(mesh_.indices.size() / 3);
        const int leaves = left / 2;
        double total = 0.0;
        for (const Strand& strand : strands_) {
            total += strand.length;
        }
        // Half the leaves have to cover the same crown, so each is twice as large.
        const double size = std::clamp(1.0 / detail_, 0.4, 4.0);
        double before = 0.0;
        int placed = 0;
        for (const Strand& strand : strands_) {
            before += strand.length;
            const int until = static_cast<int>(std::lround(leaves * (before / total)));
            const int count = until - placed;
            for (int i = 0; i < count; ++i) {
                const double t = (i + random_.unit()) / count;
                add_leaf(strand, std::min(t, 1.0), size, true);
            }
            placed = until;
        }
        if (left % 2 != 0) {
            add_leaf(strands_.back(), 1.0, size, false);
        }
    }

    void add_leaf(const Strand& strand, double t, double size, bool whole) {
        const double position = t * static_cast<double>(strand.points.size() - 1);
        const auto segment = std::min(static_cast<std::size_t>(position), strand.points.size() - 2);
        const dvec3 a = strand.points[segment];
        const dvec3 b = strand.points[segment + 1];
        const dvec3 base = a + (b - a) * (position - static_cast<double>(segment));
        const dvec3 along = glm::normalize(b - a);

        const dvec3 splay = horizontal(random_.between(0.0, kTwoPi)) * random_.between(0.25, 0.75);
        const dvec3 axis = glm::normalize(along + splay + dvec3(0.0, -0.35, 0.0));
        const dvec3 first = perpendicular(axis);
        const double roll = random_.between(0.0, kTwoPi);
        const dvec3 side = first * std::cos(roll) + glm::cross(axis, first) * std::sin(roll);
        const double length = size * random_.between(0.34, 0.56);
        const double width = size * random_.between(0.09, 0.13) * (1.0 - 0.35 * t);
        const dvec3 tip = base + axis * length;
        const dvec3 widest = base + axis * (0.42 * length);

        const dvec3 color = leaf_color(strand, base, t);
        // Single leaves would sparkle: most of the shading comes from the dome they hang on.
        const dvec3 dome = glm::normalize(dvec3(
            base.x / kDomeRadius, (base.y - 0.55 * kDomeCenterHeight) / 9.0, base.z / kDomeRadius
        ));
        dvec3 facet = glm::cross(axis, side);
        facet = glm::dot(facet, dome) < 0.0 ? -facet : facet;
        const dvec3 normal = glm::normalize(dome * 0.75 + facet * 0.4);

        const std::uint32_t at = next_vertex();
        add_vertex(base, normal, color * 0.88);
        add_vertex(widest + side * (0.5 * width), normal, color);
        add_vertex(tip, normal, color * 1.08);
        add_triangle(at, at + 1, at + 2);
        if (whole) {
            add_vertex(widest - side * (0.5 * width), normal, color);
            add_triangle(at, at + 2, at + 3);
        }
    }

    dvec3 leaf_color(const Strand& strand, const dvec3& point, double t) {
        // 0 at the trunk, 1 at the outside of the dome; the inside sees little of the sky.
        const double across = std::hypot(point.x, point.z) / (kDomeRadius + 0.9);
        const double above = std::max(0.0, point.y - kDomeCenterHeight) / kDomeHeight;
        const double depth = std::clamp(std::hypot(across, above), 0.0, 1.15);
        const double height = std::clamp(point.y / 13.0, 0.0, 1.0);
        double light = 0.02 + 0.66 * depth * depth + 0.38 * height;
        light += 0.15 * strand.brightness + random_.between(-0.16, 0.16);
        light = std::clamp(light, 0.0, 1.25);
        const dvec3 color = light < 0.75 ? glm::mix(kLeafShade, kLeafGreen, light / 0.75)
                                         : glm::mix(kLeafGreen, kLeafTip, (light - 0.75) / 0.5);
        // Young ends of the shoots are yellower.
        return color + dvec3(16.0, 8.0, -4.0) * (t * t) * light;
    }

    void add_tube(const Branch& branch, int sides) {
        const std::size_t rings = branch.points.size();
        const std::uint32_t at = next_vertex();
        dvec3 first = perpendicular(glm::normalize(branch.points[1] - branch.points[0]));
        for (std::size_t ring = 0; ring < rings; ++ring) {
            const std::size_t before = ring == 0 ? 0 : ring - 1;
            const std::size_t after = std::min(ring + 1, rings - 1);
            const dvec3 axis = glm::normalize(branch.points[after] - branch.points[before]);
            // Carried along the curve, so that the tube does not twist.
            first = glm::normalize(first - axis * glm::dot(first, axis));
            const dvec3 second = glm::cross(axis, first);
            const double t = static_cast<double>(ring) / static_cast<double>(rings - 1);
            const double radius = branch.first_radius + (branch.last_radius - branch.first_radius) *
                                                            (1.0 - (1.0 - t) * (1.0 - t));
            for (int side = 0; side < sides; ++side) {
                const double angle = kTwoPi * side / sides;
                const dvec3 normal = first * std::cos(angle) + second * std::sin(angle);
                const double shade = 0.5 + 0.5 * random_.unit();
                const double open = std::clamp(branch.points[ring].y / 9.0, 0.0, 1.0);
                add_vertex(
                    branch.points[ring] + normal * radius,
                    normal,
                    glm::mix(kBarkDark, kBarkLight, shade * (0.8 - 0.6 * open))
                );
            }
        }
        const auto around = static_cast<std::uint32_t>(sides);
        for (std::uint32_t ring = 0; ring + 1 < rings; ++ring) {
            for (std::uint32_t side = 0; side < around; ++side) {
                const std::uint32_t next = (side + 1) % around;
                const std::uint32_t low = at + ring * around;
                const std::uint32_t high = low + around;
                add_triangle(low + side, low + next, high + side);
                add_triangle(low + next, high + next, high + side);
            }
        }
    }

    /// To the asked height above the ground and width; the foot is stretched with the rest.
    void stretch() {
        dvec3 low(0.0);
        dvec3 high(0.0);
        for (const dvec3& point : points_) {
            low = glm::min(low, point);
            high = glm::max(high, point);
        }
        const double across = options_.width_m / std::max(high.x - low.x, high.z - low.z);
        const dvec3 scale(across, options_.height_m / high.y, across);
        mesh_.positions.reserve(points_.size());
        mesh_.normals.reserve(points_.size());
        for (std::size_t i = 0; i < points_.size(); ++i) {
            mesh_.positions.push_back(glm::vec3(points_[i] * scale));
            mesh_.normals.push_back(glm::vec3(glm::normalize(normals_[i] / scale)));
        }
    }

    std::uint32_t next_vertex() const { return static_cast<std::uint32_t>(points_.size()); }

    void add_vertex(const dvec3& point, const dvec3& normal, const dvec3& color) {
        points_.push_back(point);
        normals_.push_back(normal);
        mesh_.colors.push_back(to_color(color));
    }

    void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        mesh_.indices.insert(mesh_.indices.end(), {a, b, c});
    }

    WillowOptions options_;
    Random random_;
    double detail_; ///< how many more segments and sides than at the natural triangle count
    std::vector<Strand> strands_;
    std::vector<dvec3> points_;
    std::vector<dvec3> normals_;
    Mesh mesh_;
};

} // namespace

Result<Mesh> make_willow(const WillowOptions& options) {
    if (options.triangles < kMinTriangles || options.triangles > kMaxTriangles) {
        return fail(
            ErrorCode::invalid_argument,
            "willow: triangles is " + std::to_string(options.triangles) + ", expected " +
                std::to_string(kMinTriangles) + " to " + std::to_string(kMaxTriangles)
        );
    }
    if (!(options.height_m > 0.0) || !std::isfinite(options.height_m)) {
        return fail(
            ErrorCode::invalid_argument,
            "willow: height_m is " + std::to_string(options.height_m) + ", expected above 0"
        );
    }
    if (!(options.width_m > 0.0) || !std::isfinite(options.width_m)) {
        return fail(
            ErrorCode::invalid_argument,
            "willow: width_m is " + std::to_string(options.width_m) + ", expected above 0"
        );
    }
    return Grower(options).grow();
}

} // namespace farfield::scenes
