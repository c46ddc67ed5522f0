#include "canvas.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/eval/overlay.hpp>

#include <glm/common.hpp>
#include <glm/ext/matrix_double3x3.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace farfield::eval {

namespace {

using detail::Canvas;
using glm::dvec2;
using glm::dvec3;

constexpr double kMargin = 0.04;
constexpr double kTint = 0.22; // opacity of the inside of a box
constexpr double kFrustumTint = 0.10;
constexpr double kCasing = 2.0; // width of the dark line under a light one, in widths of that

Picture blank_picture(int width, int height, const glm::u8vec3& color) {
    Picture picture{width, height, {}};
    const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    picture.rgba.reserve(pixels * 4);
    for (std::size_t i = 0; i < pixels; ++i) {
        picture.rgba.insert(picture.rgba.end(), {color.r, color.g, color.b, 255});
    }
    return picture;
}

Box3f box_of(const HierarchyNode& node, bool with_surfaces) noexcept {
    return with_surfaces ? bounds(node) : node.items_box;
}

/// Convex hull, anticlockwise where y is up, without points in the middle of a side.
/// Source: Andrew, Another efficient algorithm for convex hulls in two dimensions, 1979.
std::vector<dvec2> convex_hull(std::vector<dvec2> points) {
    const auto before = [](const dvec2& a, const dvec2& b) {
        return a.x < b.x || (a.x == b.x && a.y < b.y);
    };
    std::sort(points.begin(), points.end(), before);
    points.erase(std::unique(points.begin(), points.end()), points.end());
    if (points.size() < 3) {
        return points;
    }
    std::vector<dvec2> hull;
    const auto add_chain = [&](auto begin, auto end) {
        const std::size_t start = hull.size();
        for (auto it = begin; it != end; ++it) {
            while (hull.size() >= start + 2) {
                const dvec2 a = hull[hull.size() - 1] - hull[hull.size() - 2];
                const dvec2 b = *it - hull.back();
                if (a.x * b.y - a.y * b.x > 0.0) {
                    break;
                }
                hull.pop_back();
            }
            hull.push_back(*it);
        }
        hull.pop_back(); // the other chain begins with it
    };
    add_chain(points.begin(), points.end());
    add_chain(points.rbegin(), points.rend());
    return hull;
}

/// From metres relative to the hierarchy's origin to pixels of the map.
class Map {
  public:
    Map(const dvec3& up, const Box3d& shown, const dvec2& size_px) {
        const dvec3 normal = glm::normalize(up);
        const dvec3 other = std::abs(normal.x) < 0.9 ? dvec3(1.0, 0.0, 0.0) : dvec3(0.0, 0.0, 1.0);
        right_ = glm::normalize(other - normal * glm::dot(normal, other));
        down_ = glm::cross(right_, normal);
        dvec2 lo(0.0);
        dvec2 hi(0.0);
        for (unsigned index = 0; index < 8; ++index) {
            const dvec2 point = flat(corner(shown, index));
            lo = index == 0 ? point : glm::min(lo, point);
            hi = index == 0 ? point : glm::max(hi, point);
        }
        // Where everything is in one place a metre is as good as any length.
        const dvec2 extent = hi - lo;
        const double least = std::max(extent.x, extent.y) > 0.0 ? 0.0 : 1.0;
        const dvec2 inner = size_px * (1.0 - 2.0 * kMargin);
        pixels_per_metre_ =
            std::min(inner.x / std::max(extent.x, least), inner.y / std::max(extent.y, least));
        offset_ = size_px / 2.0 - (lo + hi) / 2.0 * pixels_per_metre_;
    }

    [[nodiscard]] dvec2 operator()(const dvec3& point) const noexcept {
        return flat(point) * pixels_per_metre_ + offset_;
    }
    [[nodiscard]] double pixels_per_metre() const noexcept { return pixels_per_metre_; }

  private:
    [[nodiscard]] dvec2 flat(const dvec3& point) const noexcept {
        return {glm::dot(point, right_), glm::dot(point, down_)};
    }

