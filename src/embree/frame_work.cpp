#include "embree/frame_work.hpp"

#include <farfield/math/box3.hpp>

#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfield::embree {

namespace {

/// Float arithmetic of a hit may be off by so much of its distance.
constexpr double kDepthSlack = 1e-5;
/// And by so much of a pixel. [px]
constexpr double kPixelSlack = 0.01;

/// Pixels of the target that one unit of tangent is.
glm::dvec2 pixels_per_tangent(const View& view) noexcept {
    return {
        view.width / (view.lens.right - view.lens.left),
        view.height / (view.lens.top - view.lens.bottom)};
}

/// Bounds of points as the pass sees them.
class Outline {
  public:
    explicit Outline(const Pass& pass) noexcept
        : pass_(&pass), scale_(pixels_per_tangent(pass.view)) {}

    /// @param point in camera axes, relative to the eye
    void add(const glm::dvec3& point) noexcept {
        const double depth = -point.z;
        nearest_ = std::min(nearest_, depth);
        farthest_ = std::max(farthest_, depth);
        const glm::dvec2 tangent = glm::dvec2(point) / depth;
        lo_ = glm::min(lo_, tangent);
        hi_ = glm::max(hi_, tangent);
    }
    [[nodiscard]] double nearest() const noexcept { return nearest_; }
    [[nodiscard]] double farthest() const noexcept { return farthest_; }

    /// Pixels of the scissor around the points. Where one is not before the near plane, it may be
    /// anywhere.
    [[nodiscard]] Region around() const noexcept {
        const Region& scissor = pass_->scissor;
        const Lens& lens = pass_->view.lens;
        if (!(nearest_ > 0.5 * lens.near_distance)) {
            return scissor;
        }
        const glm::dvec2 corner(pass_->viewport.x, pass_->viewport.y);
        const glm::dvec2 least(lens.left, lens.bottom);
        const glm::dvec2 from = (lo_ - least) * scale_ + corner - kPixelSlack;
        const glm::dvec2 to = (hi_ - least) * scale_ + corner + kPixelSlack;
        const auto whole = [](double value, std::int32_t low, std::int32_t high) {
            return static_cast<std::int32_t>(
                std::clamp(value, static_cast<double>(low), static_cast<double>(high))
            );
        };
        const std::int32_t right = scissor.x + scissor.width;
        const std::int32_t top = scissor.y + scissor.height;
        Region region;
        region.x = whole(std::floor(from.x), scissor.x, right);
        region.y = whole(std::floor(from.y), scissor.y, top);
        region.width = whole(std::ceil(to.x), scissor.x, right) - region.x;
        region.height = whole(std::ceil(to.y), scissor.y, top) - region.y;
        return region;
    }

  private:
    const Pass* pass_;
    glm::dvec2 scale_;
    double nearest_ = std::numeric_limits<double>::infinity();
    double farthest_ = -std::numeric_limits<double>::infinity();
    glm::dvec2 lo_{std::numeric_limits<double>::infinity()};
    glm::dvec2 hi_{-std::numeric_limits<double>::infinity()};
};

/// Sets where and how far off a draw may be seen.
/// @param box of what is drawn, in object space
/// @return false where it cannot be seen at all
bool place_draw(const Pass& pass, const Box3f& box, Draw& draw) noexcept {
    const CastItem& item = *draw.item;
    const View& view = pass.view;
    const glm::dvec3 to_item = item.translation - view.eye;
    const glm::dmat3 world_to_camera = glm::transpose(view.camera_to_world);
    const glm::dmat3 linear = world_to_camera * item.linear;
    const glm::dvec3 offset = world_to_camera * to_item;
    Outline outline(pass);
    for (unsigned index = 0; index < 8; ++index) {
        outline.add(linear * glm::dvec3(corner(box, index)) + offset);
    }
    const double slack = kDepthSlack * (std::abs(outline.nearest()) + std::abs(outline.farthest()));
    draw.nearest = static_cast<float>(std::max(outline.nearest() - slack, view.lens.near_distance));
    draw.farthest =
        static_cast<float>(std::min(outline.farthest() + slack, view.lens.far_distance));
    draw.around = outline.around();
    draw.eye = glm::vec3(item.inverse * -to_item);
    return draw.nearest <= draw.farthest && draw.around.width > 0 && draw.around.height > 0;
}

void clip_draw(const FramePlan& plan, const Pass& pass, const Command& command, Draw& draw) {
    draw.clipped = command.clip != Command::kNoClip;
    if (draw.clipped) {
        const glm::dvec3 eye = pass.view.eye - plan.origin;
        const Box3f& box = plan.clips[command.clip];
        draw.clip = {glm::vec3(glm::dvec3(box.lo) - eye), glm::vec3(glm::dvec3(box.hi) - eye)};
    }
}

} // namespace

void FrameWork::clear() noexcept {
    passes.clear();
    phases.clear();
    draws.clear();
    runs.clear();
    quads.clear();
    tiles.clear();
}

void add_view(PassWork& work) noexcept {
    const View& view = work.pass->view;
    work.camera_to_world = glm::mat3(view.camera_to_world);
    const glm::dvec2 tangents = 1.0 / pixels_per_tangent(view);
    work.direction_dx = glm::vec3(view.camera_to_world[0] * tangents.x);
    work.direction_dy = glm::vec3(view.camera_to_world[1] * tangents.y);
}

