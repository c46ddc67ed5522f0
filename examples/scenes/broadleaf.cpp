#include "broadleaf.hpp"

#include "facets.hpp"
#include "random.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace farfield::scenes {

namespace {

using glm::dvec3;

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr int kMinTriangles = 5000;
constexpr int kMaxTriangles = 10'000'000;

// The tree is grown at its natural size and stretched to the asked one at the end.
constexpr double kNaturalTriangles = 52470.0;
constexpr double kCrownMiddle = 7.3;
const dvec3 kCrown(4.4, 4.2, 4.4); // half axes of the ellipsoid that boughs end on
constexpr int kLimbs = 9;
constexpr int kBoughs = 84;
constexpr int kTwigsPerBough = 6;

const dvec3 kBarkDark(58.0, 48.0, 38.0);
const dvec3 kBarkLight(106.0, 92.0, 74.0);
const dvec3 kLeafShade(26.0, 46.0, 18.0);
const dvec3 kLeafGreen(78.0, 118.0, 42.0);
const dvec3 kLeafTip(158.0, 180.0, 84.0);

using Curve = std::array<dvec3, 3>; ///< control points of a quadratic Bezier curve

struct Twig {
    dvec3 begin{0.0};
    dvec3 end{0.0};
    double brightness = 0.0; ///< [-1, 1] of the bough it is on
};

dvec3 at(const Curve& curve, double t) {
    const double s = 1.0 - t;
    return curve[0] * (s * s) + curve[1] * (2.0 * s * t) + curve[2] * (t * t);
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
    explicit Grower(const BroadleafOptions& options)
        : options_(options), random_(options.seed),
          detail_(std::clamp(std::sqrt(options.triangles / kNaturalTriangles), 0.2, 4.0)) {}

    Mesh grow() {
        grow_wood();
        grow_leaves(options_.triangles - facets_.count());
        Mesh mesh = facets_.finish("tree");
        mesh.splittable = false;
        stretch(mesh);
        return mesh;
    }

  private:
    [[nodiscard]] int scaled(int count, int least) const {
        return std::max(least, static_cast<int>(std::lround(count * detail_)));
    }

    dvec3 wobble(double size) {
        return {
            random_.between(-size, size),
            random_.between(-size, size),
            random_.between(-size, size)};
    }

    void grow_wood() {
        const dvec3 lean = horizontal(random_.between(0.0, kTwoPi)) * 0.3;
        const dvec3 top = lean + dvec3(0.0, 7.6, 0.0);
        const Curve trunk = {dvec3(0.0), lean * 0.2 + dvec3(0.0, 3.0, 0.0), top};
        add_tube(trunk, 0.42, 0.12, scaled(10, 2), scaled(11, 3));
        std::vector<Curve> limbs;
        const double turn = random_.between(0.0, kTwoPi);
        for (int k = 0; k < kLimbs; ++k) {
            const double share = static_cast<double>(k) / (kLimbs - 1);
            // Twice the golden angle apart, so that no limb hides the one below it.
            const double azimuth = turn + 2.4 * k + random_.between(-0.25, 0.25);
            const dvec3 start = at(trunk, 0.30 + 0.62 * share);
            const double reach = std::lerp(2.9, 1.1, share * share) * random_.between(0.9, 1.1);
            const double rise = std::lerp(1.9, 2.7, share) * random_.between(0.9, 1.1);
            const dvec3 end = start + horizontal(azimuth) * reach + dvec3(0.0, rise, 0.0);
            const dvec3 bend = start + horizontal(azimuth) * (0.62 * reach) +
                               dvec3(0.0, 0.30 * rise, 0.0) + wobble(0.15);
            const double radius = std::lerp(0.17, 0.09, share);
            limbs.push_back({start, bend, end});
            add_tube(limbs.back(), radius, 0.04, scaled(8, 2), scaled(8, 3));
        }
        limbs.push_back(trunk); // bears the boughs of the top
        grow_boughs(limbs);
    }

    /// Boughs from the limbs to points spread evenly over the crown, and the twigs they bear.
    void grow_boughs(const std::vector<Curve>& limbs) {
        // Turning by the golden angle spreads points on a ball without rows or seams.
        const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
        for (int i = 0; i < kBoughs; ++i) {
            const double azimuth = golden_angle * i + random_.between(-0.2, 0.2);
            const double sine = 0.99 - 1.62 * (i + 0.5) / kBoughs; // the underside is open
            const double cosine = std::sqrt(1.0 - sine * sine);
            const dvec3 outward = horizontal(azimuth) * cosine + dvec3(0.0, sine, 0.0);
            const double depth = random_.between(0.72, 1.0);
            const dvec3 end = dvec3(0.0, kCrownMiddle, 0.0) + outward * kCrown * depth;
            const dvec3 start = nearest_on(limbs, end);
            const dvec3 bend =
                (start + end) * 0.5 + dvec3(0.0, 0.12 * glm::distance(start, end), 0.0);
            const Curve bough = {start, bend + wobble(0.15), end};
            add_tube(bough, 0.055, 0.015, scaled(5, 1), scaled(5, 3));
            const double brightness = random_.between(-1.0, 1.0);
            for (int twig = 0; twig < kTwigsPerBough; ++twig) {
                const double t = twig == 0 ? 1.0 : random_.between(0.45, 1.0);
                const dvec3 begin = at(bough, t);
                const dvec3 direction = glm::normalize(outward + wobble(1.1));
                const dvec3 tip = begin + direction * random_.between(0.45, 0.9);
                add_tube({begin, (begin + tip) * 0.5, tip}, 0.015, 0.006, 1, 3);
                twigs_.push_back({begin, tip, brightness});
            }
        }
    }

    /// The point of all limbs, beyond their first third, that is nearest to another point.
    static dvec3 nearest_on(const std::vector<Curve>& limbs, const dvec3& point) {
        dvec3 nearest(0.0);
        double least = std::numeric_limits<double>::infinity();
        for (const Curve& limb : limbs) {
            constexpr int kSteps = 10;
            for (int step = 3; step <= kSteps; ++step) {
                const dvec3 on_limb = at(limb, static_cast<double>(step) / kSteps);
                const double gap = glm::distance(on_limb, point);
                if (gap < least) {
                    least = gap;
                    nearest = on_limb;
                }
            }
        }
        return nearest;
    }

    /// An open tube with flat sides.
    void
    add_tube(const Curve& curve, double first_radius, double last_radius, int rings, int sides) {
        const auto rim = [&](int ring, const dvec3& first, const dvec3& second, int side) {
            const double t = static_cast<double>(ring) / rings;
            const double angle = kTwoPi * side / sides;
            return at(curve, t) + (first * std::cos(angle) + second * std::sin(angle)) *
                                      std::lerp(first_radius, last_radius, t);
        };
        const auto axis_at = [&](int ring) {
            const double before = std::max(ring - 0.5, 0.0) / rings;
            const double after = std::min(ring + 0.5, static_cast<double>(rings)) / rings;
            return glm::normalize(at(curve, after) - at(curve, before));
        };
        dvec3 first = perpendicular(axis_at(0));
        dvec3 second = glm::cross(axis_at(0), first);
        for (int ring = 0; ring < rings; ++ring) {
            // Carried along the curve, so that the tube does not twist.
            const dvec3 axis = axis_at(ring + 1);
            const dvec3 next_first = glm::normalize(first - axis * glm::dot(first, axis));
            const dvec3 next_second = glm::cross(axis, next_first);
            const double open =
                std::clamp(at(curve, static_cast<double>(ring) / rings).y / 9.0, 0.0, 1.0);
            for (int side = 0; side < sides; ++side) {
                const double shade = (0.5 + 0.5 * random_.unit()) * (0.9 - 0.6 * open);
                facets_.add(
                    std::array{
                        rim(ring, first, second, side),
                        rim(ring, first, second, side + 1),
                        rim(ring + 1, next_first, next_second, side + 1),
                        rim(ring + 1, next_first, next_second, side)},
                    glm::mix(kBarkDark, kBarkLight, shade)
                );
            }
            first = next_first;
            second = next_second;
        }
    }

    /// Shares leaves of two triangles evenly among the twigs. An odd count ends with half a leaf.
    void grow_leaves(int triangles) {
        const int leaves = (triangles + 1) / 2;
        const double size = std::clamp(1.0 / detail_, 0.3, 5.0);
        const auto twigs = static_cast<int>(twigs_.size());
        for (int leaf = 0; leaf < leaves; ++leaf) {
            add_leaf(
                twigs_[static_cast<std::size_t>(leaf % twigs)], size, 2 * leaf + 2 <= triangles
            );
        }
    }

    void add_leaf(const Twig& twig, double size, bool whole) {
        const dvec3 along = twig.end - twig.begin;
        const dvec3 base = twig.begin + along * random_.between(0.15, 1.15) + wobble(0.30);
        const dvec3 outward =
            glm::normalize((base - dvec3(0.0, kCrownMiddle - 1.0, 0.0)) / kCrown + wobble(0.05));
        const dvec3 axis =
            glm::normalize(glm::normalize(along) * 0.5 + wobble(0.9) + dvec3(0.0, -0.25, 0.0));
        const dvec3 perpendicular_axis = perpendicular(axis);
        const double roll = random_.between(0.0, kTwoPi);
        const dvec3 side = perpendicular_axis * std::cos(roll) +
                           glm::cross(axis, perpendicular_axis) * std::sin(roll);
        const double length = size * random_.between(0.20, 0.30);
        const dvec3 across = side * (0.5 * size * random_.between(0.12, 0.17));
        const dvec3 middle = base + axis * (0.45 * length);
        dvec3 facet = glm::cross(axis, side);
        facet = glm::dot(facet, outward) < 0.0 ? -facet : facet;
        // Single leaves would sparkle: most of the shading comes from the crown they are in.
        const dvec3 normal = glm::normalize(outward * 0.75 + facet * 0.45);
        const dvec3 color = leaf_color(twig, base);
        const dvec3 tip = base + axis * length;
        if (whole) {
            facets_.add(std::array{base, middle - across, tip, middle + across}, normal, color);
        } else {
            facets_.add(std::array{base, middle - across, tip}, normal, color);
        }
    }

    dvec3 leaf_color(const Twig& twig, const dvec3& point) {
        // 0 in the middle of the crown, 1 at its outside; the inside sees little of the sky.
        const double depth =
            std::min(glm::length((point - dvec3(0.0, kCrownMiddle, 0.0)) / kCrown), 1.15);
        const double height = std::clamp((point.y - 3.0) / 9.0, 0.0, 1.0);
        double light = 0.52 * depth * depth + 0.46 * height;
        light += 0.12 * twig.brightness + random_.between(-0.15, 0.15);
        light = std::clamp(light, 0.0, 1.2);
        return light < 0.8 ? glm::mix(kLeafShade, kLeafGreen, light / 0.8)
                           : glm::mix(kLeafGreen, kLeafTip, (light - 0.8) / 0.4);
    }

    /// To the asked height and width; what little hangs below the ground is cut to it.
    void stretch(Mesh& mesh) const {
        const dvec3 size = extent(mesh.bounds);
        const double across = options_.width_m / std::max(size.x, size.z);
        const dvec3 scale(across, options_.height_m / mesh.bounds.hi.y, across);
        for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
            mesh.positions[i] =
                glm::vec3(glm::max(dvec3(mesh.positions[i]), dvec3(-1e9, 0.0, -1e9)) * scale);
            mesh.normals[i] = glm::vec3(glm::normalize(dvec3(mesh.normals[i]) / scale));
        }
        update_bounds(mesh);
    }

    BroadleafOptions options_;
    Random random_;
    double detail_; ///< how many more segments and sides than at the natural triangle count
    std::vector<Twig> twigs_;
    Facets facets_;
};

} // namespace

Result<Mesh> make_broadleaf(const BroadleafOptions& options) {
    if (options.triangles < kMinTriangles || options.triangles > kMaxTriangles) {
        return fail(
            ErrorCode::invalid_argument,
            "tree: triangles is " + std::to_string(options.triangles) + ", expected " +
                std::to_string(kMinTriangles) + " to " + std::to_string(kMaxTriangles)
        );
    }
    const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
    if (!positive(options.height_m)) {
        return fail(
            ErrorCode::invalid_argument,
            "tree: height_m is " + std::to_string(options.height_m) + ", expected above 0"
        );
    }
    if (!positive(options.width_m)) {
        return fail(
            ErrorCode::invalid_argument,
            "tree: width_m is " + std::to_string(options.width_m) + ", expected above 0"
        );
    }
    return Grower(options).grow();
}

} // namespace farfield::scenes