    dvec3 right_{0.0};
    dvec3 down_{0.0};
    double pixels_per_metre_ = 1.0;
    dvec2 offset_{0.0};
};

/// Outline of a box on the map, on whole pixels, and so far inwards that a line along it stays in.
std::vector<dvec2> outline_of(const Box3f& box, const Map& map, double line_px) {
    std::vector<dvec2> points;
    for (unsigned index = 0; index < 8; ++index) {
        points.push_back(glm::round(map(dvec3(corner(box, index)))));
    }
    points = convex_hull(std::move(points));
    dvec2 lo = points.front();
    dvec2 hi = points.front();
    for (const dvec2& point : points) {
        lo = glm::min(lo, point);
        hi = glm::max(hi, point);
    }
    const dvec2 middle = (lo + hi) / 2.0;
    for (dvec2& point : points) {
        const dvec2 inwards = middle - point;
        point += glm::sign(inwards) * glm::min(glm::abs(inwards), dvec2(line_px / 2.0));
    }
    return points;
}

/// Corners of the view's window at a distance along the view direction. [m] relative to the eye
std::array<dvec3, 4> window_corners(const View& view, double distance) noexcept {
    const Lens& lens = view.lens;
    const std::array<dvec2, 4> tangents = {
        {{lens.left, lens.bottom},
         {lens.right, lens.bottom},
         {lens.right, lens.top},
         {lens.left, lens.top}}};
    std::array<dvec3, 4> corners{};
    for (std::size_t i = 0; i < corners.size(); ++i) {
        corners[i] = view.camera_to_world * (dvec3(tangents[i], -1.0) * distance);
    }
    return corners;
}

/// How a status is drawn.
struct StatusStyle {
    NodeStatus status = NodeStatus::untouched;
    const char* name = "";
    glm::u8vec3 color{0};
    double line_px = 1.0;
    double tint = 0.0; ///< opacity of the inside of a box
};

/// In the order in which they are drawn. Nodes left to their children lie under those, so they are
/// not tinted.
std::array<StatusStyle, 4> status_styles(const BirdsEyeOptions& options) noexcept {
    const OverlayColors& colors = options.colors;
    const double line_px = options.line_px;
    return {
        {{NodeStatus::recursed, "recursed", colors.recursed, line_px / 2.0, 0.0},
         {NodeStatus::culled, "culled", colors.culled, line_px, kTint},
         {NodeStatus::geometry, "geometry", colors.geometry, line_px, kTint},
         {NodeStatus::image, "image", colors.image, line_px, kTint}}};
}

enum class Sample : std::uint8_t { box, line, path, eye, scale_bar };

/// One thing that the legend explains, and where.
struct LegendEntry {
    Sample sample = Sample::box;
    std::string label;
    glm::u8vec3 color{0};
    double line_px = 1.0;
    double tint = 0.0;
    dvec2 at{0.0}; ///< [px] upper left corner, from that of the legend
};

/// Measures of the legend, in proportion to its font.
struct LegendLayout {
    int scale = 1;
    int sample_px = 0;
    int bar_px = 0; ///< longest scale bar
    int gap_px = 0;
    int row_px = 0;

