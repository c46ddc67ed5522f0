#include "embree/frame_work.hpp"

#include <farfield/math/box3.hpp>

#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

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

/// Coordinates of a parallelogram from a corner o along u and v, all in camera axes, relative to
/// the eye. With x and y [px] of the target, they are (u.x + u.y x + u.z y) / (w.x + w.y x + w.z
/// y), and likewise v, in [0, 1] each; w is 1 over the distance along the view direction.
struct PlaneCoordinates {
    glm::dvec3 u{0.0};
    glm::dvec3 v{0.0};
    glm::dvec3 w{0.0};
    bool seen = false; ///< not edge on

    PlaneCoordinates(
        const Pass& pass,
        const glm::dvec3& origin,
        const glm::dvec3& edge_u,
        const glm::dvec3& edge_v
    ) noexcept {
        // A ray d meets the plane at o + a u + b v = t d: the rows of the inverse of (u, v, o) give
        // a / t, b / t and 1 / t, each linear in d.
        const double volume = glm::dot(edge_u, glm::cross(edge_v, origin));
        seen = volume != 0.0 && std::isfinite(volume);
        if (!seen) {
            return;
        }
        // d = (x, y, -1) with x and y linear in pixels of the target.
        const Lens& lens = pass.view.lens;
        const glm::dvec2 tangents = 1.0 / pixels_per_tangent(pass.view);
        const double x0 = lens.left - pass.viewport.x * tangents.x;
        const double y0 = lens.bottom - pass.viewport.y * tangents.y;
        const auto in_pixels = [&](const glm::dvec3& row) {
            const glm::dvec3 scaled = row / volume;
            return glm::dvec3(
                scaled.x * x0 + scaled.y * y0 - scaled.z,
                scaled.x * tangents.x,
                scaled.y * tangents.y
            );
        };
        u = in_pixels(glm::cross(edge_v, origin));
        v = in_pixels(glm::cross(origin, edge_u));
        w = in_pixels(glm::cross(edge_u, edge_v));
    }
};

/// An item as a pass sees it.
class ItemView {
  public:
    ItemView(const Pass& pass, const CastItem& item) noexcept : pass_(&pass) {
        const glm::dmat3 world_to_camera = glm::transpose(pass.view.camera_to_world);
        linear_ = world_to_camera * item.linear;
        offset_ = world_to_camera * (item.translation - pass.view.eye);
    }

    [[nodiscard]] Outline outline(const Box3f& box) const noexcept {
        Outline result(*pass_);
        for (unsigned index = 0; index < 8; ++index) {
            result.add(linear_ * glm::dvec3(corner(box, index)) + offset_);
        }
        return result;
    }

    [[nodiscard]] const glm::dmat3& linear() const noexcept { return linear_; } ///< to the camera
    [[nodiscard]] const glm::dvec3& offset() const noexcept { return offset_; }

  private:
    const Pass* pass_;
    glm::dmat3 linear_{1.0};
    glm::dvec3 offset_{0.0};
};

/// Depths of an outline that a ray has to look at, rounded outwards.
DepthRange depths_of(const Outline& outline, const Lens& lens) noexcept {
    const double slack = kDepthSlack * (std::abs(outline.nearest()) + std::abs(outline.farthest()));
    return {
        static_cast<float>(std::max(outline.nearest() - slack, lens.near_distance)),
        static_cast<float>(std::min(outline.farthest() + slack, lens.far_distance))};
}

/// Sets where and how far off a draw may be seen.
/// @param box of what is drawn, in object space
/// @return false where it cannot be seen at all
bool place_draw(const Pass& pass, const Box3f& box, Draw& draw) noexcept {
    const CastItem& item = *draw.item;
    const Outline outline = ItemView(pass, item).outline(box);
    const DepthRange depths = depths_of(outline, pass.view.lens);
    draw.nearest = depths.nearest;
    draw.farthest = depths.farthest;
    draw.around = outline.around();
    draw.eye = glm::vec3(item.inverse * (pass.view.eye - item.translation));
    return draw.nearest <= draw.farthest && draw.around.width > 0 && draw.around.height > 0;
}

