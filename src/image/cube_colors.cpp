#include "image/cube_colors.hpp"

#include "image/cube_cells.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

namespace farfield::image {

namespace {

constexpr std::size_t kCellsAtOnce = 64;

/// A number in [0, 1) for a ray of a cell: the same on every run, unlike its neighbours'.
float jitter(std::uint32_t seed) noexcept {
    // Finaliser of MurmurHash3, which leaves no pattern.
    seed ^= seed >> 16U;
    seed *= 0x85EBCA6BU;
    seed ^= seed >> 13U;
    seed *= 0xC2B2AE35U;
    seed ^= seed >> 16U;
    return static_cast<float>(seed >> 8U) * 0x1p-24F;
}

/// Directions that are tried for every cell, and rays along each where faces have 4 x 4.
constexpr std::size_t kDirections = 8;
constexpr std::size_t kOblique = 6;

/// Directions all around and, along each, rays through the silhouette of a box.
struct ObliqueRays {
    std::array<glm::vec3, kDirections> directions{};
    std::array<float, kDirections> silhouettes{}; ///< [m^2]
    std::vector<SurfaceRay> rays; ///< as many of each direction, one after the other
};

/// Rays along each direction, for so many a side of faces.
std::size_t rays_each(std::uint32_t side) noexcept {
    return kOblique * std::max(side * side / 16U, 1U);
}

/// Chooses directions for a cell, the same on every run.
/// @return the next number for `jitter`
std::uint32_t aim_directions(std::uint32_t cell, const Box3f& box, ObliqueRays& out) noexcept {
    const glm::vec3 size = extent(box);
    const glm::vec3 areas(size.y * size.z, size.z * size.x, size.x * size.y);
    std::uint32_t seed = (cell + 1U) * 0x9E3779B9U;
    for (std::size_t i = 0; i < kDirections; ++i) {
        // Bands of equal area, the turn within each left to chance.
        const float z =
            -1.0F + 2.0F * (static_cast<float>(i) + jitter(seed++)) / float{kDirections};
        const float turn = 2.0F * std::numbers::pi_v<float> * jitter(seed++);
        const float ring = std::sqrt(std::max(0.0F, 1.0F - z * z));
        out.directions[i] = {ring * std::cos(turn), ring * std::sin(turn), z};
        const glm::vec3 seen = glm::abs(out.directions[i]) * areas;
        out.silhouettes[i] = seen.x + seen.y + seen.z;
    }
    return seed;
}

/// Directions for a cell and rays along them.
/// @param side rays a side of its faces
void aim(std::uint32_t cell, const Box3f& box, std::uint32_t side, ObliqueRays& out) {
    // A little longer than the box, so that surfaces in its faces are met.
    constexpr float kBeyond = 1e-3F;
    std::uint32_t seed = aim_directions(cell, box, out);
    const glm::vec3 size = extent(box);
    const glm::vec3 areas(size.y * size.z, size.z * size.x, size.x * size.y);
    const std::size_t each = rays_each(side);
    out.rays.resize(kDirections * each);
    for (std::size_t i = 0; i < kDirections; ++i) {
        const glm::vec3& direction = out.directions[i];
        const glm::vec3 seen = glm::abs(direction) * areas;
        for (std::size_t k = 0; k < each; ++k) {
            // Uniform over the silhouette: first the face, then the point on it.
            float choice = jitter(seed++) * out.silhouettes[i];
            int axis = 0;
            while (axis < 2 && choice >= seen[axis]) {
                choice -= seen[axis++];
            }
            glm::vec3 from = box.lo;
            from[(axis + 1) % 3] += size[(axis + 1) % 3] * jitter(seed++);
            from[(axis + 2) % 3] += size[(axis + 2) % 3] * jitter(seed++);
            from[axis] = direction[axis] > 0.0F ? box.lo[axis] : box.hi[axis];
            float length = std::numeric_limits<float>::infinity();
            for (int a = 0; a < 3; ++a) {
                const float way = direction[a] > 0.0F ? box.hi[a] - from[a] : from[a] - box.lo[a];
                length = std::min(length, way / std::max(std::abs(direction[a]), 1e-12F));
            }
            const float beyond = std::max({size.x, size.y, size.z}) * kBeyond;
            out.rays[i * each + k] = {
                from - direction * beyond, direction * (length + 2.0F * beyond)};
        }
    }
}

/// Share of the silhouette of a cell's box that it covers, by its colours and a gain.
float alpha_along(
    const ColorCube& cube, const glm::vec3& size, const glm::vec3& direction, float gain
) noexcept {
    glm::vec3 depths(0.0F);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<int>(axis);
        depths[a] = optical_depth(cube.faces[face_of(axis, direction[a] < 0.0F)].a);
    }
    return oblique_alpha(depths, direction, size, gain);
}

/// Where `grown` is `wanted`, for what grows with its argument: halves [lo, hi] so often.
template <typename Function>
float halve_to(float lo, float hi, int times, float wanted, const Function& grown) {
    for (int i = 0; i < times; ++i) {
        const float middle = 0.5F * (lo + hi);
        (grown(middle) < wanted ? lo : hi) = middle;
    }
    return 0.5F * (lo + hi);
}

/// How a cell looks aslant.
struct ObliqueLook {
    float covered = 0.0F; ///< [m^2] summed over the directions of `aim`
    float gain = 1.0F;    ///< with which its colours cover as much
    bool sheet = false;
};

/// Colours of cells from rays through them.
class CellSampler {
  public:
    CellSampler(
        const SurfaceSampler& sampler,
        ItemId item,
        std::span<const glm::vec3> lights,
        float ambient,
        std::span<const std::uint32_t> rays_a_side
    )
        : sampler_(&sampler), item_(item), lights_(lights), ambient_(ambient),
          rays_a_side_(rays_a_side) {}