    LegendLayout(int width, int height) {
        constexpr int kPixelsPerScale = 400;
        scale = std::max(std::min(width, height) / kPixelsPerScale, 1);
        sample_px = 9 * scale;
        bar_px = 60 * scale;
        gap_px = 5 * scale;
        row_px = Canvas::text_height(scale) + gap_px;
    }
};

/// Gives every entry its place, in rows. @return height of the legend [px]
int place(std::span<LegendEntry> entries, const LegendLayout& layout, int width) noexcept {
    const int left = 2 * layout.gap_px;
    int x = left;
    int y = layout.gap_px;
    for (LegendEntry& entry : entries) {
        const int sample = entry.sample == Sample::scale_bar ? layout.bar_px : layout.sample_px;
        const int needed = sample + layout.gap_px + Canvas::text_width(entry.label, layout.scale);
        if (x + needed > width && x > left) {
            x = left;
            y += layout.row_px;
        }
        entry.at = dvec2(x, y);
        x += needed + 2 * layout.gap_px;
    }
    return y + layout.row_px;
}

/// The largest of 1, 2, 5, 10, ... that is not more.
double round_length(double most) noexcept {
    const double power = std::pow(10.0, std::floor(std::log10(most)));
    for (const double factor : {5.0, 2.0}) {
        if (factor * power <= most) {
            return factor * power;
        }
    }
    return power;
}

std::string length_text(double metres) {
    constexpr double kKilometre = 1000.0;
    std::array<char, 32> text{};
    const bool long_way = metres >= kKilometre;
    std::snprintf(
        text.data(),
        text.size(),
        "%g %s",
        long_way ? metres / kKilometre : metres,
        long_way ? "km" : "m"
    );
    return text.data();
}

void draw_eye(
    Canvas& canvas, const dvec2& at, double size_px, const OverlayColors& colors
) noexcept {
    canvas.line(at, at, size_px, colors.text);
    canvas.line(at, at, size_px * 0.6, colors.frustum);
}

/// A light line on a dark one, to be seen on any ground.
void draw_path(
    Canvas& canvas, std::span<const dvec2> points, double line_px, const OverlayColors& colors
) noexcept {
    for (std::size_t i = 1; i < points.size(); ++i) {
        canvas.line(points[i - 1], points[i], kCasing * line_px, colors.text);
    }
    for (std::size_t i = 1; i < points.size(); ++i) {
        canvas.line(points[i - 1], points[i], line_px, colors.path);
    }
}

/// A line with ticks at both ends, of a round length. @return its right end [px]
double draw_scale_bar(
    Canvas& canvas,
    const dvec2& begin,
    double length_px,
    const LegendLayout& layout,
    const glm::u8vec3& color
) noexcept {
    const dvec2 end = begin + dvec2(std::round(length_px), 0.0);
    const dvec2 tick(0.0, 2.5 * layout.scale);
    canvas.line(begin, end, layout.scale, color);
    canvas.line(begin - tick, begin + tick, layout.scale, color);
    canvas.line(end - tick, end + tick, layout.scale, color);
    return end.x;
}

/// @param top [px] where the legend begins
void draw_legend(
    Canvas& canvas,
    std::span<const LegendEntry> entries,
    const LegendLayout& layout,
    const OverlayColors& colors,
    double top,
    double pixels_per_metre
) {
    constexpr double kMiddleOfCapitals = 3.5;
    const double size = layout.sample_px;
    for (const LegendEntry& entry : entries) {
        const dvec2 at = entry.at + dvec2(0.0, top);
        const dvec2 left(at.x, at.y + kMiddleOfCapitals * layout.scale);
        const dvec2 right = left + dvec2(size, 0.0);
        std::string label = entry.label;
        double end = right.x;
        switch (entry.sample) {
        case Sample::box: {
            const double half = entry.line_px / 2.0;
            const dvec2 lo(left.x + half, std::round(left.y - size / 2.0) + half);
            const dvec2 hi = lo + (size - entry.line_px);
            const std::array<dvec2, 4> square = {lo, dvec2(hi.x, lo.y), hi, dvec2(lo.x, hi.y)};
            canvas.fill(square, entry.color, entry.tint);
            canvas.outline(square, entry.line_px, entry.color);
            break;
        }
        case Sample::line:
            canvas.line(left, right, entry.line_px, entry.color);
            break;
        case Sample::path:
            draw_path(canvas, std::array{left, right}, entry.line_px, colors);
            break;
        case Sample::eye:
            draw_eye(canvas, (left + right) / 2.0, size, colors);
            break;
        case Sample::scale_bar: {
            const double metres = round_length(layout.bar_px / pixels_per_metre);
            end = draw_scale_bar(canvas, left, metres * pixels_per_metre, layout, entry.color);
            label = length_text(metres);
            break;
        }
        }
        canvas.text({end + layout.gap_px, at.y}, label, layout.scale, colors.text);
    }
}

/// The quads of the images that a plan shows in the frame, as outlines.
void draw_quads(
    Canvas& canvas,
    const Map& map,
    const FramePlan& plan,
    const dvec3& origin,
    const BirdsEyeOptions& options
) {
    if (plan.passes.empty()) {
        return;
    }
    const Pass& frame = plan.passes.back();
    for (std::uint32_t i = 0; i < frame.command_count; ++i) {
        const Command& command = plan.commands[frame.first_command + i];
        if (command.kind != Command::Kind::images) {
            continue;
        }
        for (std::uint32_t k = 0; k < command.count; ++k) {
            const ImageQuad& quad = plan.quads[command.first + k];
            const dvec3 lower_left = plan.origin - origin + dvec3(quad.origin);
            const dvec3 u(quad.edge_u);
            const dvec3 v(quad.edge_v);
            canvas.outline(
                convex_hull(
                    {map(lower_left),
                     map(lower_left + u),
                     map(lower_left + v),
                     map(lower_left + u + v)}
                ),
                options.line_px,
                options.colors.quad
            );
        }
    }
}

/// The twelve edges of a box, as pairs of corners.
constexpr std::array<std::pair<unsigned, unsigned>, 12> kEdges = {
    {{0, 1},
     {2, 3},
     {4, 5},
     {6, 7},
     {0, 2},
     {1, 3},
     {4, 6},
     {5, 7},
     {0, 4},
     {1, 5},
     {2, 6},
     {3, 7}}};

/// Draws the edges of boxes over a picture of a view.
class BoxPainter {
  public:
    BoxPainter(Picture& frame, const View& view, const dvec3& origin)
        : canvas_(frame), world_to_camera_(glm::transpose(view.camera_to_world)),
          eye_(view.eye - origin), lens_(view.lens), size_px_(frame.width, frame.height) {}