/// Calls `visit` with boxes around the triangles [first, last), block by block, while it returns
/// true. A block at an end may lie in two places far apart: only these triangles of it count.
template <typename Visit>
void for_boxes(
    const Surface& surface, std::uint32_t first, std::uint32_t last, const Visit& visit
) {
    bool more = true;
    while (more && first < last) {
        const std::uint32_t block = first / Surface::kBlock;
        const std::uint32_t end = std::min((block + 1) * Surface::kBlock, last);
        if (end - first == Surface::kBlock) {
            more = visit(surface.block_boxes[block]);
        } else {
            Box3f box;
            for (std::size_t i = std::size_t{first} * 3; i < std::size_t{end} * 3; ++i) {
                box = unite(box, surface.positions[surface.indices[i]]);
            }
            more = visit(box);
        }
        first = end;
    }
}

/// Notes for every square of pixels at which depths the cells of a draw may be met. Most of a split
/// item may be shown by images, and rays there would have to pass all of it.
void add_depths(const Pass& pass, Draw& draw, FrameWork& work) {
    const Region& around = draw.around;
    const std::int32_t columns = draw.squares_a_row();
    const std::int32_t rows = (around.height + kDepthSquare - 1) / kDepthSquare;
    draw.first_depth = static_cast<std::uint32_t>(work.depths.size());
    work.depths.resize(
        work.depths.size() + static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)
    );
    const ItemView view(pass, *draw.item);
    const auto add_block = [&](const Box3f& box) {
        const Outline outline = view.outline(box);
        const Region seen = outline.around();
        const DepthRange depths = depths_of(outline, pass.view.lens);
        if (depths.nearest > depths.farthest || !overlaps(seen, around)) {
            return;
        }
        const std::int32_t left = std::max((seen.x - around.x) / kDepthSquare, 0);
        const std::int32_t bottom = std::max((seen.y - around.y) / kDepthSquare, 0);
        const std::int32_t right =
            std::min((seen.x + seen.width - 1 - around.x) / kDepthSquare, columns - 1);
        const std::int32_t top =
            std::min((seen.y + seen.height - 1 - around.y) / kDepthSquare, rows - 1);
        for (std::int32_t row = bottom; row <= top; ++row) {
            const auto first =
                work.depths.begin() + draw.first_depth + std::ptrdiff_t{row} * columns;
            for (auto square = first + left; square <= first + right; ++square) {
                square->nearest = std::min(square->nearest, depths.nearest);
                square->farthest = std::max(square->farthest, depths.farthest);
            }
        }
    };
    for (std::uint32_t i = draw.first_cell; i < draw.first_cell + draw.cell_count; ++i) {
        const Cell& cell = work.cells[i];
        const std::uint32_t end = cell.first_triangle + cell.triangle_count;
        for_boxes(*draw.item->surface, cell.first_triangle, end, [&](const Box3f& box) {
            add_block(box);
            return true;
        });
    }
}

/// Planes of a pass's view in object space, inside where positive.
struct ObjectFrustum {
    std::array<glm::dvec4, 6> planes{};

    ObjectFrustum(const Pass& pass, const CastItem& item) noexcept {
        const View& view = pass.view;
        const Lens& lens = view.lens;
        const ItemView seen(pass, item);
        const std::array<glm::dvec4, 6> in_camera = {
            {{1.0, 0.0, lens.left, 0.0},
             {-1.0, 0.0, -lens.right, 0.0},
             {0.0, 1.0, lens.bottom, 0.0},
             {0.0, -1.0, -lens.top, 0.0},
             {0.0, 0.0, -1.0, -lens.near_distance},
             {0.0, 0.0, 1.0, lens.far_distance}}};
        for (std::size_t i = 0; i < planes.size(); ++i) {
            const glm::dvec3 normal(in_camera[i]);
            planes[i] = glm::dvec4(
                glm::transpose(seen.linear()) * normal,
                glm::dot(normal, seen.offset()) + in_camera[i].w
            );
        }
    }

    /// True where certainly nothing of the box is in view.
    [[nodiscard]] bool misses(const Box3f& box) const noexcept {
        for (const glm::dvec4& plane : planes) {
            const glm::dvec3 normal(plane);
            const glm::dvec3 innermost = glm::mix(
                glm::dvec3(box.lo), glm::dvec3(box.hi), glm::greaterThan(normal, glm::dvec3(0.0))
            );
            if (glm::dot(normal, innermost) + plane.w < 0.0) {
                return true;
            }
        }
        return false;
    }
};