    /// @param cubes those of the cell, a set after the other, `stride` apart
    void sample(std::uint32_t cell, const Box3f& box, ColorCube* cubes, std::size_t stride) {
        side_ = rays_a_side_[cell];
        rays_.resize(std::size_t{6} * side_ * side_);
        hits_.resize(rays_.size());
        // A little longer than the box, so that surfaces in its faces are met.
        constexpr float kBeyond = 1e-3F;
        const glm::vec3 size = extent(box);
        const glm::vec3 step = size / static_cast<float>(side_);
        std::size_t ray = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (const bool positive : {false, true}) {
                const auto a = static_cast<int>(axis);
                const int u = (a + 1) % 3;
                const int v = (a + 2) % 3;
                const float beyond = size[a] * kBeyond;
                glm::vec3 along(0.0F);
                along[a] = (size[a] + 2.0F * beyond) * (positive ? -1.0F : 1.0F);
                for (std::uint32_t row = 0; row < side_; ++row) {
                    for (std::uint32_t column = 0; column < side_; ++column, ++ray) {
                        const auto seed =
                            static_cast<std::uint32_t>(cell * rays_.size() + ray) * 2U;
                        glm::vec3 from = box.lo;
                        from[a] = positive ? box.hi[a] + beyond : box.lo[a] - beyond;
                        from[u] += step[u] * (static_cast<float>(column) + jitter(seed));
                        from[v] += step[v] * (static_cast<float>(row) + jitter(seed + 1U));
                        rays_[ray] = {from, along};
                    }
                }
            }
        }
        const float spacing = std::max({step.x, step.y, step.z});
        sampler_->cast(item_, rays_, spacing, hits_);
        const std::size_t each = rays_.size() / 6;
        for (std::size_t set = 0; set < lights_.size(); ++set) {
            for (std::size_t face = 0; face < 6; ++face) {
                glm::vec3 sum(0.0F);
                std::size_t met = 0;
                for (std::size_t i = face * each; i < (face + 1) * each; ++i) {
                    if (hits_[i].t <= 1.0F) {
                        const float lit = 0.5F + 0.5F * glm::dot(hits_[i].normal, lights_[set]);
                        sum += hits_[i].color * (ambient_ + (1.0F - ambient_) * lit);
                        ++met;
                    }
                }
                const float scale = 255.0F / static_cast<float>(each);
                const float alpha = static_cast<float>(met) * scale;
                // Premultiplied, so no colour may exceed the alpha that it is rounded with.
                const auto most = static_cast<std::uint8_t>(std::lround(alpha));
                const glm::vec3 color = glm::clamp(sum * scale + 0.5F, 0.0F, 255.0F);
                cubes[set * stride].faces[face] = glm::u8vec4(
                    std::min(static_cast<std::uint8_t>(color.r), most),
                    std::min(static_cast<std::uint8_t>(color.g), most),
                    std::min(static_cast<std::uint8_t>(color.b), most),
                    most
                );
            }
        }
    }

