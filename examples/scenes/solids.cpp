#include "solids.hpp"

#include "facets.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

namespace farfield::scenes {

namespace {

using glm::dvec2;
using glm::dvec3;

/// [m] What is shorter is not there.
constexpr double kNoLength = 1e-9;

/// Any unit vector at a right angle to a unit vector, level where that leaves a choice.
dvec3 perpendicular(const dvec3& axis) {
    const dvec3 other = std::abs(axis.y) < 0.9 ? dvec3(0.0, 1.0, 0.0) : dvec3(0.0, 0.0, 1.0);
    return glm::normalize(glm::cross(other, axis));
}

/// Points of the unit circle; of a number that 4 divides, exactly the same after a quarter turn.
std::vector<dvec2> circle_of(int sides) {
    std::vector<dvec2> circle;
    circle.reserve(static_cast<std::size_t>(sides));
    const bool even = sides % 4 == 0;
    for (int i = 0; i < sides; ++i) {
        const int in_quarter = even ? i % (sides / 4) : i;
        const double angle = 2.0 * std::numbers::pi * in_quarter / sides;
        dvec2 point(std::cos(angle), std::sin(angle));
        for (int turn = 0; even && turn < i / (sides / 4); ++turn) {
            point = dvec2(0.0 - point.y, point.x);
        }
        circle.push_back(point);
    }
    return circle;
}

/// Turns a vector around a unit axis.
dvec3 turned(const dvec3& vector, const dvec3& axis, double angle) {
    const double cosine = std::cos(angle);
    return vector * cosine + glm::cross(axis, vector) * std::sin(angle) +
           axis * (glm::dot(axis, vector) * (1.0 - cosine));
}

int steps_of(double length, double longest) {
    return std::max(static_cast<int>(std::ceil(length / longest - 1e-9)), 1);
}

} // namespace

std::uint32_t Solids::add_vertex(const dvec3& at, const dvec3& normal, const dvec3& color) {
    positions_.emplace_back(at);
    normals_.emplace_back(normal);
    colors_.push_back(to_color(color));
    return static_cast<std::uint32_t>(positions_.size() - 1);
}

std::uint32_t Solids::add_circle(
    const Station& station,
    double radius,
    const dvec2& normal,
    std::span<const dvec2> circle,
    const dvec3& color
) {
    const dvec3 along = glm::cross(station.u, station.v) * normal.y;
    const auto first = static_cast<std::uint32_t>(positions_.size());
    for (const dvec2& point : circle) {
        const dvec3 outwards = station.u * point.x + station.v * point.y;
        add_vertex(station.at + outwards * radius, outwards * normal.x + along, color);
    }
    return first;
}

void Solids::join(std::uint32_t first, std::uint32_t second, std::uint32_t sides) {
    for (std::uint32_t i = 0; i < sides; ++i) {
        const std::uint32_t next = (i + 1) % sides;
        indices_.insert(indices_.end(), {first + i, first + next, second + next});
        indices_.insert(indices_.end(), {first + i, second + next, second + i});
    }
}

void Solids::add_end(
    const Station& station,
    double radius,
    double direction,
    std::span<const dvec2> circle,
    const dvec3& color
) {
    const std::uint32_t first = add_circle(station, radius, {0.0, direction}, circle, color);
    for (std::uint32_t i = 2; i < circle.size(); ++i) {
        if (direction > 0.0) {
            indices_.insert(indices_.end(), {first, first + i - 1, first + i});
        } else {
            indices_.insert(indices_.end(), {first, first + i, first + i - 1});
        }
    }
}

void Solids::add_sheet(
    const dvec3& corner, const dvec3& along, const dvec3& across, const dvec3& color, double longest
) {
    const int columns = steps_of(glm::length(along), longest);
    const int rows = steps_of(glm::length(across), longest);
    const dvec3 normal = glm::normalize(glm::cross(along, across));
    const auto first = static_cast<std::uint32_t>(positions_.size());
    for (int row = 0; row <= rows; ++row) {
        for (int column = 0; column <= columns; ++column) {
            const dvec3 at = corner + along * (static_cast<double>(column) / columns) +
                             across * (static_cast<double>(row) / rows);
            add_vertex(at, normal, color);
        }
    }
    const auto stride = static_cast<std::uint32_t>(columns) + 1;
    for (std::uint32_t row = 0; row < static_cast<std::uint32_t>(rows); ++row) {
        for (std::uint32_t column = 0; column + 1 < stride; ++column) {
            const std::uint32_t here = first + row * stride + column;
            const std::uint32_t above = here + stride;
            indices_.insert(indices_.end(), {here, here + 1, above + 1});
            indices_.insert(indices_.end(), {here, above + 1, above});
        }
    }
}

void Solids::add_block(
    const dvec3& corner,
    const dvec3& x,
    const dvec3& y,
    const dvec3& z,
    const dvec3& color,
    double longest
) {
    add_sheet(corner, y, x, color, longest);
    add_sheet(corner + z, x, y, color, longest);
    add_sheet(corner, z, y, color, longest);
    add_sheet(corner + x, y, z, color, longest);
    add_sheet(corner, x, z, color, longest);
    add_sheet(corner + y, z, x, color, longest);
}

void Solids::add_box(const dvec3& lo, const dvec3& hi, const dvec3& color, double longest) {
    const dvec3 size = hi - lo;
    add_block(lo, {size.x, 0.0, 0.0}, {0.0, size.y, 0.0}, {0.0, 0.0, size.z}, color, longest);
}

void Solids::add_bar(
    const dvec3& from,
    const dvec3& to,
    double width,
    double height,
    const dvec3& color,
    double longest
) {
    const dvec3 along = to - from;
    const dvec3 side = perpendicular(glm::normalize(along));
    const dvec3 up = glm::normalize(glm::cross(along, side));
    const dvec3 corner = from - side * (width / 2.0) - up * (height / 2.0);
    add_block(corner, side * width, up * height, along, color, longest);
}

void Solids::add_girder(
    const dvec3& from,
    const dvec3& to,
    double width,
    double height,
    const dvec3& color,
    double longest
) {
    const dvec3 along = to - from;
    const dvec3 side = perpendicular(glm::normalize(along));
    const dvec3 up = glm::normalize(glm::cross(along, side));
    // The outline of the section, anticlockwise around the way along; thickness of the plates.
    const double plate = 0.09 * std::min(width, height);
    const double w = width / 2.0;
    const double h = height / 2.0;
    const double web = plate / 2.0;
    const double lip = h - plate;
    const std::array<dvec2, 12> outline = {
        {{-w, -h},
         {w, -h},
         {w, -lip},
         {web, -lip},
         {web, lip},
         {w, lip},
         {w, h},
         {-w, h},
         {-w, lip},
         {-web, lip},
         {-web, -lip},
         {-w, -lip}}};
    const auto corner = [&](std::size_t i) {
        const dvec2& point = outline[i % outline.size()];
        return from + side * point.x + up * point.y;
    };
    for (std::size_t i = 0; i < outline.size(); ++i) {
        add_sheet(corner(i), corner(i + 1) - corner(i), along, color, longest);
    }
    // Both ends as the two flanges and the web between them.
    for (const auto& [first, third] :
         {std::pair<std::size_t, std::size_t>{0, 2}, {10, 4}, {8, 6}}) {
        const dvec3 across = side * (outline[third].x - outline[first].x);
        const dvec3 upwards = up * (outline[third].y - outline[first].y);
        add_sheet(corner(first), upwards, across, color);
        add_sheet(corner(first) + along, across, upwards, color);
    }
}

void Solids::add_lathe(
    const dvec3& base,
    const dvec3& axis,
    std::span<const dvec2> profile,
    int sides,
    const dvec3& color
) {
    // Of the angle up to which two pieces of the profile are one smooth surface.
    const double smooth_cosine = std::cos(35.0 * std::numbers::pi / 180.0);
    const std::vector<dvec2> circle = circle_of(sides);
    const dvec3 u = perpendicular(axis);
    const dvec3 v = glm::cross(axis, u);
    const auto normal_of = [&](std::size_t piece) {
        const dvec2 way = profile[piece + 1] - profile[piece];
        return glm::normalize(dvec2(way.y, -way.x));
    };
    const auto blend = [&](const dvec2& own, const dvec2& other) {
        return glm::dot(own, other) < smooth_cosine ? own : glm::normalize(own + other);
    };
    const auto count = static_cast<std::uint32_t>(sides);
    for (std::size_t piece = 0; piece + 1 < profile.size(); ++piece) {
        const dvec2 own = normal_of(piece);
        const std::array<dvec2, 2> normals = {
            piece > 0 ? blend(own, normal_of(piece - 1)) : own,
            piece + 2 < profile.size() ? blend(own, normal_of(piece + 1)) : own};
        std::array<std::uint32_t, 2> first{};
        for (std::size_t end = 0; end < 2; ++end) {
            const dvec2& point = profile[piece + end];
            dvec2 normal = normals[end];
            if (point.x == 0.0 && std::abs(normal.y) > 0.7) {
                normal = dvec2(0.0, normal.y > 0.0 ? 1.0 : -1.0); // the top of a dome
            }
            first[end] = add_circle({base + axis * point.y, u, v}, point.x, normal, circle, color);
        }
        for (std::uint32_t i = 0; i < count; ++i) {
            const std::uint32_t next = (i + 1) % count;
            if (profile[piece].x > 0.0) {
                indices_.insert(indices_.end(), {first[0] + i, first[0] + next, first[1] + next});
            }
            if (profile[piece + 1].x > 0.0) {
                indices_.insert(indices_.end(), {first[0] + i, first[1] + next, first[1] + i});
            }
        }
    }
}

void Solids::add_cylinder(
    const dvec3& base,
    const dvec3& axis,
    double radius,
    double length,
    int sides,
    const dvec3& color
) {
    const std::vector<dvec2> circle = circle_of(sides);
    const dvec3 u = perpendicular(axis);
    const dvec3 v = glm::cross(axis, u);
    const Station bottom{base, u, v};
    const Station top{base + axis * length, u, v};
    const std::uint32_t first = add_circle(bottom, radius, {1.0, 0.0}, circle, color);
    const std::uint32_t second = add_circle(top, radius, {1.0, 0.0}, circle, color);
    join(first, second, static_cast<std::uint32_t>(sides));
    add_end(bottom, radius, -1.0, circle, color);
    add_end(top, radius, 1.0, circle, color);
}

void Solids::go_straight(std::vector<Station>& stations, const dvec3& to, double longest) {
    const Station from = stations.back();
    const double length = glm::distance(from.at, to);
    if (length < kNoLength) {
        return;
    }
    const int steps = steps_of(length, longest);
    for (int step = 1; step <= steps; ++step) {
        const double share = static_cast<double>(step) / steps;
        stations.push_back({from.at + (to - from.at) * share, from.u, from.v});
    }
}

std::vector<Solids::Station>
Solids::stations_along(std::span<const dvec3> points, const TubeOptions& options) {
    dvec3 ahead = glm::normalize(points[1] - points[0]);
    const dvec3 side = perpendicular(ahead);
    std::vector<Station> stations = {{points[0], side, glm::cross(ahead, side)}};
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {
        const dvec3 next = glm::normalize(points[i + 1] - points[i]);
        const dvec3 across = glm::cross(ahead, next);
        const double sine = glm::length(across);
        if (sine < kNoLength) {
            continue; // straight on
        }
        const dvec3 axis = across / sine;
        const double angle = std::atan2(sine, glm::dot(ahead, next));
        go_straight(
            stations, points[i] - ahead * (options.bend * std::tan(angle / 2.0)), options.longest
        );
        const Station before = stations.back();
        const dvec3 inwards = glm::cross(axis, ahead) * options.bend;
        const dvec3 center = before.at + inwards;
        const int steps =
            steps_of(angle, std::numbers::pi / 2.0 / static_cast<double>(options.arc_segments));
        for (int step = 1; step <= steps; ++step) {
            const double turn = angle * step / steps;
            stations.push_back(
                {center - turned(inwards, axis, turn),
                 turned(before.u, axis, turn),
                 turned(before.v, axis, turn)}
            );
        }
        ahead = next;
    }
    go_straight(stations, points.back(), options.longest);
    return stations;
}

void Solids::add_tube(
    std::span<const dvec3> points, const TubeOptions& options, const dvec3& color
) {
    const std::vector<Station> stations = stations_along(points, options);
    const std::vector<dvec2> circle = circle_of(options.sides);
    std::uint32_t before = 0;
    for (std::size_t i = 0; i < stations.size(); ++i) {
        const std::uint32_t here =
            add_circle(stations[i], options.radius, {1.0, 0.0}, circle, color);
        if (i > 0) {
            join(before, here, static_cast<std::uint32_t>(options.sides));
        }
        before = here;
    }
    if (options.capped) {
        add_end(stations.front(), options.radius, -1.0, circle, color);
        add_end(stations.back(), options.radius, 1.0, circle, color);
    }
}

void Solids::add_ring(
    const dvec3& middle,
    const dvec3& axis,
    double ring_radius,
    double tube_radius,
    int around,
    int sides,
    const dvec3& color
) {
    const std::vector<dvec2> ring = circle_of(around);
    const std::vector<dvec2> circle = circle_of(sides);
    const dvec3 u = perpendicular(axis);
    const dvec3 v = glm::cross(axis, u);
    std::vector<std::uint32_t> firsts;
    for (const dvec2& point : ring) {
        const dvec3 outwards = u * point.x + v * point.y;
        // Outwards x -axis is the way around.
        firsts.push_back(add_circle(
            {middle + outwards * ring_radius, outwards, -axis},
            tube_radius,
            {1.0, 0.0},
            circle,
            color
        ));
    }
    for (std::size_t i = 0; i < firsts.size(); ++i) {
        join(firsts[i], firsts[(i + 1) % firsts.size()], static_cast<std::uint32_t>(sides));
    }
}

Mesh Solids::finish(std::string name, bool splittable) {
    Mesh mesh;
    mesh.name = std::move(name);
    mesh.positions = std::exchange(positions_, {});
    mesh.normals = std::exchange(normals_, {});
    mesh.colors = std::exchange(colors_, {});
    mesh.indices = std::exchange(indices_, {});
    mesh.parts.push_back({0, static_cast<std::uint32_t>(mesh.indices.size()), kNone<MaterialId>});
    mesh.splittable = splittable;
    update_bounds(mesh);
    return mesh;
}

} // namespace farfield::scenes