/// True where all triangles between cells are out of view, so that casting may take them along.
bool only_cells_in_view(
    const Pass& pass, const CastItem& item, std::span<const Cell> cells
) noexcept {
    const Surface& surface = *item.surface;
    const ObjectFrustum frustum(pass, item);
    const auto hidden = [&](std::uint32_t begin, std::uint32_t end) {
        bool all = true;
        for_boxes(surface, begin, end, [&](const Box3f& box) {
            all = frustum.misses(box);
            return all;
        });
        return all;
    };
    std::uint32_t first = 0;
    for (const Cell& cell : cells) {
        if (!hidden(first, cell.first_triangle)) {
            return false;
        }
        first = cell.first_triangle + cell.triangle_count;
    }
    return hidden(first, static_cast<std::uint32_t>(surface.indices.size() / 3));
}

bool same_uses(const FrameWork& work, const Cell& a, const Cell& b) noexcept {
    const auto first = work.uses.begin() + a.first_use;
    const auto second = work.uses.begin() + b.first_use;
    return a.use_count == b.use_count &&
           std::equal(first, first + a.use_count, second, [](const Use& u, const Use& v) {
               return u.order == v.order;
           });
}

/// Makes cells of the runs [first, last) of one item, ordered by their first triangle.
void add_cells(std::size_t first, std::size_t last, FrameWork& work) {
    const std::size_t first_cell = work.cells.size();
    std::vector<ListedRun>& open = work.open;
    open.clear();
    std::uint32_t triangle = work.listed[first].first_triangle;
    for (std::size_t next = first; next < last || !open.empty();) {
        if (open.empty()) {
            triangle = work.listed[next].first_triangle;
        }
        for (; next < last && work.listed[next].first_triangle == triangle; ++next) {
            open.push_back(work.listed[next]);
        }
        // Up to where a run begins or ends.
        std::uint32_t end = next < last ? work.listed[next].first_triangle : UINT32_MAX;
        for (const ListedRun& run : open) {
            end = std::min(end, run.end_triangle);
        }
        Cell cell;
        cell.first_triangle = triangle;
        cell.triangle_count = end - triangle;
        cell.first_use = static_cast<std::uint32_t>(work.uses.size());
        std::sort(open.begin(), open.end(), [](const ListedRun& a, const ListedRun& b) {
            return a.use < b.use;
        });
        for (std::size_t i = 0; i < open.size(); ++i) {
            if (i == 0 || open[i].use != open[i - 1].use) {
                const Use use = work.uses[open[i].use];
                work.uses.push_back(use);
            }
        }
        cell.use_count = static_cast<std::uint32_t>(work.uses.size()) - cell.first_use;
        const bool follows =
            work.cells.size() > first_cell &&
            work.cells.back().first_triangle + work.cells.back().triangle_count == triangle &&
            same_uses(work, work.cells.back(), cell);
        if (follows) {
            work.cells.back().triangle_count += cell.triangle_count;
            work.uses.resize(cell.first_use);
        } else {
            work.cells.push_back(cell);
        }
        std::erase_if(open, [&](const ListedRun& run) { return run.end_triangle == end; });
        triangle = end;
    }
}

bool covers_any(const Flat& flat, std::span<const glm::vec2> places) noexcept {
    const Region& around = flat.around;
    for (std::int32_t y = around.y; y < around.y + around.height; ++y) {
        for (std::int32_t x = around.x; x < around.x + around.width; ++x) {
            for (const glm::vec2& place : places) {
                if (flat.square.covers(glm::dvec2(x, y) + glm::dvec2(place))) {
                    return true;
                }
            }
        }
    }
    return false;
}

void cut_into_tiles(FrameWork& work) {
    const auto pass = static_cast<std::uint32_t>(work.passes.size() - 1);
    const Region& scissor = work.passes.back().pass->scissor;
    const std::int32_t right = scissor.x + scissor.width;
    const std::int32_t top = scissor.y + scissor.height;
    for (std::int32_t y = scissor.y; y < top; y += kTile) {
        for (std::int32_t x = scissor.x; x < right; x += kTile) {
            work.tiles.push_back(
                {.pass = pass,
                 .region = {x, y, std::min(kTile, right - x), std::min(kTile, top - y)}}
            );
        }
    }
}

