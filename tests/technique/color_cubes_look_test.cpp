#include "support/random.hpp"
#include "technique/cube_world.hpp"
#include "technique/scenes.hpp"
#include <farfield/technique/color_cubes.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

/// One cell in a place of its own, and how it is shown.
class Cell {
  public:
    /// @param edge of the cell, small enough to be shown [m]
    Cell(
        const CubeReference& placed,
        const CubeCell& cell,
        float edge,
        const ColorCube& colors,
        const std::vector<CubeGain>& gains = {}
    )
        : model_(make_single_cells({placed}, cell, edge, colors, gains)) {}

    /// The splat of the cell.
    [[nodiscard]] Splat splat(const View& view, CubeSheets sheets = CubeSheets::opaque) const {
        const FramePlan plan = planned(view, {.sheets = sheets, .never_slower = false});
        REQUIRE(plan.splats.size() == 1);
        return plan.splats.front();
    }

    /// The same as faces.
    [[nodiscard]] ShownCube faces(const View& view, FramePlan& plan) const {
        plan = planned(view, {.drawing = CubeDrawing::faces, .never_slower = false});
        REQUIRE(plan.cubes.size() == 1);
        return plan.cubes.front();
    }

    [[nodiscard]] bool is_shown(const View& view) const {
        return !planned(view, {.never_slower = false}).splats.empty();
    }

    /// The box of the contents, in the frame of the cell. [m]
    [[nodiscard]] Box3d contents() const {
        const ColorCubeTree& tree = model_.trees.front();
        const Box3f box = contents_boxes(tree).front();
        return {box.lo, box.hi};
    }

    /// Its middle as the eye of a view has it, in the axes of the cell. [m]
    [[nodiscard]] glm::dvec3 offset(const View& view) const {
        const CubeReference& of = model_.references.front();
        const glm::dmat3 rotation(of.rotation);
        return center(contents()) * double{of.scale} +
               glm::transpose(rotation) * (glm::dvec3(of.translation) - view.eye);
    }

    /// Its size in the world, by axis of the cell. [m]
    [[nodiscard]] glm::dvec3 size() const {
        return extent(contents()) * double{model_.references.front().scale};
    }

  private:
    [[nodiscard]] FramePlan planned(const View& view, ColorCubesOptions options) const {
        options.cell_px = 4.0;
        auto technique = ColorCubes::create(hierarchy_, model_, options);
        REQUIRE(technique.has_value());
        return technique->plan(view);
    }

    ColorCubeModel model_;
    Hierarchy hierarchy_ = make_item_hierarchy(1);
};

ColorCube random_colors(Random& random) {
    ColorCube colors;
    for (glm::u8vec4& face : colors.faces) {
        face.a = static_cast<std::uint8_t>(random.below(256));
        for (int i = 0; i < 3; ++i) {
            face[i] = static_cast<std::uint8_t>(random.below(face.a + 1U));
        }
    }
    return colors;
}

CubeCell random_cell(Random& random) {
    CubeCell cell;
    for (std::uint8_t& extent : cell.extent) {
        const unsigned first = random.below(16);
        const unsigned last = first + random.below(16 - first);
        extent = static_cast<std::uint8_t>(last << 4U | first);
    }
    return cell;
}

/// Anywhere within some 30 m, turned and scaled.
CubeReference random_place(Random& random) {
    CubeReference place;
    const glm::dvec3 x = random.direction<double>();
    const glm::dvec3 y = glm::normalize(glm::cross(x, random.direction<double>()));
    place.rotation = glm::mat3(glm::dmat3(x, y, glm::cross(x, y)));
    place.scale = random.uniform(0.5F, 2.0F);
    place.translation = random.vector(-30.0F, 30.0F);
    return place;
}

