#include "embree/projection.hpp"
#include "embree/tile.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace farfield::embree {

namespace {

/// Rays that Embree takes at once.
constexpr std::size_t kLanes = 16;
constexpr std::uint32_t kNoDraw = UINT32_MAX;
/// It pays to have Embree take a packet down together while there are no more triangles than this
/// for every ray in their rectangle: beyond, the rays part among the leaves.
constexpr double kCoherentTriangles = 4.0;

template <typename T>
using Lanes = std::array<T, kLanes>;

struct PixelPlace {
    std::uint8_t column = 0;
    std::uint8_t row = 0;
};

/// Pixels of a tile along Morton's curve, so that those that follow each other are close.
constexpr std::array<PixelPlace, kTilePixels> kCurve = [] {
    std::array<PixelPlace, kTilePixels> curve{};
    for (std::size_t i = 0; i < kTilePixels; ++i) {
        for (unsigned bit = 0; (1U << bit) < static_cast<unsigned>(kTile); ++bit) {
            curve[i].column |= static_cast<std::uint8_t>((i >> (2 * bit) & 1U) << bit);
            curve[i].row |= static_cast<std::uint8_t>((i >> (2 * bit + 1) & 1U) << bit);
        }
    }
    return curve;
}();

/// Rays of a packet and what they have met so far.
struct Packet {
    alignas(64) Lanes<int> active;
    alignas(64) Lanes<float> x; ///< direction in the world; the camera's own depth of it is 1
    alignas(64) Lanes<float> y;
    alignas(64) Lanes<float> z;
    alignas(64) Lanes<float> depth;
    alignas(64) Lanes<float> u;
    alignas(64) Lanes<float> v;
    Lanes<std::uint32_t> primitive;
    Lanes<std::uint32_t> geometry;
    Lanes<std::uint32_t> draw;
    Lanes<std::uint32_t> order;
    Lanes<const Use*> use; ///< of the hit
    Lanes<std::uint16_t> pixel;
    Lanes<std::uint16_t> sample;
    Region around; ///< [px] of the target
    float farthest = 0.0F;
};

/// What the filter of cells needs; `CastContext` is its base and comes first.
struct CellContext {
    CastContext cast;
    const FrameWork* work = nullptr;
    std::span<const Cell> cells; ///< of the draw
    const Surface* surface = nullptr;
    const Packet* packet = nullptr;
};

/// The first command of those that draw a triangle which also draws a point of it, or null.
/// @param point relative to the eye, in the world's axes
const Use* use_of(
    const FrameWork& work,
    std::span<const Cell> cells,
    std::uint32_t triangle,
    const glm::vec3& point
) noexcept {
    const auto after = std::upper_bound(
        cells.begin(),
        cells.end(),
        triangle,
        [](std::uint32_t of, const Cell& cell) { return of < cell.first_triangle; }
    );
    if (after == cells.begin()) {
        return nullptr;
    }
    const Cell& cell = *(after - 1);
    if (triangle - cell.first_triangle >= cell.triangle_count) {
        return nullptr;
    }
    for (std::uint32_t i = cell.first_use; i < cell.first_use + cell.use_count; ++i) {
        const Use& use = work.uses[i];
        if (use.clip == Use::kNoClip || contains(work.clips[use.clip], point)) {
            return &use;
        }
    }
    return nullptr;
}

glm::vec3 point_of(const Packet& packet, std::size_t lane, float depth) noexcept {
    return glm::vec3(packet.x[lane], packet.y[lane], packet.z[lane]) * depth;
}

/// Context filter that lets through what some command draws.
void keep_listed(const RTCFilterFunctionNArguments* arguments) {
    const auto& context = *reinterpret_cast<const CellContext*>(arguments->context);
    const unsigned count = arguments->N;
    for (unsigned i = 0; i < count; ++i) {
        if (arguments->valid[i] == 0) {
            continue;
        }
        const std::uint32_t lane = RTCRayN_id(arguments->ray, count, i);
        const glm::vec3 point =
            point_of(*context.packet, lane, RTCRayN_tfar(arguments->ray, count, i));
        const std::uint32_t part = RTCHitN_geomID(arguments->hit, count, i);
        const std::uint32_t triangle =
            context.surface->parts[part].first_triangle + RTCHitN_primID(arguments->hit, count, i);
        if (use_of(*context.work, context.cells, triangle, point) == nullptr) {
            arguments->valid[i] = 0;
        }
    }
}

/// Casts packets of one phase in one tile.
class Caster {
  public:
    Caster(
        const CastScene& scene,
        const FrameWork& work,
        const TileTask& task,
        std::span<const glm::vec2> places,
        Workspace& workspace
    ) noexcept
        : scene_(&scene), work_(&work), pass_(&work.passes[task.pass]), region_(task.region),
          samples_(places.size()), workspace_(&workspace), tile_(&workspace.tile) {
        rtcInitIntersectContext(&context_.cast.embree);
        context_.work = &work;
        context_.packet = &packet_;
        std::fill_n(hits_.ray.time, kLanes, 0.0F);
        std::fill_n(hits_.ray.mask, kLanes, UINT32_MAX);
        std::iota(hits_.ray.id, hits_.ray.id + kLanes, 0U);
        std::fill_n(hits_.ray.flags, kLanes, 0U);
        find_tangents(places);
    }