void add_draws(
    const CastScene& scene,
    const FramePlan& plan,
    const Pass& pass,
    const Command& command,
    std::uint32_t order,
    FrameWork& work
) {
    Draw draw;
    draw.order = order;
    draw.mask = command.kind == Command::Kind::mask;
    clip_draw(plan, pass, command, draw);
    for (std::uint32_t i = command.first; i < command.first + command.count; ++i) {
        draw.item_index = static_cast<std::uint32_t>(index_of(plan.items[i]));
        draw.item = &scene.items()[draw.item_index];
        if (place_draw(pass, draw.item->surface->bounds, draw)) {
            work.draws.push_back(draw);
        }
    }
    const std::uint32_t end = command.first_piece + command.piece_count;
    for (std::uint32_t i = command.first_piece; i < end;) {
        const ItemId id = plan.pieces[i].item;
        draw.item_index = static_cast<std::uint32_t>(index_of(id));
        draw.item = &scene.items()[draw.item_index];
        const Surface& surface = *draw.item->surface;
        // All pieces of one item are one draw.
        draw.first_run = static_cast<std::uint32_t>(work.runs.size());
        for (; i < end && plan.pieces[i].item == id; ++i) {
            const Piece& piece = plan.pieces[i];
            SplitRun run = *scene.run_of(piece);
            run.first_triangle += piece.first - run.first;
            run.first = piece.first;
            run.count = piece.count;
            work.runs.push_back(run);
        }
        const auto first = work.runs.begin() + draw.first_run;
        std::sort(first, work.runs.end(), [](const SplitRun& a, const SplitRun& b) {
            return a.first_triangle < b.first_triangle;
        });
        // Joined, so that the filter finds no two that overlap.
        auto last = first;
        Box3f box;
        std::uint32_t triangles = 0;
        for (auto run = first; run != work.runs.end(); ++run) {
            const std::uint32_t last_end = last->first_triangle + last->count;
            if (run != first && run->first_triangle <= last_end) {
                last->count =
                    std::max(run->first_triangle + run->count, last_end) - last->first_triangle;
            } else if (run != first) {
                *++last = *run;
            }
        }
        work.runs.erase(last + 1, work.runs.end());
        for (auto run = first; run != work.runs.end(); ++run) {
            triangles += run->count;
            const std::uint32_t last_block =
                (run->first_triangle + run->count - 1) / Surface::kBlock;
            for (std::uint32_t block = run->first_triangle / Surface::kBlock; block <= last_block;
                 ++block) {
                box = unite(box, surface.block_boxes[block]);
            }
        }
        draw.run_count = static_cast<std::uint32_t>(work.runs.size()) - draw.first_run;
        if (triangles == surface.indices.size() / 3) {
            draw.run_count = 0;
        }
        if (place_draw(pass, box, draw)) {
            work.draws.push_back(draw);
        }
        draw.run_count = 0;
    }
}

void add_quad(
    const FramePlan& plan,
    const Pass& pass,
    const ImageQuad& quad,
    const Page& page,
    std::uint32_t order,
    FrameWork& work
) {
    const View& view = pass.view;
    const double depth = double{quad.depth};
    if (!(depth >= view.lens.near_distance && depth <= view.lens.far_distance)) {
        return;
    }
    const glm::dmat3 world_to_camera = glm::transpose(view.camera_to_world);
    const glm::dvec3 eye = view.eye - plan.origin;
    const glm::dvec3 o = world_to_camera * (glm::dvec3(quad.origin) - eye);
    const glm::dvec3 u = world_to_camera * glm::dvec3(quad.edge_u);
    const glm::dvec3 v = world_to_camera * glm::dvec3(quad.edge_v);
    // A ray d meets the quad's plane at o + a u + b v = t d: the rows of the inverse of (u, v, o)
    // give a / t, b / t and 1 / t, each linear in d.
    const double volume = glm::dot(u, glm::cross(v, o));
    if (volume == 0.0 || !std::isfinite(volume)) {
        return; // seen edge on
    }
    const glm::dvec3 row_a = glm::cross(v, o) * (quad.source.width / volume);
    const glm::dvec3 row_b = glm::cross(o, u) * (quad.source.height / volume);
    const glm::dvec3 row_w = glm::cross(u, v) / volume;
    PassQuad seen;
    Outline outline(pass);
    for (const glm::dvec3& point : {o, o + u, o + v, o + u + v}) {
        outline.add(point);
    }
    seen.around = outline.around();
    if (outline.farthest() <= 0.0 || seen.around.width <= 0 || seen.around.height <= 0) {
        return;
    }
    // d = (x, y, -1) with x and y linear in pixels of the target.
    const glm::dvec2 tangents = 1.0 / pixels_per_tangent(view);
    const double x0 = view.lens.left - pass.viewport.x * tangents.x;
    const double y0 = view.lens.bottom - pass.viewport.y * tangents.y;
    const auto in_pixels = [&](const glm::dvec3& row) {
        return glm::dvec3(row.x * x0 + row.y * y0 - row.z, row.x * tangents.x, row.y * tangents.y);
    };
    seen.u = in_pixels(row_a);
    seen.v = in_pixels(row_b);
    seen.w = in_pixels(row_w);
    seen.page = &page;
    seen.source = quad.source;
    seen.depth = quad.depth;
    seen.order = order;
    seen.node = quad.node;
    work.quads.push_back(seen);
}

void add_tiles(FrameWork& work) {
    const auto pass = static_cast<std::uint32_t>(work.passes.size() - 1);
    const Region& scissor = work.passes.back().pass->scissor;
    const std::int32_t right = scissor.x + scissor.width;
    const std::int32_t top = scissor.y + scissor.height;
    for (std::int32_t y = scissor.y; y < top; y += kTile) {
        for (std::int32_t x = scissor.x; x < right; x += kTile) {
            work.tiles.push_back(
                {pass, {x, y, std::min(kTile, right - x), std::min(kTile, top - y)}}
            );
        }
    }
}

} // namespace farfield::embree