/// Looks at about a place from 10 to 40 m, with pixels that are not square.
View random_view(const CubeReference& place, Random& random) {
    const glm::dvec3 target = glm::dvec3(place.translation) + random.vector(-1.0, 1.0);
    const glm::dvec3 eye = target + random.direction<double>() * random.uniform(10.0, 40.0);
    const Lens lens{-1.0, 0.5 + random.uniform(0.0, 1.0), -0.5, 0.75, 0.25, 256.0};
    return look_at(eye, target, random.direction<double>(), lens, 200, 160);
}

double cross(const glm::dvec2& a, const glm::dvec2& b) {
    return a.x * b.y - a.y * b.x;
}

/// Area of the convex hull of points. (Andrew's monotone chain.)
double hull_area(std::array<glm::dvec2, 8> points) {
    std::sort(points.begin(), points.end(), [](const glm::dvec2& a, const glm::dvec2& b) {
        return std::pair(a.x, a.y) < std::pair(b.x, b.y);
    });
    std::vector<glm::dvec2> hull;
    for (int side = 0; side < 2; ++side) {
        const std::size_t start = hull.size();
        for (const glm::dvec2& point : points) {
            while (hull.size() >= start + 2 &&
                   cross(hull.back() - hull[hull.size() - 2], point - hull.back()) <= 0.0) {
                hull.pop_back();
            }
            hull.push_back(point);
        }
        hull.pop_back();
        std::reverse(points.begin(), points.end());
    }
    double twice = 0.0;
    for (std::size_t i = 0; i < hull.size(); ++i) {
        twice += cross(hull[i] - hull[0], hull[(i + 1) % hull.size()] - hull[0]);
    }
    return twice / 2.0;
}

/// What the faces seen of a cell mix to, by the area of each on the screen. [0, 255]
glm::dvec4 mean_of_faces(const Cell& cell, const ColorCube& colors, const View& view) {
    const glm::dvec3 offset = cell.offset(view);
    const glm::dvec3 size = cell.size();
    glm::dvec4 sum(0.0);
    double areas = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double area = std::abs(offset[axis]) * size[(axis + 1) % 3] * size[(axis + 2) % 3];
        const bool from_above = offset[axis] < 0.0;
        sum += area * glm::dvec4(colors.faces[face_of(static_cast<std::size_t>(axis), from_above)]);
        areas += area;
    }
    return sum / areas;
}

double double_alpha(const Cell& cell, const ColorCube& colors, const View& view, CubeGain gain) {
    const glm::dvec3 offset = cell.offset(view);
    const glm::dvec3 size = cell.size();
    const glm::dvec3 d = offset / glm::length(offset);
    double density_sq = 0.0;
    double silhouette = 0.0;
    const double fourth = glm::dot(d * d, d * d);
    const double oblique = std::sqrt(1.5 * std::max(0.0, 1.0 - fourth));
    for (int axis = 0; axis < 3; ++axis) {
        const std::size_t face = face_of(static_cast<std::size_t>(axis), offset[axis] < 0.0);
        const double alpha = std::min(static_cast<double>(colors.faces[face].a), 254.5) / 255.0;
        const unsigned stored = gain.stored[static_cast<std::size_t>(axis)] & 0x7FU;
        const double factor = 1.0 + (std::exp2((stored - 64.0) / 16.0) - 1.0) * oblique;
        const double part = factor * std::abs(d[axis]) * -std::log1p(-alpha) / size[axis];
        density_sq += part * part;
        silhouette += std::abs(d[axis]) / size[axis];
    }
    return 1.0 - std::exp(-std::sqrt(density_sq) / silhouette);
}

} // namespace