    void run() noexcept {
        // Rays go pixel by pixel along the curve, the samples of one after the other.
        const std::size_t rays = kTilePixels * samples_;
        std::size_t pixel = 0;
        std::size_t sample = 0;
        for (std::size_t ray = 0; ray < rays; ray += kLanes) {
            if (!place(pixel, sample)) {
                continue;
            }
            bool aimed = false; // most packets of a frame of images meet no draw
            for (const std::uint32_t draw : workspace_->listed) {
                if (work_->draws[draw].nearest > packet_.farthest) {
                    break; // the rest is farther still
                }
                const DepthRange depths = depths_of(work_->draws[draw]);
                if (depths.nearest <= std::min(depths.farthest, packet_.farthest)) {
                    if (!aimed) {
                        aim();
                        aimed = true;
                    }
                    cast(draw, depths);
                }
            }
            if (aimed) {
                show();
            }
        }
    }

  private:
    void find_tangents(std::span<const glm::vec2> places) noexcept;
    bool place(std::size_t& pixel, std::size_t& sample) noexcept;
    void aim() noexcept;
    [[nodiscard]] DepthRange depths_of(const Draw& draw) const noexcept;
    void cast(std::uint32_t draw, const DepthRange& depths) noexcept;
    void show() noexcept;
    [[nodiscard]] Color16 shade(std::size_t lane) const noexcept;
    [[nodiscard]] PositionTexel position(std::size_t lane) const noexcept;
    [[nodiscard]] std::optional<Projected> project_hit(std::size_t lane) const noexcept;
    void show_pixel(std::size_t lane) noexcept;

    const CastScene* scene_;
    const FrameWork* work_;
    const PassWork* pass_;
    Region region_;
    std::size_t samples_;
    Workspace* workspace_;
    TileBuffer* tile_;
    CellContext context_;
    alignas(64) RTCRayHit16 hits_{};
    alignas(64) Lanes<int> valid_{};
    Packet packet_{};
};

void Caster::find_tangents(std::span<const glm::vec2> places) noexcept {
    const Pass& pass = *pass_->pass;
    const Lens& lens = pass.view.lens;
    const double step_x = (lens.right - lens.left) / pass.view.width;
    const double step_y = (lens.top - lens.bottom) / pass.view.height;
    for (std::size_t i = 0; i < static_cast<std::size_t>(kTile); ++i) {
        const double x = region_.x - pass.viewport.x + static_cast<double>(i);
        const double y = region_.y - pass.viewport.y + static_cast<double>(i);
        for (std::size_t sample = 0; sample < samples_; ++sample) {
            const glm::dvec2 place(places[sample]);
            workspace_->tangents_x[i * samples_ + sample] =
                static_cast<float>(lens.left + (x + place.x) * step_x);
            workspace_->tangents_y[i * samples_ + sample] =
                static_cast<float>(lens.bottom + (y + place.y) * step_y);
        }
    }
}

/// Takes up the next pixels and samples.
/// @return false where none of them is in the tile's region
bool Caster::place(std::size_t& pixel, std::size_t& sample) noexcept {
    Packet& packet = packet_;
    std::int32_t left = kTile;
    std::int32_t right = -1;
    std::int32_t bottom = kTile;
    std::int32_t top = -1;
    packet.farthest = 0.0F;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const PixelPlace place = kCurve[pixel];
        const std::size_t in_tile = std::size_t{place.row} * kTile + place.column;
        const bool inside = place.column < region_.width && place.row < region_.height;
        packet.active[lane] = inside ? -1 : 0;
        packet.pixel[lane] = static_cast<std::uint16_t>(in_tile);
        packet.sample[lane] = static_cast<std::uint16_t>(sample);
        const float depth = tile_->mixed[in_tile] == 0
                                ? tile_->depths[in_tile]
                                : tile_->sample_depths[in_tile * samples_ + sample];
        packet.depth[lane] = depth;
        if (inside) {
            left = std::min(left, std::int32_t{place.column});
            right = std::max(right, std::int32_t{place.column});
            bottom = std::min(bottom, std::int32_t{place.row});
            top = std::max(top, std::int32_t{place.row});
            packet.farthest = std::max(packet.farthest, depth);
        }
        if (++sample == samples_) {
            sample = 0;
            ++pixel;
        }
    }
    if (right < 0) {
        return false;
    }
    packet.around = {region_.x + left, region_.y + bottom, right - left + 1, top - bottom + 1};
    return true;
}