/// Lists for the tiles of the last pass what they may show of its splats and faces.
void list_flats(std::span<TileTask> tiles, FrameWork& work) {
    const PassWork& pass = work.passes.back();
    const Region& scissor = pass.pass->scissor;
    const std::int32_t columns = (scissor.width + kTile - 1) / kTile;
    const auto flats = std::span<const Flat>(work.flats).subspan(pass.first_flat);
    const auto for_tiles = [&](const Flat& flat, const auto& visit) {
        const Region& around = flat.around;
        const std::int32_t left = (around.x - scissor.x) / kTile;
        const std::int32_t bottom = (around.y - scissor.y) / kTile;
        const std::int32_t right = (around.x + around.width - 1 - scissor.x) / kTile;
        const std::int32_t top = (around.y + around.height - 1 - scissor.y) / kTile;
        for (std::int32_t row = bottom; row <= top; ++row) {
            for (std::int32_t column = left; column <= right; ++column) {
                const std::ptrdiff_t tile = std::ptrdiff_t{row} * columns + column;
                visit(tiles[static_cast<std::size_t>(tile)]);
            }
        }
    };
    for (const Flat& flat : flats) {
        for_tiles(flat, [](TileTask& tile) { ++tile.flat_count; });
    }
    auto next = static_cast<std::uint32_t>(work.listed_flats.size());
    for (TileTask& tile : tiles) {
        tile.first_flat = next;
        next += std::exchange(tile.flat_count, 0U);
    }
    work.listed_flats.resize(next);
    for (std::size_t i = 0; i < flats.size(); ++i) {
        for_tiles(flats[i], [&](TileTask& tile) {
            work.listed_flats[tile.first_flat + tile.flat_count++] =
                pass.first_flat + static_cast<std::uint32_t>(i);
        });
    }
}

/// Lists the runs of triangles of a selection.
void list_selection(
    const CastScene& scene,
    const FramePlan& plan,
    const Selection& selection,
    std::uint32_t use,
    FrameWork& work
) {
    const auto item = static_cast<std::uint32_t>(index_of(selection.item));
    const Surface& surface = *scene.items()[item].surface;
    constexpr std::uint32_t kBits = 64;
    const std::size_t words = surface.indices.size() / 3 / kBits + 1;
    if (work.marked.size() < words) {
        work.marked.resize(words, 0);
    }
    // Marked first, so that runs come out in order without a sort.
    std::uint32_t lowest = UINT32_MAX;
    std::uint32_t highest = 0;
    for (std::uint32_t i = 0; i < selection.count; ++i) {
        const std::uint32_t primitive = plan.selected[selection.first + i];
        const std::uint32_t triangle =
            surface.triangle_of.empty() ? primitive : surface.triangle_of[primitive];
        work.marked[triangle / kBits] |= std::uint64_t{1} << (triangle % kBits);
        lowest = std::min(lowest, triangle / kBits);
        highest = std::max(highest, triangle / kBits);
    }
    bool open = false; // the last run goes on
    for (std::uint32_t word = lowest; selection.count > 0 && word <= highest; ++word) {
        std::uint64_t rest = std::exchange(work.marked[word], 0);
        open = open && (rest & 1U) != 0;
        while (rest != 0) {
            const auto begin = static_cast<std::uint32_t>(std::countr_zero(rest));
            const auto length = static_cast<std::uint32_t>(std::countr_one(rest >> begin));
            const std::uint32_t first = word * kBits + begin;
            if (open && begin == 0) {
                work.listed.back().end_triangle += length;
            } else {
                work.listed.push_back({item, first, first + length, use});
            }
            open = begin + length == kBits;
            rest = open ? 0 : rest >> (begin + length) << (begin + length);
        }
    }
}

} // namespace