    void draw(const Box3f& box, double line_px, const glm::u8vec3& color) {
        std::array<dvec3, 8> corners{};
        for (unsigned index = 0; index < 8; ++index) {
            corners[index] = world_to_camera_ * (dvec3(corner(box, index)) - eye_);
        }
        for (const auto& [first, second] : kEdges) {
            dvec3 a = corners[first];
            dvec3 b = corners[second];
            if (-a.z < lens_.near_distance) {
                std::swap(a, b);
            }
            if (-a.z < lens_.near_distance) {
                continue; // both ends are behind the near plane
            }
            if (-b.z < lens_.near_distance) {
                b = glm::mix(a, b, (-a.z - lens_.near_distance) / (b.z - a.z));
                b.z = -lens_.near_distance;
            }
            canvas_.line(project(a), project(b), line_px, color);
        }
    }

    [[nodiscard]] double distance_to(const Box3f& box) const noexcept {
        return distance(Box3d{dvec3(box.lo), dvec3(box.hi)}, eye_);
    }

  private:
    [[nodiscard]] dvec2 project(const dvec3& camera) const noexcept {
        const dvec2 tangent = dvec2(camera) / -camera.z;
        return size_px_ * dvec2(
                              (tangent.x - lens_.left) / (lens_.right - lens_.left),
                              (lens_.top - tangent.y) / (lens_.top - lens_.bottom)
                          );
    }

    Canvas canvas_;
    glm::dmat3 world_to_camera_;
    dvec3 eye_;
    Lens lens_;
    dvec2 size_px_;
};

} // namespace