/// Sets up rays through the samples that were taken up.
void Caster::aim() noexcept {
    Packet& packet = packet_;
    Lanes<float> x{};
    Lanes<float> y{};
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const std::size_t column = packet.pixel[lane] % kTile;
        const std::size_t row = packet.pixel[lane] / kTile;
        x[lane] = workspace_->tangents_x[column * samples_ + packet.sample[lane]];
        y[lane] = workspace_->tangents_y[row * samples_ + packet.sample[lane]];
        packet.draw[lane] = kNoDraw;
        packet.order[lane] = 0;
    }
    const glm::mat3& axes = pass_->camera_to_world;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        packet.x[lane] = axes[0].x * x[lane] + axes[1].x * y[lane] - axes[2].x;
        packet.y[lane] = axes[0].y * x[lane] + axes[1].y * y[lane] - axes[2].y;
        packet.z[lane] = axes[0].z * x[lane] + axes[1].z * y[lane] - axes[2].z;
    }
}

/// Between which depths the packet may meet a draw.
DepthRange Caster::depths_of(const Draw& draw) const noexcept {
    const Region& around = draw.around;
    const Region& packet = packet_.around;
    DepthRange depths;
    if (!overlaps(around, packet)) {
        return depths;
    }
    if (draw.cell_count == 0) {
        return {draw.nearest, draw.farthest};
    }
    const std::int32_t columns = draw.squares_a_row();
    const std::int32_t left = std::max(packet.x - around.x, 0) / kDepthSquare;
    const std::int32_t bottom = std::max(packet.y - around.y, 0) / kDepthSquare;
    const std::int32_t right =
        (std::min(packet.x + packet.width - around.x, around.width) - 1) / kDepthSquare;
    const std::int32_t top =
        (std::min(packet.y + packet.height - around.y, around.height) - 1) / kDepthSquare;
    for (std::int32_t row = bottom; row <= top; ++row) {
        for (std::int32_t column = left; column <= right; ++column) {
            const std::int32_t square = row * columns + column;
            const DepthRange& here =
                work_->depths[draw.first_depth + static_cast<std::uint32_t>(square)];
            depths.nearest = std::min(depths.nearest, here.nearest);
            depths.farthest = std::max(depths.farthest, here.farthest);
        }
    }
    return depths;
}