void FrameWork::clear() noexcept {
    passes.clear();
    phases.clear();
    draws.clear();
    uses.clear();
    cells.clear();
    depths.clear();
    clips.clear();
    keyframes.clear();
    listed.clear();
    layers.clear();
    warped_count = 0;
    quads.clear();
    flats.clear();
    faces.clear();
    listed_flats.clear();
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
    Use use;
    use.order = order;
    use.mask = command.kind == Command::Kind::mask;
    use.whole_triangles = command.whole_triangles;
    use.keyframe_count = command.keyframe_count;
    use.first_keyframe = static_cast<std::uint32_t>(work.keyframes.size()) - use.keyframe_count;
    if (command.clip != Command::kNoClip) {
        const glm::dvec3 eye = pass.view.eye - plan.origin;
        const Box3f& box = plan.clips[command.clip];
        use.clip = static_cast<std::uint32_t>(work.clips.size());
        work.clips.push_back(
            {glm::vec3(glm::dvec3(box.lo) - eye), glm::vec3(glm::dvec3(box.hi) - eye)}
        );
    }
    Draw draw;
    draw.use = static_cast<std::uint32_t>(work.uses.size());
    work.uses.push_back(use);
    for (std::uint32_t i = command.first; i < command.first + command.count; ++i) {
        draw.item_index = static_cast<std::uint32_t>(index_of(plan.items[i]));
        draw.item = &scene.items()[draw.item_index];
        draw.triangles = static_cast<std::uint32_t>(draw.item->surface->indices.size() / 3);
        if (place_draw(pass, draw.item->surface->bounds, draw)) {
            work.draws.push_back(draw);
        }
    }
    const std::uint32_t end = command.first_piece + command.piece_count;
    for (std::uint32_t i = command.first_piece; i < end; ++i) {
        const Piece& piece = plan.pieces[i];
        const SplitRun& run = *scene.run_of(piece);
        const std::uint32_t first = run.first_triangle + (piece.first - run.first);
        work.listed.push_back(
            {static_cast<std::uint32_t>(index_of(piece.item)), first, first + piece.count, draw.use}
        );
    }
    for (std::uint32_t i = 0; i < command.selection_count; ++i) {
        list_selection(scene, plan, plan.selections[command.first_selection + i], draw.use, work);
    }
}

void add_listed_draws(const CastScene& scene, const Pass& pass, FrameWork& work) {
    std::sort(work.listed.begin(), work.listed.end(), [](const ListedRun& a, const ListedRun& b) {
        return a.item != b.item ? a.item < b.item : a.first_triangle < b.first_triangle;
    });
    for (std::size_t first = 0; first < work.listed.size();) {
        std::size_t last = first;
        while (last < work.listed.size() && work.listed[last].item == work.listed[first].item) {
            ++last;
        }
        Draw draw;
        draw.item_index = work.listed[first].item;
        draw.item = &scene.items()[draw.item_index];
        draw.first_cell = static_cast<std::uint32_t>(work.cells.size());
        add_cells(first, last, work);
        first = last;
        const std::span<const Cell> cells = std::span(work.cells).subspan(draw.first_cell);
        draw.cell_count = static_cast<std::uint32_t>(cells.size());
        Box3f box;
        bool alike = true;
        for (const Cell& cell : cells) {
            draw.triangles += cell.triangle_count;
            alike = alike && cell.use_count == 1 && same_uses(work, cells.front(), cell);
            const std::uint32_t end = cell.first_triangle + cell.triangle_count;
            for_boxes(*draw.item->surface, cell.first_triangle, end, [&](const Box3f& part) {
                box = unite(box, part);
                return true;
            });
        }
        if (!place_draw(pass, box, draw)) {
            continue;
        }
        // Where one command draws all that can be met, no filter is needed.
        if (alike && only_cells_in_view(pass, *draw.item, cells)) {
            draw.use = cells.front().first_use;
            draw.cell_count = 0;
        } else {
            add_depths(pass, draw, work);
        }
        work.draws.push_back(draw);
    }
    work.listed.clear();
}