TEST_CASE("the faces seen are those towards the eye") {
    ColorCube colors;
    for (std::size_t face = 0; face < 6; ++face) {
        colors.faces[face] = glm::u8vec4(static_cast<std::uint8_t>(40 * face + 20));
    }
    const auto rotations = axis_rotations();
    REQUIRE(rotations.size() == 24);
    for (const glm::dmat3& rotation : rotations) {
        CubeReference place;
        place.rotation = glm::mat3(rotation);
        place.translation = {3.0F, -2.0F, 1.0F};
        place.scale = 2.0F;
        const Cell cell(place, {}, 0.0625F, colors);
        for (int axis = 0; axis < 3; ++axis) {
            for (const double side : {-1.0, 1.0}) {
                // Straight on one face of the world: that is the only colour there is.
                glm::dvec3 towards(0.0);
                towards[axis] = side;
                const glm::dvec3 middle(3.0, -2.0, 1.0);
                const glm::dvec3 eye = middle + 20.0 * towards;
                const View view = look_at(eye, middle, {0.25, 1.0, 0.5}, test_lens(), 160, 120);
                // The axis of the cell that the world's axis is, and on which side of it the eye.
                const glm::dvec3 in_cell = glm::transpose(rotation) * towards;
                std::size_t seen = 0;
                for (int of_cell = 0; of_cell < 3; ++of_cell) {
                    if (in_cell[of_cell] != 0.0) {
                        seen = face_of(static_cast<std::size_t>(of_cell), in_cell[of_cell] > 0.0);
                    }
                }
                CAPTURE(axis, side, seen);
                REQUIRE(cell.splat(view).color == colors.faces[seen]);
                FramePlan plan;
                const ShownCube cube = cell.faces(view, plan);
                REQUIRE(cube.faces[seen / 2] == colors.faces[seen]);
                REQUIRE(plan.cube_frames.at(cube.frame) == place.rotation);
            }
        }
        // From a corner, all three: the ones that a cube turned the other way shows there.
        for (unsigned corner_index = 0; corner_index < 8; ++corner_index) {
            const glm::dvec3 towards(
                (corner_index & 1U) != 0 ? 1.0 : -1.5,
                (corner_index & 2U) != 0 ? 1.25 : -0.75,
                (corner_index & 4U) != 0 ? 0.5 : -2.0
            );
            const glm::dvec3 middle(3.0, -2.0, 1.0);
            const View view =
                look_at(middle + 10.0 * towards, middle, {0.0, 1.0, 0.0}, test_lens(), 160, 120);
            FramePlan plan;
            const ShownCube cube = cell.faces(view, plan);
            for (int axis = 0; axis < 3; ++axis) {
                const glm::dvec3 outward(rotation[axis]);
                const bool positive = glm::dot(outward, towards) > 0.0;
                const auto index = static_cast<std::size_t>(axis);
                REQUIRE(cube.faces[index] == colors.faces[face_of(index, positive)]);
            }
        }
    }
}

TEST_CASE("cubes are the boxes of contents, turned and scaled") {
    Random random(31);
    for (int i = 0; i < 500; ++i) {
        CAPTURE(i);
        const CubeReference place = random_place(random);
        const Cell cell(place, random_cell(random), 0.0625F, random_colors(random));
        const View view = random_view(place, random);
        FramePlan plan;
        const ShownCube cube = cell.faces(view, plan);
        REQUIRE(plan.cube_frames.at(cube.frame) == place.rotation);
        const glm::dvec3 middle =
            glm::dvec3(place.translation) +
            glm::dmat3(place.rotation) * (center(cell.contents()) * double{place.scale});
        // Sums of floats below 64 m, of ulps of 2^-18 m.
        REQUIRE(glm::distance(glm::dvec3(cube.center), middle) < 16.0 / (1U << 18U));
        // Extents are sixteenths of a power of two, and exact.
        REQUIRE(glm::distance(glm::dvec3(cube.size), cell.size()) < 1e-7);
    }
}