Picture birds_eye(
    const Hierarchy& hierarchy,
    std::span<const NodeStatus> statuses,
    const View& view,
    const BirdsEyeOptions& options
) {
    FARFIELD_ASSERT(options.width >= 1 && options.height >= 1);
    const OverlayColors& colors = options.colors;
    const double line_px = options.line_px;
    const std::array<StatusStyle, 4> styles = status_styles(options);
    std::array<std::vector<Box3f>, 4> boxes;
    for (std::size_t node = 0; node < std::min(hierarchy.nodes.size(), statuses.size()); ++node) {
        const Box3f box = box_of(hierarchy.nodes[node], options.with_surfaces);
        for (std::size_t style = 0; style < styles.size(); ++style) {
            if (statuses[node] == styles[style].status && !is_empty(box)) {
                boxes[style].push_back(box);
            }
        }
    }

    const LegendLayout layout(options.width, options.height);
    std::vector<LegendEntry> legend;
    int legend_px = 0;
    if (options.legend) {
        for (std::size_t style = styles.size(); style-- > 0;) {
            const StatusStyle& of = styles[style];
            legend.push_back(
                {Sample::box,
                 std::string(of.name) + " " + std::to_string(boxes[style].size()),
                 of.color,
                 of.line_px,
                 of.tint}
            );
        }
        if (options.plan != nullptr) {
            legend.push_back({Sample::line, "image quad", colors.quad, line_px});
        }
        legend.push_back({Sample::line, "frustum", colors.frustum, line_px});
        legend.push_back({Sample::eye, "eye"});
        if (!options.path.empty()) {
            legend.push_back({Sample::path, "path", colors.path, line_px});
        }
        legend.push_back({Sample::scale_bar, "000 m", colors.text});
        legend_px = place(legend, layout, options.width);
        if (legend_px > options.height / 3) {
            legend.clear();
            legend_px = 0;
        }
    }

    const dvec3 eye = view.eye - hierarchy.origin;
    Box3d shown{eye, eye};
    if (!hierarchy.nodes.empty()) {
        const Box3f all = bounds(hierarchy.nodes.front());
        shown = unite(shown, Box3d{dvec3(all.lo), dvec3(all.hi)});
    }
    for (const dvec3& point : options.path) {
        shown = unite(shown, point - hierarchy.origin);
    }
    const int map_height = options.height - legend_px;
    const Map map(options.up, shown, dvec2(options.width, map_height));

    Picture picture = blank_picture(options.width, map_height, colors.background);
    Canvas canvas(picture);
    std::vector<dvec2> seen = {map(eye)};
    for (const dvec3& corner : window_corners(view, view.lens.far_distance)) {
        seen.push_back(map(eye + corner));
    }
    seen = convex_hull(seen);
    canvas.fill(seen, colors.frustum, kFrustumTint);
    for (std::size_t style = 0; style < styles.size(); ++style) {
        for (const Box3f& box : boxes[style]) {
            const std::vector<dvec2> outline = outline_of(box, map, styles[style].line_px);
            canvas.fill(outline, styles[style].color, styles[style].tint);
            canvas.outline(outline, styles[style].line_px, styles[style].color);
        }
    }
    if (options.plan != nullptr) {
        draw_quads(canvas, map, *options.plan, hierarchy.origin, options);
    }
    std::vector<dvec2> path;
    for (const dvec3& point : options.path) {
        path.push_back(map(point - hierarchy.origin));
    }
    draw_path(canvas, path, line_px, colors);
    canvas.outline(seen, line_px, colors.frustum);
    draw_eye(canvas, map(eye), layout.sample_px, colors);

    if (!legend.empty()) {
        // Rows are stored from the top, so the legend goes below the map by adding some.
        const Picture below = blank_picture(options.width, legend_px, colors.background);
        picture.rgba.insert(picture.rgba.end(), below.rgba.begin(), below.rgba.end());
        picture.height = options.height;
        canvas.line({0.0, map_height}, {options.width, map_height}, 1.0, colors.recursed);
        draw_legend(canvas, legend, layout, colors, map_height, map.pixels_per_metre());
    }
    return picture;
}

void draw_status(
    Picture& frame,
    const Hierarchy& hierarchy,
    std::span<const NodeStatus> statuses,
    const View& view,
    const StatusOptions& options
) {
    BoxPainter painter(frame, view, hierarchy.origin);
    std::vector<std::pair<double, std::size_t>> far_to_near;
    for (std::size_t node = 0; node < std::min(hierarchy.nodes.size(), statuses.size()); ++node) {
        const Box3f box = box_of(hierarchy.nodes[node], options.with_surfaces);
        const bool shown =
            statuses[node] == NodeStatus::image || statuses[node] == NodeStatus::geometry;
        if (shown && !is_empty(box)) {
            far_to_near.emplace_back(-painter.distance_to(box), node);
        }
    }
    std::sort(far_to_near.begin(), far_to_near.end());
    for (const auto& [distance, node] : far_to_near) {
        const glm::u8vec3& color =
            statuses[node] == NodeStatus::image ? options.colors.image : options.colors.geometry;
        painter.draw(box_of(hierarchy.nodes[node], options.with_surfaces), options.line_px, color);
    }
}

} // namespace farfield::eval