void add_quad(
    const FramePlan& plan,
    const Pass& pass,
    const Command& command,
    const ImageQuad& quad,
    const Page& page,
    std::uint32_t order,
    FrameWork& work
) {
    const View& view = pass.view;
    const double depth = double{quad.depth};
    const bool in_view = depth >= view.lens.near_distance && depth <= view.lens.far_distance;
    if (command.depth == QuadDepth::none && !in_view) {
        return;
    }
    const glm::dmat3 world_to_camera = glm::transpose(view.camera_to_world);
    const glm::dvec3 eye = view.eye - plan.origin;
    const glm::dvec3 o = world_to_camera * (glm::dvec3(quad.origin) - eye);
    const glm::dvec3 u = world_to_camera * glm::dvec3(quad.edge_u);
    const glm::dvec3 v = world_to_camera * glm::dvec3(quad.edge_v);
    const PlaneCoordinates plane(pass, o, u, v);
    if (!plane.seen) {
        return;
    }
    PassQuad seen;
    Outline outline(pass);
    for (const glm::dvec3& point : {o, o + u, o + v, o + u + v}) {
        outline.add(point);
    }
    seen.around = outline.around();
    if (outline.farthest() <= 0.0 || seen.around.width <= 0 || seen.around.height <= 0) {
        return;
    }
    seen.u = plane.u * double(quad.source.width);
    seen.v = plane.v * double(quad.source.height);
    seen.w = plane.w;
    seen.page = &page;
    seen.source = quad.source;
    seen.stands = command.depth;
    seen.writes_depth = command.kind == Command::Kind::image_depths;
    seen.depth = quad.depth;
    seen.nearest = static_cast<float>(view.lens.near_distance);
    seen.farthest = static_cast<float>(view.lens.far_distance);
    const glm::dvec3 viewpoint = world_to_camera * (glm::dvec3(quad.viewpoint) - eye);
    seen.viewpoint_depth = static_cast<float>(-viewpoint.z);
    seen.near_ratio = quad.near_ratio;
    seen.far_ratio = quad.far_ratio;
    seen.order = order;
    seen.node = quad.node;
    work.quads.push_back(seen);
}

void add_splats(
    const FramePlan& plan,
    const Pass& pass,
    const Command& command,
    std::uint32_t order,
    std::span<const glm::vec2> places,
    FrameWork& work
) {
    const gpu::SplatView view(pass, plan.origin);
    Flat flat;
    flat.order = order;
    for (const Splat& splat : std::span(plan.splats).subspan(command.first, command.count)) {
        if (splat.color.a == 0 || !view.place(splat, flat.square)) {
            continue;
        }
        flat.around = places.size() > 1 ? view.touched(flat.square)
                                        : view.covered(flat.square, glm::dvec2(places[0]));
        if (flat.around.width <= 0 || flat.around.height <= 0) {
            continue;
        }
        // Most splats are smaller than a pixel, and many of these cover no sample.
        constexpr std::uint64_t kFew = 4;
        if (places.size() > 1 && area(flat.around) <= kFew && !covers_any(flat, places)) {
            continue;
        }
        flat.color = splat.color;
        work.flats.push_back(flat);
    }
}

void add_cubes(
    const FramePlan& plan,
    const Pass& pass,
    const Command& command,
    std::uint32_t order,
    FrameWork& work
) {
    const glm::dmat3 world_to_camera = glm::transpose(pass.view.camera_to_world);
    const glm::dvec3 eye = pass.view.eye - plan.origin;
    for (const ShownCube& cube : std::span(plan.cubes).subspan(command.first, command.count)) {
        const gpu::SeenFaces seen = gpu::seen_faces(cube, plan.cube_frames[cube.frame], eye);
        for (const gpu::CubeFace& face : std::span(seen.faces).first(seen.count)) {
            const glm::dvec3 o = world_to_camera * face.origin;
            const glm::dvec3 u = world_to_camera * face.edge_u;
            const glm::dvec3 v = world_to_camera * face.edge_v;
            const PlaneCoordinates plane(pass, o, u, v);
            Outline outline(pass);
            for (const glm::dvec3& point : {o, o + u, o + v, o + u + v}) {
                outline.add(point);
            }
            Flat flat;
            flat.around = outline.around();
            if (!plane.seen || outline.farthest() < pass.view.lens.near_distance ||
                flat.around.width <= 0 || flat.around.height <= 0) {
                continue;
            }
            flat.order = order;
            flat.face = static_cast<std::uint32_t>(work.faces.size());
            flat.color = face.color;
            work.faces.push_back({plane.u, plane.v, plane.w});
            work.flats.push_back(flat);
        }
    }
}

void add_tiles(FrameWork& work) {
    const std::size_t first_tile = work.tiles.size();
    cut_into_tiles(work);
    list_flats(std::span(work.tiles).subspan(first_tile), work);
}

} // namespace farfield::embree