    /// How a cell looks aslant. After `sample`.
    [[nodiscard]] ObliqueLook look(std::uint32_t cell, const Box3f& box, const ColorCube& cube);

  private:
    [[nodiscard]] bool is_sheet_seen() const noexcept;

    const SurfaceSampler* sampler_;
    ItemId item_;
    std::span<const glm::vec3> lights_;
    float ambient_;
    std::span<const std::uint32_t> rays_a_side_; ///< by cell
    std::uint32_t side_ = 0;
    std::vector<SurfaceRay> rays_;
    std::vector<SurfaceHit> hits_;
    ObliqueRays oblique_;
    std::vector<SurfaceHit> oblique_hits_;
};

/// Whether all that the rays have met lies about one plane, and hides what is behind it: a carpet
/// of grass lies about a plane as well.
bool CellSampler::is_sheet_seen() const noexcept {
    // Distance from the plane over the extent in it, root mean squares: of a surface that bends by
    // 30 degrees across the cell it is 0.05, of points anywhere in a cube 0.7.
    constexpr float kFlat = 0.1F;
    constexpr std::size_t kFewest = 8;
    glm::vec3 middle(0.0F);
    std::array<float, 6> products{}; // xx, yy, zz, xy, yz, zx
    std::size_t met = 0;
    const glm::vec3 around = rays_.front().from;
    const auto add = [&](const std::vector<SurfaceRay>& rays, const std::vector<SurfaceHit>& hits) {
        for (std::size_t i = 0; i < hits.size(); ++i) {
            if (hits[i].t > 1.0F) {
                continue;
            }
            const glm::vec3 p = rays[i].from + rays[i].along * hits[i].t - around;
            middle += p;
            products[0] += p.x * p.x;
            products[1] += p.y * p.y;
            products[2] += p.z * p.z;
            products[3] += p.x * p.y;
            products[4] += p.y * p.z;
            products[5] += p.z * p.x;
            ++met;
        }
    };
    add(rays_, hits_);
    add(oblique_.rays, oblique_hits_);
    if (met < kFewest) {
        return false;
    }
    const float each = 1.0F / static_cast<float>(met);
    middle *= each;
    const float xx = products[0] * each - middle.x * middle.x;
    const float yy = products[1] * each - middle.y * middle.y;
    const float zz = products[2] * each - middle.z * middle.z;
    const float xy = products[3] * each - middle.x * middle.y;
    const float yz = products[4] * each - middle.y * middle.z;
    const float zx = products[5] * each - middle.z * middle.x;
    // The least eigenvalue of the covariance, by the trigonometric solution of its cubic.
    const float trace = xx + yy + zz;
    const float mean = trace / 3.0F;
    const glm::vec3 diagonal(xx - mean, yy - mean, zz - mean);
    const float off = xy * xy + yz * yz + zx * zx;
    const float spread = std::sqrt((glm::dot(diagonal, diagonal) + 2.0F * off) / 6.0F);
    if (!(spread > 0.0F)) {
        return false;
    }
    const float determinant = diagonal.x * (diagonal.y * diagonal.z - yz * yz) -
                              xy * (xy * diagonal.z - yz * zx) + zx * (xy * yz - diagonal.y * zx);
    const float angle =
        std::acos(std::clamp(determinant / (2.0F * spread * spread * spread), -1.0F, 1.0F)) / 3.0F;
    const float least =
        mean + 2.0F * spread * std::cos(angle + 2.0F * std::numbers::pi_v<float> / 3.0F);
    if (least > kFlat * kFlat * (trace - least)) {
        return false;
    }
    // The normal is at right angles to all rows of the covariance less the eigenvalue.
    const std::array<glm::vec3, 3> rows = {
        glm::vec3(xx - least, xy, zx),
        glm::vec3(xy, yy - least, yz),
        glm::vec3(zx, yz, zz - least)};
    glm::vec3 normal(0.0F);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const glm::vec3 candidate = glm::cross(rows[i], rows[(i + 1) % 3]);
        normal = glm::dot(candidate, candidate) > glm::dot(normal, normal) ? candidate : normal;
    }
    std::size_t crossing = 0;
    std::size_t stopped = 0;
    const auto count = [&](const std::vector<SurfaceRay>& rays,
                           const std::vector<SurfaceHit>& hits) {
        for (std::size_t i = 0; i < hits.size(); ++i) {
            const float begin = glm::dot(rays[i].from - around - middle, normal);
            const float way = glm::dot(rays[i].along, normal);
            if ((begin < 0.0F) != (begin + way < 0.0F)) {
                ++crossing;
                stopped += hits[i].t <= 1.0F ? 1 : 0;
            }
        }
    };
    count(rays_, hits_);
    count(oblique_.rays, oblique_hits_);
    constexpr float kOpaque = 0.9F;
    return static_cast<float>(stopped) >= kOpaque * static_cast<float>(crossing);
}

