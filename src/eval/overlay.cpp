#include "canvas.hpp"
#include "legend.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/eval/heat_map.hpp>
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
using detail::Legend;
using detail::LegendEntry;
using detail::LegendLayout;
using detail::LegendSample;
using glm::dvec2;
using glm::dvec3;

constexpr double kMargin = 0.04;
constexpr double kTint = 0.22; // opacity of the inside of a box
constexpr double kFrustumTint = 0.10;
constexpr double kErrorTint = 0.60; // of a box on the map whose colour is to be read
constexpr double kNested = 0.70;    // size of a box drawn within that of its parent

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

/// Moves points of the map towards one of them: where nested boxes are drawn.
struct Inset {
    double scale = 1.0;
    dvec2 offset{0.0};

    [[nodiscard]] dvec2 operator()(const dvec2& point) const noexcept {
        return point * scale + offset;
    }
};

/// For what lies within a box: drawn as the box is, and once more smaller around the box's middle.
Inset inset_within(const Inset& of_box, const Box3f& box, const Map& map) noexcept {
    const dvec2 middle = of_box(map((dvec3(box.lo) + dvec3(box.hi)) / 2.0));
    return {of_box.scale * kNested, middle + (of_box.offset - middle) * kNested};
}

/// Outline of a box on the map, on whole pixels, and so far inwards that a line along it stays in.
std::vector<dvec2>
outline_of(const Box3f& box, const Map& map, double line_px, const Inset& inset = {}) {
    std::vector<dvec2> points;
    for (unsigned index = 0; index < 8; ++index) {
        points.push_back(glm::round(inset(map(dvec3(corner(box, index))))));
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

/// What a node is drawn as, in the order of the legend.
enum class Kind : std::uint8_t {
    image,
    made,
    combined,
    reused,
    impossible,
    geometry,
    culled,
    recursed,
    none,
};
constexpr std::size_t kKinds = 9;

constexpr std::array<const char*, kKinds> kNames = {
    "image", "new", "combined", "reused", "impossible", "geometry", "culled", "recursed", ""};

std::size_t index_of(Kind kind) noexcept {
    return static_cast<std::size_t>(kind);
}

/// What both views are asked for.
struct Look {
    OverlayShow show = OverlayShow::statuses;
    double error_scale_px = 1.0;
    bool with_surfaces = true;
    double line_px = 1.0;
    const OverlayColors& colors;
};

/// A node as it is drawn.
struct Mark {
    std::size_t node = 0;
    Box3f box;
    Kind kind = Kind::none;
    NodeStatus status = NodeStatus::untouched;
    bool in_use = false; ///< its image is the nearest to the root
    glm::u8vec3 color{0};
};

template <typename T>
T at_or(std::span<const T> values, std::size_t index, T otherwise) noexcept {
    return index < values.size() ? values[index] : otherwise;
}

Kind kind_of(NodeStatus status) noexcept {
    switch (status) {
    case NodeStatus::image:
        return Kind::image;
    case NodeStatus::geometry:
        return Kind::geometry;
    case NodeStatus::culled:
        return Kind::culled;
    case NodeStatus::recursed:
        return Kind::recursed;
    case NodeStatus::untouched:
        break;
    }
    return Kind::none;
}

Kind kind_of(OverlayShow show, NodeStatus status, ImageEvent event) noexcept {
    if (show == OverlayShow::statuses) {
        return kind_of(status);
    }
    if (show == OverlayShow::events) {
        switch (event) {
        case ImageEvent::made:
            return Kind::made;
        case ImageEvent::combined:
            return Kind::combined;
        case ImageEvent::reused:
            return Kind::reused;
        case ImageEvent::impossible:
            return Kind::impossible;
        case ImageEvent::none:
            break;
        }
    }
    const bool shown = status == NodeStatus::geometry ||
                       (show == OverlayShow::errors && status == NodeStatus::image);
    return shown ? kind_of(status) : Kind::none;
}

bool has_image(Kind kind) noexcept {
    return kind == Kind::made || kind == Kind::combined || kind == Kind::reused;
}

glm::u8vec3 color_of(Kind kind, const OverlayColors& colors) noexcept {
    switch (kind) {
    case Kind::image:
        return colors.image;
    case Kind::made:
        return colors.made;
    case Kind::combined:
        return colors.combined;
    case Kind::reused:
        return colors.reused;
    case Kind::impossible:
        return colors.impossible;
    case Kind::geometry:
        return colors.geometry;
    case Kind::culled:
        return colors.culled;
    case Kind::recursed:
    case Kind::none:
        break;
    }
    return colors.recursed;
}

glm::u8vec3 error_color(double error_px, const Look& look) noexcept {
    const double share = error_px / look.error_scale_px;
    return share > 1.0 ? look.colors.beyond : heat_color(share);
}

/// All nodes that are drawn, parents before children.
std::vector<Mark>
marks_of(const Hierarchy& hierarchy, const OverlayNodes& nodes, const Look& look) {
    std::vector<Mark> marks;
    std::vector<bool> below_image(hierarchy.nodes.size());
    for (std::size_t node = 0; node < hierarchy.nodes.size(); ++node) {
        const HierarchyNode& of = hierarchy.nodes[node];
        Mark mark;
        mark.node = node;
        mark.box = look.with_surfaces ? bounds(of) : of.items_box;
        mark.status = at_or(nodes.statuses, node, NodeStatus::untouched);
        mark.kind = kind_of(look.show, mark.status, at_or(nodes.events, node, ImageEvent::none));
        mark.in_use = has_image(mark.kind) && !below_image[node];
        if (has_image(mark.kind) || below_image[node]) {
            for (const std::size_t child : {of.first_child, of.first_child + 1}) {
                if (!is_leaf(of) && child < below_image.size()) {
                    below_image[child] = true;
                }
            }
        }
        if (mark.kind == Kind::none || is_empty(mark.box)) {
            continue;
        }
        mark.color = color_of(mark.kind, look.colors);
        if (look.show == OverlayShow::errors && mark.kind == Kind::image) {
            const auto facts = at_or(nodes.images, node, std::optional<ImageFacts>());
            if (!facts) {
                continue; // there is no error to show
            }
            mark.color = error_color(double{facts->error_px}, look);
        }
        marks.push_back(mark);
    }
    return marks;
}

/// Width of the outline of what is drawn so.
double line_px(Kind kind, const Look& look) noexcept {
    return kind == Kind::recursed ? look.line_px / 2.0 : look.line_px;
}

/// Opacity of the inside of what is drawn so on a map. Nodes left to their children lie under
/// those.
double tint(Kind kind, const Look& look) noexcept {
    if (has_image(kind) || kind == Kind::impossible) {
        return 1.0;
    }
    if (kind == Kind::recursed) {
        return 0.0;
    }
    return look.show == OverlayShow::errors && kind == Kind::image ? kErrorTint : kTint;
}

std::string pixels_text(double pixels) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3g px", pixels);
    return text.data();
}

/// What the colours of nodes mean, and how many have them.
std::vector<LegendEntry> node_entries(std::span<const Mark> marks, const Look& look) {
    std::array<std::size_t, kKinds> counts{};
    std::size_t in_use = 0;
    std::size_t beyond = 0;
    for (const Mark& mark : marks) {
        ++counts[index_of(mark.kind)];
        in_use += mark.in_use ? 1U : 0U;
        beyond += mark.kind == Kind::image && mark.color == look.colors.beyond ? 1U : 0U;
    }
    const auto numbered = [](const std::string& name, std::size_t count) {
        return name + " " + std::to_string(count);
    };
    std::vector<LegendEntry> entries;
    const auto add = [&](Kind kind) {
        const std::size_t index = index_of(kind);
        entries.push_back(
            {LegendSample::box,
             numbered(kNames[index], counts[index]),
             color_of(kind, look.colors),
             line_px(kind, look),
             tint(kind, look)}
        );
    };
    switch (look.show) {
    case OverlayShow::statuses:
        for (const Kind kind : {Kind::image, Kind::geometry, Kind::culled, Kind::recursed}) {
            add(kind);
        }
        break;
    case OverlayShow::events:
        for (const Kind kind :
             {Kind::made, Kind::combined, Kind::reused, Kind::impossible, Kind::geometry}) {
            add(kind);
        }
        entries.push_back(
            {LegendSample::box, numbered("in use", in_use), look.colors.in_use, look.line_px}
        );
        break;
    case OverlayShow::errors:
        entries.push_back(
            {LegendSample::ramp,
             std::to_string(counts[index_of(Kind::image)] - beyond) + " from 0 to " +
                 pixels_text(look.error_scale_px)}
        );
        entries.push_back(
            {LegendSample::box,
             numbered("beyond", beyond),
             look.colors.beyond,
             look.line_px,
             tint(Kind::image, look)}
        );
        add(Kind::geometry);
        break;
    }
    return entries;
}

detail::LegendColors legend_colors(const OverlayColors& colors) noexcept {
    return {colors.background, colors.text, colors.recursed, colors.frustum};
}

/// Boxes on the map: those of statuses one status over the other, those of events nested.
void draw_boxes(
    Canvas& canvas,
    const Map& map,
    const Hierarchy& hierarchy,
    std::span<const Mark> marks,
    const Look& look
) {
    if (look.show != OverlayShow::events) {
        for (const Kind kind : {Kind::recursed, Kind::culled, Kind::geometry, Kind::image}) {
            for (const Mark& mark : marks) {
                if (mark.kind != kind) {
                    continue;
                }
                const std::vector<dvec2> outline = outline_of(mark.box, map, line_px(kind, look));
                canvas.fill(outline, mark.color, tint(kind, look));
                canvas.outline(outline, line_px(kind, look), mark.color);
            }
        }
        return;
    }
    // Where what is below a node is drawn.
    std::vector<Inset> insets(hierarchy.nodes.size());
    auto next = marks.begin();
    for (std::size_t node = 0; node < hierarchy.nodes.size(); ++node) {
        const Inset inset = node == 0 ? Inset{} : insets[hierarchy.nodes[node].parent];
        insets[node] = inset;
        if (next == marks.end() || next->node != node) {
            continue;
        }
        const Mark& mark = *next++;
        const bool thin = !mark.in_use && mark.kind != Kind::geometry;
        const double width = thin ? look.line_px / 2.0 : look.line_px;
        const std::vector<dvec2> outline = outline_of(mark.box, map, width, inset);
        glm::u8vec3 color = mark.color;
        if (mark.in_use) {
            color = look.colors.in_use;
        } else if (mark.kind != Kind::geometry) {
            color = look.colors.recursed;
        }
        canvas.fill(outline, mark.color, tint(mark.kind, look));
        canvas.outline(outline, width, color);
        if (has_image(mark.kind)) {
            insets[node] = inset_within(inset, mark.box, map);
        }
    }
}

/// Where the images were made that the frame shows, and where they are valid.
void draw_zones(
    Canvas& canvas,
    const Map& map,
    const OverlayNodes& nodes,
    double line_px,
    double mark_px,
    const glm::u8vec3& color
) {
    for (std::size_t node = 0; node < nodes.images.size(); ++node) {
        const std::optional<ImageFacts>& facts = nodes.images[node];
        const bool image = at_or(nodes.statuses, node, NodeStatus::untouched) == NodeStatus::image;
        if (!image || !facts) {
            continue;
        }
        if (!is_empty(facts->zone) && is_finite(facts->zone)) {
            canvas.outline(outline_of(facts->zone, map, line_px), line_px, color);
        }
        detail::draw_mark(canvas, map(dvec3(facts->viewpoint)), mark_px, line_px, color);
    }
}

std::size_t count_shown(const OverlayNodes& nodes) noexcept {
    std::size_t shown = 0;
    for (std::size_t node = 0; node < nodes.images.size(); ++node) {
        const bool image = at_or(nodes.statuses, node, NodeStatus::untouched) == NodeStatus::image;
        shown += image && nodes.images[node] ? 1U : 0U;
    }
    return shown;
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

    /// The inside of the outline of a box; nothing where part of it is behind the near plane.
    void fill(const Box3f& box, double opacity, const glm::u8vec3& color) {
        std::vector<dvec2> points;
        for (unsigned index = 0; index < 8; ++index) {
            const dvec3 point = world_to_camera_ * (dvec3(corner(box, index)) - eye_);
            if (-point.z < lens_.near_distance) {
                return;
            }
            points.push_back(project(point));
        }
        canvas_.fill(convex_hull(std::move(points)), color, opacity);
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

std::vector<std::optional<ImageFacts>> images_of(const ImageCache& cache) {
    std::vector<std::optional<ImageFacts>> images;
    images.reserve(cache.statuses().size());
    for (std::size_t node = 0; node < cache.statuses().size(); ++node) {
        images.push_back(cache.image_of(static_cast<std::uint32_t>(node)));
    }
    return images;
}

Picture birds_eye(
    const Hierarchy& hierarchy,
    const OverlayNodes& nodes,
    const View& view,
    const BirdsEyeOptions& options
) {
    FARFIELD_ASSERT(options.width >= 1 && options.height >= 1);
    FARFIELD_ASSERT(options.error_scale_px > 0.0);
    const OverlayColors& colors = options.colors;
    const double line_px = options.line_px;
    const Look look{options.show, options.error_scale_px, options.with_surfaces, line_px, colors};
    const std::vector<Mark> marks = marks_of(hierarchy, nodes, look);

    const LegendLayout layout(options.width, options.height);
    std::vector<LegendEntry> entries;
    if (options.legend) {
        entries = node_entries(marks, look);
        if (options.zones) {
            entries.push_back(
                {LegendSample::mark,
                 "viewpoint " + std::to_string(count_shown(nodes)),
                 colors.zone,
                 line_px / 2.0}
            );
        }
        if (options.plan != nullptr) {
            entries.push_back({LegendSample::line, "image quad", colors.quad, line_px});
        }
        entries.push_back({LegendSample::line, "frustum", colors.frustum, line_px});
        entries.push_back({LegendSample::eye, "eye"});
        if (!options.path.empty()) {
            entries.push_back({LegendSample::path, "path", colors.path, line_px});
        }
        entries.push_back({LegendSample::scale_bar, "000 m", colors.text});
    }
    const Legend legend(std::move(entries), layout, options.width, options.height / 3);

    const dvec3 eye = view.eye - hierarchy.origin;
    Box3d shown{eye, eye};
    if (!hierarchy.nodes.empty()) {
        const Box3f all = bounds(hierarchy.nodes.front());
        shown = unite(shown, Box3d{dvec3(all.lo), dvec3(all.hi)});
    }
    for (const dvec3& point : options.path) {
        shown = unite(shown, point - hierarchy.origin);
    }
    const int map_height = options.height - legend.height();
    const Map map(options.up, shown, dvec2(options.width, map_height));

    Picture picture = detail::blank_picture(options.width, map_height, colors.background);
    Canvas canvas(picture);
    std::vector<dvec2> seen = {map(eye)};
    for (const dvec3& corner : window_corners(view, view.lens.far_distance)) {
        seen.push_back(map(eye + corner));
    }
    seen = convex_hull(seen);
    canvas.fill(seen, colors.frustum, kFrustumTint);
    draw_boxes(canvas, map, hierarchy, marks, look);
    if (options.plan != nullptr) {
        draw_quads(canvas, map, *options.plan, hierarchy.origin, options);
    }
    if (options.zones) {
        draw_zones(canvas, map, nodes, line_px / 2.0, layout.sample_px * 0.6, colors.zone);
    }
    std::vector<dvec2> path;
    for (const dvec3& point : options.path) {
        path.push_back(map(point - hierarchy.origin));
    }
    detail::draw_cased_path(canvas, path, line_px, colors.text, colors.path);
    canvas.outline(seen, line_px, colors.frustum);
    detail::draw_eye(canvas, map(eye), layout.sample_px, colors.text, colors.frustum);
    legend.append_to(picture, legend_colors(colors), map.pixels_per_metre());
    return picture;
}

void draw_nodes(
    Picture& frame,
    const Hierarchy& hierarchy,
    const OverlayNodes& nodes,
    const View& view,
    const NodeOverlayOptions& options
) {
    FARFIELD_ASSERT(options.error_scale_px > 0.0);
    const Look look{
        options.show,
        options.error_scale_px,
        options.with_surfaces,
        options.line_px,
        options.colors};
    const std::vector<Mark> marks = marks_of(hierarchy, nodes, look);
    BoxPainter painter(frame, view, hierarchy.origin);
    std::vector<std::pair<double, std::size_t>> far_to_near;
    for (std::size_t i = 0; i < marks.size(); ++i) {
        const Mark& mark = marks[i];
        const bool shown = mark.status == NodeStatus::image || mark.status == NodeStatus::geometry;
        if (shown || mark.kind == Kind::made || mark.kind == Kind::combined) {
            far_to_near.emplace_back(-painter.distance_to(mark.box), i);
        }
    }
    std::sort(far_to_near.begin(), far_to_near.end());
    for (const auto& [distance, i] : far_to_near) {
        const Mark& mark = marks[i];
        const bool shown = mark.status == NodeStatus::image || mark.status == NodeStatus::geometry;
        if (look.show == OverlayShow::errors && mark.kind == Kind::image) {
            painter.fill(mark.box, kTint, mark.color);
        }
        painter.draw(mark.box, shown ? look.line_px : look.line_px / 2.0, mark.color);
    }
    if (options.legend) {
        std::vector<LegendEntry> entries = node_entries(marks, look);
        const LegendLayout layout(frame.width, frame.height);
        Legend(std::move(entries), layout, frame.width, frame.height / 3)
            .append_to(frame, legend_colors(options.colors), 1.0);
    }
}

} // namespace farfield::eval