TEST_CASE("without gains a splat mixes the faces by their area") {
    Random random(32);
    for (int i = 0; i < 3000; ++i) {
        const CubeReference place = random_place(random);
        const ColorCube colors = random_colors(random);
        const Cell cell(place, random_cell(random), 0.0625F, colors);
        const View view = random_view(place, random);
        const glm::dvec4 expected = mean_of_faces(cell, colors, view);
        CAPTURE(i, expected.x, expected.y, expected.z, expected.w);
        if (expected.w < 1.5) {
            continue; // may be dropped
        }
        const Splat splat = cell.splat(view);
        for (int k = 0; k < 4; ++k) {
            // Weights are rounded to 1/256, which leaves no more than 1, and so is what they mix
            // to. The rest is for weights in float near a half.
            REQUIRE(std::abs(splat.color[k] - expected[k]) <= 1.5 + 1e-3);
            REQUIRE(splat.color[k] <= splat.color.a);
        }
    }
}

TEST_CASE("what is transparent all over is not shown") {
    CubeReference place;
    place.translation = {0.0F, 0.0F, -20.0F};
    const View view = look_at({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, test_lens(), 160, 120);
    ColorCube colors;
    CHECK_FALSE(Cell(place, {}, 0.0625F, colors).is_shown(view));
    CHECK_FALSE(Cell(place, {}, 0.0625F, colors, {{{127, 127, 127}}}).is_shown(view));
    CHECK_FALSE(Cell(place, {}, 0.0625F, colors, {{{0xFF, 127, 127}}}).is_shown(view));
    // One face alone, seen and not.
    colors.faces[face_of(2, true)] = glm::u8vec4(255);
    CHECK(Cell(place, {}, 0.0625F, colors).is_shown(view));
    CHECK(Cell(place, {}, 0.0625F, colors, {{{127, 127, 127}}}).is_shown(view));
    std::swap(colors.faces[face_of(2, true)], colors.faces[face_of(2, false)]);
    CHECK_FALSE(Cell(place, {}, 0.0625F, colors).is_shown(view));
}

TEST_CASE("with gains alpha is that of an oblique view") {
    Random random(33);
    std::size_t shown = 0;
    for (int i = 0; i < 3000; ++i) {
        const CubeReference place = random_place(random);
        const ColorCube colors = random_colors(random);
        CubeGain gain;
        for (std::uint8_t& stored : gain.stored) {
            stored = static_cast<std::uint8_t>(random.below(128));
        }
        const Cell cell(place, random_cell(random), 0.0625F, colors, {gain});
        const View view = random_view(place, random);
        const double alpha = 255.0 * double_alpha(cell, colors, view, gain);
        const glm::dvec4 mean = mean_of_faces(cell, colors, view);
        if (alpha < 1.0 || mean.w < 2.0) {
            continue; // may be dropped
        }
        ++shown;
        const Splat splat = cell.splat(view);
        CAPTURE(i, alpha);
        // To the nearest of 8 bits, after 8 more were cut off; 0.002 for float, in which depths of
        // up to 6.3 and their exponentials have relative errors of some 1e-6.
        REQUIRE(std::abs(splat.color.a - alpha) <= 0.5 + 1.0 / 256.0 + 0.002);
        // Colour and alpha of the mean are each off by 1 at most before they are divided.
        const double tolerance = 0.51 + 2.0 * alpha / (mean.w - 1.0);
        for (int k = 0; k < 3; ++k) {
            REQUIRE(std::abs(splat.color[k] - mean[k] * alpha / mean.w) <= tolerance);
            REQUIRE(splat.color[k] <= splat.color.a);
        }
    }
    CHECK(shown > 2000);
}

TEST_CASE("a splat is as large as its box") {
    Random random(34);
    for (int i = 0; i < 3000; ++i) {
        const CubeReference place = random_place(random);
        ColorCube colors;
        colors.faces.fill(glm::u8vec4(255));
        const Cell cell(place, random_cell(random), 0.0625F, colors);
        const View view = random_view(place, random);
        const Splat splat = cell.splat(view);
        const glm::dvec3 offset = cell.offset(view);
        const glm::dvec3 size = cell.size();
        const glm::dmat3 to_world(place.rotation);
        const double depth = -glm::dot(view.camera_to_world[2], to_world * offset);
        std::array<glm::dvec2, 8> corners{};
        double radius = glm::length(size) / 2.0;
        for (unsigned k = 0; k < 8; ++k) {
            const glm::dvec3 side =
                glm::dvec3(k & 1U, k >> 1U & 1U, k >> 2U) * 2.0 - glm::dvec3(1.0);
            const glm::dvec3 at =
                glm::transpose(view.camera_to_world) * (to_world * (offset + side * size * 0.5));
            corners[k] = glm::dvec2(at) / -at.z;
        }
        // At the distance 1. A face at the distance h from the eye, measured along its normal,
        // covers h times the integral of 1 / z^3 over it; its z is within R of that of the middle.
        // The splat takes the middle's: its h is half an extent larger, together 3/2 V.
        const double exact = hull_area(corners);
        const double shown = double{splat.side} * splat.side / (depth * depth);
        double sum = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
            sum += std::abs(offset[axis]) * size[(axis + 1) % 3] * size[(axis + 2) % 3];
        }
        const double volume = size.x * size.y * size.z;
        const double most = std::pow(1.0 - radius / depth, -3.0);
        const double least = (1.0 - 1.5 * volume / sum) * std::pow(1.0 + radius / depth, -3.0);
        CAPTURE(i, exact, shown, most, least);
        constexpr double kRounding = 1e-5; // of offsets in float, relative to 10 m and more
        REQUIRE(exact <= shown * most * (1.0 + kRounding));
        REQUIRE(exact >= shown * least * (1.0 - kRounding));
        // Which is some percent: the boxes are smaller than 4 pixels.
        REQUIRE(most < 1.05);
        REQUIRE(least > 0.94);
        // What the splat takes is this sum, to the rounding of floats.
        REQUIRE(shown == Approx(sum / std::pow(depth, 3.0)).epsilon(1e-4));
    }
}