ObliqueLook CellSampler::look(std::uint32_t cell, const Box3f& box, const ColorCube& cube) {
    const glm::vec3 size = extent(box);
    aim(cell, box, side_, oblique_);
    oblique_hits_.resize(oblique_.rays.size());
    sampler_->cast(
        item_,
        oblique_.rays,
        std::max({size.x, size.y, size.z}) / static_cast<float>(side_),
        oblique_hits_
    );
    const std::size_t each = oblique_.rays.size() / kDirections;
    ObliqueLook result;
    for (std::size_t i = 0; i < oblique_.rays.size(); ++i) {
        result.covered += oblique_hits_[i].t <= 1.0F ? oblique_.silhouettes[i / each] : 0.0F;
    }
    result.covered /= static_cast<float>(each);
    // On a scale of powers of two.
    const float power = halve_to(-4.0F, 4.0F, 7, result.covered, [&](float of) {
        float sum = 0.0F;
        for (std::size_t i = 0; i < kDirections; ++i) {
            sum += oblique_.silhouettes[i] *
                   alpha_along(cube, size, oblique_.directions[i], std::exp2(of));
        }
        return sum;
    });
    result.gain = std::exp2(power);
    result.sheet = is_sheet_seen();
    return result;
}

bool meets(const SurfaceRay& ray, const Box3f& box) noexcept {
    float enter = 0.0F;
    float leave = 1.0F;
    for (int axis = 0; axis < 3; ++axis) {
        const float along = ray.along[axis];
        const float lo = box.lo[axis] - ray.from[axis];
        const float hi = box.hi[axis] - ray.from[axis];
        if (along == 0.0F) {
            leave = lo > 0.0F || hi < 0.0F ? -1.0F : leave;
            continue;
        }
        enter = std::max(enter, std::min(lo / along, hi / along));
        leave = std::min(leave, std::max(lo / along, hi / along));
    }
    return enter < leave;
}