/// Casts the packet at one draw and keeps what is nearer than before.
void Caster::cast(std::uint32_t index, const DepthRange& depths) noexcept {
    const Draw& draw = work_->draws[index];
    const CastItem& item = *draw.item;
    Packet& packet = packet_;
    RTCRay16& ray = hits_.ray;
    const glm::mat3& to_object = item.direction_to_object;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        ray.org_x[lane] = draw.eye.x;
        ray.org_y[lane] = draw.eye.y;
        ray.org_z[lane] = draw.eye.z;
        const float x = packet.x[lane];
        const float y = packet.y[lane];
        const float z = packet.z[lane];
        ray.dir_x[lane] = to_object[0].x * x + to_object[1].x * y + to_object[2].x * z;
        ray.dir_y[lane] = to_object[0].y * x + to_object[1].y * y + to_object[2].y * z;
        ray.dir_z[lane] = to_object[0].z * x + to_object[1].z * y + to_object[2].z * z;
        ray.tnear[lane] = depths.nearest;
        ray.tfar[lane] = std::min(packet.depth[lane], depths.farthest);
        hits_.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    }
    const Use& whole = work_->uses[draw.use];
    if (draw.cell_count == 0 && whole.clip != Use::kNoClip) {
        const Box3f& clip = work_->clips[whole.clip];
        // The part of each ray inside the box. Parallel to a side the quotients are infinite, of
        // one sign outside and of two inside.
        const auto cut = [&](const Lanes<float>& along, float lo, float hi) {
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                const float a = lo / along[lane];
                const float b = hi / along[lane];
                ray.tnear[lane] = std::max(ray.tnear[lane], std::min(a, b));
                ray.tfar[lane] = std::min(ray.tfar[lane], std::max(a, b));
            }
        };
        cut(packet.x, clip.lo.x, clip.hi.x);
        cut(packet.y, clip.lo.y, clip.hi.y);
        cut(packet.z, clip.lo.z, clip.hi.z);
    }
    int any = 0;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        valid_[lane] = ray.tnear[lane] <= ray.tfar[lane] ? packet.active[lane] : 0;
        any |= valid_[lane];
    }
    if (any == 0) {
        return;
    }
    const double rays = static_cast<double>(area(draw.around)) * static_cast<double>(samples_);
    context_.cast.embree.flags = draw.triangles <= kCoherentTriangles * rays
                                     ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                     : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    context_.cells = std::span(work_->cells).subspan(draw.first_cell, draw.cell_count);
    context_.surface = item.surface;
    context_.cast.embree.filter = draw.cell_count > 0 ? keep_listed : nullptr;
    context_.cast.direction_dx = to_object * pass_->direction_dx;
    context_.cast.direction_dy = to_object * pass_->direction_dy;
    rtcIntersect16(valid_.data(), item.surface->bvh.get(), &context_.cast.embree, &hits_);

    bool met = false;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        if (valid_[lane] == 0 || hits_.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID) {
            continue;
        }
        const float depth = ray.tfar[lane];
        const Use* use = draw.cell_count == 0
                             ? &whole
                             : use_of(
                                   *work_,
                                   context_.cells,
                                   item.surface->parts[hits_.hit.geomID[lane]].first_triangle +
                                       hits_.hit.primID[lane],
                                   point_of(packet, lane, depth)
                               );
        // What is drawn first stays where depths are equal.
        const bool nearer =
            depth < packet.depth[lane] ||
            (depth == packet.depth[lane] && use != nullptr && use->order < packet.order[lane]);
        if (use == nullptr || !nearer) {
            continue;
        }
        packet.depth[lane] = depth;
        packet.u[lane] = hits_.hit.u[lane];
        packet.v[lane] = hits_.hit.v[lane];
        packet.primitive[lane] = hits_.hit.primID[lane];
        packet.geometry[lane] = hits_.hit.geomID[lane];
        packet.draw[lane] = index;
        packet.order[lane] = use->order;
        packet.use[lane] = use;
        met = true;
    }
    if (met) {
        packet.farthest = 0.0F;
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            if (packet.active[lane] != 0) {
                packet.farthest = std::max(packet.farthest, packet.depth[lane]);
            }
        }
    }
}

Color16 Caster::shade(std::size_t lane) const noexcept {
    const Packet& packet = packet_;
    const Draw& draw = work_->draws[packet.draw[lane]];
    const CastItem& item = *draw.item;
    const SurfacePart& part = item.surface->parts[packet.geometry[lane]];
    const std::uint32_t triangle = part.first_triangle + packet.primitive[lane];
    const TriangleLook& look = item.surface->looks[triangle];
    const float u = packet.u[lane];
    const float v = packet.v[lane];
    const std::array<float, 3> shares = {1.0F - u - v, u, v};
    // Lit at the corners, and interpolated.
    const float ambient = scene_->ambient();
    glm::vec3 color(0.0F);
    for (std::size_t k = 0; k < 3; ++k) {
        const glm::vec3 normal = unpacked_normal(look.normals[k]);
        float cosine = 0.0F;
        if (item.uniform) {
            cosine = glm::dot(normal, item.object_light) / kNormalScale;
        } else {
            const glm::vec3 world = item.normal_to_world * normal;
            const float length_sq = glm::dot(world, world);
            cosine = length_sq > 0.0F ? glm::dot(world, scene_->to_light()) / std::sqrt(length_sq)
                                      : 0.0F;
        }
        const float lit = ambient + (1.0F - ambient) * (0.5F + 0.5F * cosine);
        color += glm::vec3(look.colors[k]) * (shares[k] * lit);
    }
    constexpr float kMost = 255.0F;
    color *= glm::vec3(part.material->base_color) / kMost;
    if (part.material->texture != nullptr) {
        const glm::vec3 direction =
            item.direction_to_object * glm::vec3(packet.x[lane], packet.y[lane], packet.z[lane]);
        const glm::vec4 texel = texel_at(
            part,
            triangle,
            u,
            v,
            draw.eye,
            direction,
            item.direction_to_object * pass_->direction_dx,
            item.direction_to_object * pass_->direction_dy
        );
        color *= glm::vec3(texel) / kMost;
    }
    const glm::vec3 scaled = glm::clamp(color, 0.0F, 1.0F) * kColor16 + 0.5F;
    return {
        static_cast<std::uint16_t>(scaled.r),
        static_cast<std::uint16_t>(scaled.g),
        static_cast<std::uint16_t>(scaled.b),
        static_cast<std::uint16_t>(kColor16)};
}