TEST_CASE("sheets are opaque, and smaller where they are not closed") {
    Random random(35);
    std::size_t compared = 0;
    for (int i = 0; i < 2000; ++i) {
        const CubeReference place = random_place(random);
        const ColorCube colors = random_colors(random);
        const auto value = static_cast<std::uint8_t>(random.below(128));
        const CubeCell contents = random_cell(random);
        const Cell sheet(
            place, contents, 0.0625F, colors, {{static_cast<std::uint8_t>(value | 128)}}
        );
        const Cell other(place, contents, 0.0625F, colors, {{value}});
        const View view = random_view(place, random);
        const double alpha = double_alpha(sheet, colors, view, {value});
        const glm::dvec4 mean = mean_of_faces(sheet, colors, view);
        if (alpha * 255.0 < 1.0 || mean.w < 2.0) {
            continue; // may be dropped where they are blended
        }
        ++compared;
        CAPTURE(i, alpha);
        const Splat blended = sheet.splat(view, CubeSheets::blended);
        const Splat opaque = sheet.splat(view);
        REQUIRE(opaque.color.a == 255);
        for (int k = 0; k < 3; ++k) {
            const double tolerance = 0.51 + 2.0 * 255.0 / (mean.w - 1.0);
            REQUIRE(std::abs(opaque.color[k] - mean[k] * 255.0 / mean.w) <= tolerance);
        }
        REQUIRE(opaque.center == blended.center);
        const double part =
            double{opaque.side} * opaque.side / (double{blended.side} * blended.side);
        // Small alphas are differences of 1 and an exponential in float.
        REQUIRE(part == Approx(std::pow(alpha, 0.25)).epsilon(1e-5 + 1e-6 / alpha));
        // What is no sheet is shown the same way whatever sheets are, and as a sheet is blended.
        for (const CubeSheets sheets : {CubeSheets::opaque, CubeSheets::blended}) {
            const Splat same = other.splat(view, sheets);
            REQUIRE(same.color == blended.color);
            REQUIRE(same.side == blended.side);
        }
    }
    CHECK(compared > 1000);
}