/// What makes up for what colours of single cells do not know: whether what is in cells one behind
/// the other hides itself more or less than by chance. One factor of the gains for each level: with
/// it the children of the cells above cover as much as these do. Half of the neighbours of a cell
/// are under another parent and hide each other as much, so it counts twice.
/// @param looks by cell; gains change
void correct_for_order(
    const ColorCubeTree& tree,
    const std::vector<CellPlace>& places,
    const std::vector<std::uint32_t>& rays_a_side,
    std::vector<ObliqueLook>& looks
) {
    constexpr std::size_t kParents = 512; // of a level that are asked
    std::vector<std::vector<std::uint32_t>> levels(1, {0});
    for (std::size_t depth = 0; depth < levels.size(); ++depth) {
        std::vector<std::uint32_t> below;
        for (const std::uint32_t cell : levels[depth]) {
            for (std::uint32_t k = 0;
                 tree.cells[cell].octants != 0 && k < child_count(tree.cells[cell]);
                 ++k) {
                below.push_back(tree.cells[cell].first + k);
            }
        }
        if (!below.empty()) {
            levels.push_back(std::move(below));
        }
    }
    const auto box_of = [&](std::uint32_t cell) {
        return contents_box(tree.cells[cell], places[cell].lo, places[cell].edge);
    };
    ObliqueRays rays;
    std::vector<float> factors;
    for (std::size_t depth = 0; depth + 1 < levels.size(); ++depth) {
        std::vector<std::uint32_t> parents;
        for (const std::uint32_t cell : levels[depth]) {
            if (tree.cells[cell].octants != 0) {
                parents.push_back(cell);
            }
        }
        const std::size_t stride = (parents.size() + kParents - 1) / kParents;
        // Of each ray, one bit for each child that it meets.
        std::vector<std::uint8_t> met;
        float wanted = 0.0F;
        for (std::size_t i = 0; i < parents.size(); i += stride) {
            const std::uint32_t parent = parents[i];
            const CubeCell& cell = tree.cells[parent];
            aim(parent, box_of(parent), rays_a_side[parent], rays);
            wanted += looks[parent].covered;
            for (const SurfaceRay& ray : rays.rays) {
                unsigned mask = 0;
                for (std::uint32_t k = 0; k < child_count(cell); ++k) {
                    mask |= meets(ray, box_of(cell.first + k)) ? 1U << k : 0U;
                }
                met.push_back(static_cast<std::uint8_t>(mask));
            }
        }
        const float power = halve_to(-1.0F, 1.0F, 8, wanted, [&](float of) {
            float sum = 0.0F;
            std::size_t next = 0;
            for (std::size_t i = 0; i < parents.size(); i += stride) {
                const CubeCell& cell = tree.cells[parents[i]];
                aim_directions(parents[i], box_of(parents[i]), rays);
                const std::size_t each = rays_each(rays_a_side[parents[i]]);
                for (std::size_t direction = 0; direction < kDirections; ++direction) {
                    std::array<float, 8> passed{};
                    for (std::uint32_t k = 0; k < child_count(cell); ++k) {
                        const std::uint32_t child = cell.first + k;
                        const float gain =
                            looks[child].gain * (looks[child].sheet ? 1.0F : std::exp2(of));
                        passed[k] = 1.0F - alpha_along(
                                               tree.cubes[child],
                                               extent(box_of(child)),
                                               rays.directions[direction],
                                               gain
                                           );
                    }
                    float hidden = 0.0F;
                    for (std::size_t k = 0; k < each; ++k) {
                        float through = 1.0F;
                        for (unsigned rest = met[next++]; rest != 0; rest &= rest - 1) {
                            through *= passed[static_cast<std::size_t>(std::countr_zero(rest))];
                        }
                        hidden += 1.0F - through;
                    }
                    sum += rays.silhouettes[direction] * hidden / static_cast<float>(each);
                }
            }
            return sum;
        });
        factors.push_back(parents.empty() ? 1.0F : std::exp2(power));
    }
    for (std::size_t depth = 1; depth < levels.size(); ++depth) {
        for (const std::uint32_t cell : levels[depth]) {
            looks[cell].gain *= looks[cell].sheet ? 1.0F : factors[depth - 1] * factors[depth - 1];
        }
    }
}

void compose_interiors(ColorCubeTree& tree) {
    for (std::size_t set = 0; set < tree.light_sets; ++set) {
        ColorCube* cubes = tree.cubes.data() + set * tree.cells.size();
        for (std::size_t i = tree.cells.size(); i-- > 0;) {
            const CubeCell& cell = tree.cells[i];
            if (cell.octants == 0) {
                continue;
            }
            std::array<ColorCube, 8> octants{};
            std::uint32_t child = cell.first;
            for (unsigned rest = cell.octants; rest != 0; rest &= rest - 1) {
                octants[static_cast<std::size_t>(std::countr_zero(rest))] = cubes[child++];
            }
            cubes[i] = composed(octants);
        }
    }
}