PositionTexel Caster::position(std::size_t lane) const noexcept {
    const Draw& draw = work_->draws[packet_.draw[lane]];
    const Surface& surface = *draw.item->surface;
    const std::uint32_t triangle =
        surface.parts[packet_.geometry[lane]].first_triangle + packet_.primitive[lane];
    const std::uint32_t* corners = &surface.indices[std::size_t{triangle} * 3];
    const std::vector<glm::vec3>& points =
        draw.item->mesh_points.empty() ? surface.positions : draw.item->mesh_points;
    const float u = packet_.u[lane];
    const float v = packet_.v[lane];
    PositionTexel texel;
    texel.point =
        points[corners[0]] * (1.0F - u - v) + points[corners[1]] * u + points[corners[2]] * v;
    texel.item = static_cast<ItemId>(draw.item_index);
    return texel;
}

/// What keyframes show of what was met, if its command projects any.
std::optional<Projected> Caster::project_hit(std::size_t lane) const noexcept {
    const Use& use = *packet_.use[lane];
    if (use.keyframe_count == 0) {
        return std::nullopt;
    }
    const CastItem& item = *work_->draws[packet_.draw[lane]].item;
    const Surface& surface = *item.surface;
    const std::uint32_t triangle =
        surface.parts[packet_.geometry[lane]].first_triangle + packet_.primitive[lane];
    const Pass& pass = *pass_->pass;
    const glm::dmat3 world_to_camera = glm::transpose(pass.view.camera_to_world);
    const glm::dvec3 offset = item.translation - pass.view.eye;
    MetPoint met;
    met.point = world_to_camera * glm::dvec3(point_of(packet_, lane, packet_.depth[lane]));
    for (std::size_t k = 0; k < met.corners.size(); ++k) {
        const glm::dvec3 corner(surface.positions[surface.indices[std::size_t{triangle} * 3 + k]]);
        met.corners[k] = world_to_camera * (item.linear * corner + offset);
    }
    return project(
        std::span(work_->keyframes).subspan(use.first_keyframe, use.keyframe_count),
        pass,
        met,
        use.whole_triangles,
        !tile_->positions.empty()
    );
}

/// Writes the only sample of a pixel.
void Caster::show_pixel(std::size_t lane) noexcept {
    const std::size_t pixel = packet_.pixel[lane];
    const std::optional<Projected> projected = project_hit(lane);
    tile_->colors[pixel] = projected ? projected->color : shade(lane);
    if (!tile_->positions.empty()) {
        tile_->positions[pixel] = projected ? projected->position : position(lane);
    }
}

/// Writes what the packet has met into the tile.
void Caster::show() noexcept {
    const Packet& packet = packet_;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        if (packet.draw[lane] == kNoDraw || packet.active[lane] == 0) {
            continue;
        }
        const std::size_t pixel = packet.pixel[lane];
        const bool mask = packet.use[lane]->mask;
        if (samples_ == 1) {
            tile_->depths[pixel] = packet.depth[lane];
            tile_->orders[pixel] = packet.order[lane];
            if (!mask) {
                show_pixel(lane);
            }
            continue;
        }
        if (tile_->mixed[pixel] == 0) {
            tile_->mix(pixel, samples_);
        }
        const std::size_t place = pixel * samples_ + packet.sample[lane];
        tile_->sample_depths[place] = packet.depth[lane];
        tile_->sample_orders[place] = packet.order[lane];
        if (!mask) {
            const std::optional<Projected> projected = project_hit(lane);
            tile_->sample_colors[place] = projected ? projected->color : shade(lane);
        }
    }
}

} // namespace

void cast_tile(
    const CastScene& scene,
    const FrameWork& work,
    const TileTask& task,
    const Phase& phase,
    std::span<const glm::vec2> places,
    Workspace& workspace
) noexcept {
    workspace.listed.clear();
    for (std::uint32_t i = phase.first_draw; i < phase.first_draw + phase.draw_count; ++i) {
        if (overlaps(work.draws[i].around, task.region)) {
            workspace.listed.push_back(i);
        }
    }
    if (!workspace.listed.empty()) {
        Caster(scene, work, task, places, workspace).run();
    }
}

} // namespace farfield::embree
