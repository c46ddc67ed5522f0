#pragma once

#include <farfield/scene/scene.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace farfield::scenes {

/// Any number of sides or steps; one triangle is never longer than this along a solid.
inline constexpr double kAnyLength = std::numeric_limits<double>::infinity();

/// How a tube is made.
struct TubeOptions {
    double radius = 0.1;  ///< [m] > 0
    double bend = 0.3;    ///< [m] of the middle line where it turns, >= radius
    int sides = 12;       ///< >= 3; a multiple of 4 looks the same after a quarter turn
    int arc_segments = 6; ///< of a quarter turn, >= 1
    double longest = 3.0; ///< [m] of a triangle along a straight piece, > 0
    bool capped = true;   ///< flat ends; without them the ends are open
};

/// Gathers machine parts, each a closed surface with smooth normals where it is round, into a mesh.
class Solids {
  public:
    /// Triangles made so far.
    [[nodiscard]] int count() const noexcept { return static_cast<int>(indices_.size() / 3); }

    /// A flat rectangle of quads, its front where `along` x `across` points.
    /// @param longest [m] side of a quad
    void add_sheet(
        const glm::dvec3& corner,
        const glm::dvec3& along,
        const glm::dvec3& across,
        const glm::dvec3& color,
        double longest = kAnyLength
    );

    /// A box along the axes. @pre lo < hi
    void add_box(
        const glm::dvec3& lo,
        const glm::dvec3& hi,
        const glm::dvec3& color,
        double longest = kAnyLength
    );

    /// A bar of rectangular section around a line: `width` across it and level, `height` across
    /// both; a bar that stands has its width along x. @pre from != to
    void add_bar(
        const glm::dvec3& from,
        const glm::dvec3& to,
        double width,
        double height,
        const glm::dvec3& color,
        double longest = kAnyLength
    );

    /// A rolled I section around a line, as `add_bar` lies. @pre from != to
    void add_girder(
        const glm::dvec3& from,
        const glm::dvec3& to,
        double width,
        double height,
        const glm::dvec3& color,
        double longest = kAnyLength
    );

    /// What turning a line around an axis gives. Corners of less than 35 degrees are smoothed.
    /// @param axis unit
    /// @param profile of (distance from the axis, way along it from `base`) [m], anticlockwise:
    /// outside is to the right of the way. Closed where it begins and ends on the axis.
    void add_lathe(
        const glm::dvec3& base,
        const glm::dvec3& axis,
        std::span<const glm::dvec2> profile,
        int sides,
        const glm::dvec3& color
    );

    /// A closed cylinder. @param axis unit
    void add_cylinder(
        const glm::dvec3& base,
        const glm::dvec3& axis,
        double radius,
        double length,
        int sides,
        const glm::dvec3& color
    );

    /// A tube along a line with rounded corners. @pre two points at least, no two neighbours the
    /// same, no turn back, room for the bends
    void add_tube(
        std::span<const glm::dvec3> points, const TubeOptions& options, const glm::dvec3& color
    );

    /// A torus. @param axis unit
    void add_ring(
        const glm::dvec3& middle,
        const glm::dvec3& axis,
        double ring_radius,
        double tube_radius,
        int around,
        int sides,
        const glm::dvec3& color
    );

    /// The mesh, of one opaque part. Leaves nothing behind.
    [[nodiscard]] Mesh finish(std::string name, bool splittable);

  private:
    /// Where a ring of vertices stands: the middle and two unit vectors at right angles.
    struct Station {
        glm::dvec3 at{0.0};
        glm::dvec3 u{0.0};
        glm::dvec3 v{0.0};
    };

    std::uint32_t
    add_vertex(const glm::dvec3& at, const glm::dvec3& normal, const glm::dvec3& color);
    /// Vertices around a station, with normals of so much outwards and so much along u x v.
    std::uint32_t add_circle(
        const Station& station,
        double radius,
        const glm::dvec2& normal,
        std::span<const glm::dvec2> circle,
        const glm::dvec3& color
    );
    void join(std::uint32_t first, std::uint32_t second, std::uint32_t sides);
    void add_end(
        const Station& station,
        double radius,
        double direction,
        std::span<const glm::dvec2> circle,
        const glm::dvec3& color
    );
    void add_block(
        const glm::dvec3& corner,
        const glm::dvec3& x,
        const glm::dvec3& y,
        const glm::dvec3& z,
        const glm::dvec3& color,
        double longest
    );
    static void go_straight(std::vector<Station>& stations, const glm::dvec3& to, double longest);
    [[nodiscard]] static std::vector<Station>
    stations_along(std::span<const glm::dvec3> points, const TubeOptions& options);

    std::vector<glm::vec3> positions_;
    std::vector<glm::vec3> normals_;
    std::vector<glm::u8vec4> colors_;
    std::vector<std::uint32_t> indices_;
};

} // namespace farfield::scenes