/// Rays a side of the faces of every cell. What a cell covers is known as well as the square root
/// of its rays, and there are the fewer cells the more they stand for: those of a small tree, which
/// may be shown in many places, and those of upper levels get more of them.
std::vector<std::uint32_t> rays_of(const ColorCubeTree& tree, const ColorCubeOptions& options) {
    if (options.shared_rays == 0) {
        return std::vector<std::uint32_t>(tree.cells.size(), options.rays);
    }
    constexpr float kMost = 64.0F;
    const double share = options.shared_rays / static_cast<double>(tree.cells.size());
    const auto base = static_cast<float>(std::max<double>(options.rays, std::sqrt(share)));
    std::vector<std::uint32_t> rays(tree.cells.size());
    std::vector<std::uint8_t> heights(tree.cells.size(), 0);
    for (std::size_t i = tree.cells.size(); i-- > 0;) {
        const CubeCell& cell = tree.cells[i];
        for (std::uint32_t k = 0; cell.octants != 0 && k < child_count(cell); ++k) {
            heights[i] =
                std::max(heights[i], static_cast<std::uint8_t>(heights[cell.first + k] + 1));
        }
        // Four times fewer cells with twice as many rays: upper levels cost half of what is below.
        const float side = base * std::exp2(0.5F * static_cast<float>(heights[i]));
        rays[i] = static_cast<std::uint32_t>(std::lround(std::min(side, kMost)));
    }
    return rays;
}

/// A cell is a part of a surface where the cell around it is one as well: a single leaf faces one
/// way, the leaves around it do not.
void keep_surfaces(const ColorCubeTree& tree, std::vector<ObliqueLook>& looks) {
    // From the back, so that what is said of a cell is not changed before its children have seen
    // it.
    for (std::size_t i = tree.cells.size(); i-- > 0;) {
        const CubeCell& cell = tree.cells[i];
        for (std::uint32_t k = 0; cell.octants != 0 && k < child_count(cell); ++k) {
            ObliqueLook& child = looks[cell.first + k];
            child.sheet = child.sheet && looks[i].sheet;
        }
    }
}

} // namespace

void color_cells(
    const SurfaceSampler& sampler,
    ItemId item,
    std::span<const glm::vec3> lights,
    float ambient,
    const ColorCubeOptions& options,
    Executor& executor,
    ColorCubeTree& tree
) {
    const std::vector<CellPlace> places = places_of(tree);
    const std::size_t cells = tree.cells.size();
    tree.light_sets = static_cast<std::uint32_t>(lights.size());
    tree.cubes.assign(cells * lights.size(), {});
    const bool composed_interiors = options.colors == CubeColors::composed;
    std::vector<ObliqueLook> looks(composed_interiors ? 0 : cells);
    const std::vector<std::uint32_t> rays_a_side = rays_of(tree, options);
    executor.run((cells + kCellsAtOnce - 1) / kCellsAtOnce, [&](std::size_t chunk) {
        CellSampler cell_sampler(sampler, item, lights, ambient, rays_a_side);
        const std::size_t end = std::min(cells, (chunk + 1) * kCellsAtOnce);
        for (std::size_t i = chunk * kCellsAtOnce; i < end; ++i) {
            if (tree.cells[i].octants == 0 || !composed_interiors) {
                const Box3f box = contents_box(tree.cells[i], places[i].lo, places[i].edge);
                const auto index = static_cast<std::uint32_t>(i);
                cell_sampler.sample(index, box, &tree.cubes[i], cells);
                if (!composed_interiors) {
                    looks[i] = cell_sampler.look(index, box, tree.cubes[i]);
                }
            }
        }
    });
    if (composed_interiors) {
        compose_interiors(tree);
        return;
    }
    keep_surfaces(tree, looks);
    correct_for_order(tree, places, rays_a_side, looks);
    tree.gains.reserve(cells);
    for (const ObliqueLook& look : looks) {
        tree.gains.push_back(make_gain(look.gain, look.sheet));
    }
}

} // namespace farfield::image
