#include "image/cube_colors.hpp"

#include "image/cube_rays.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

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

/// Rays a side of its faces from which on a cell has a gain for each axis. With fewer there are too
/// few aslant to tell them apart.
constexpr std::uint32_t kGainEach = 8;

/// For a cell with so many rays a side of its faces: all together three times as many as on a face.
ObliqueCounts counts_of(std::uint32_t side) noexcept {
    const std::size_t directions = side < kGainEach ? 8 : 32;
    return {directions, std::max<std::size_t>(3 * std::size_t{side} * side / directions, 6)};
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

/// Covered areas, found and modelled: each direction counts for an axis as the square of its
/// cosine.
struct AxisAreas {
    glm::vec3 found{0.0F};
    glm::vec3 modelled{0.0F};

    void add(const glm::vec3& direction, float found_area, float modelled_area) noexcept {
        found += direction * direction * found_area;
        modelled += direction * direction * modelled_area;
    }
    /// With which gains are to be multiplied to come nearer. Areas grow more slowly than gains, so
    /// a few rounds of it end where both are the same, or cannot be.
    [[nodiscard]] glm::vec3 factors() const noexcept {
        constexpr float kNothing = 1e-30F;
        return glm::clamp((found + kNothing) / (modelled + kNothing), 0.5F, 2.0F);
    }
};

/// Rounds after which what is left is a hundredth of what was off, where an area grows by 0.4 of
/// what the gain does.
constexpr int kRounds = 8;

/// How a cell looks aslant.
struct ObliqueLook {
    glm::vec3 gains{1.0F}; ///< with which its colours cover as much
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
    std::vector<float> covered_;
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
    const ObliqueCounts counts = counts_of(side_);
    aim(cell, box, counts, oblique_);
    oblique_hits_.resize(oblique_.rays.size());
    sampler_->cast(
        item_,
        oblique_.rays,
        std::max({size.x, size.y, size.z}) / static_cast<float>(side_),
        oblique_hits_
    );
    // [m^2], by direction
    std::vector<float>& covered = covered_;
    covered.assign(counts.directions, 0.0F);
    for (std::size_t i = 0; i < oblique_.rays.size(); ++i) {
        covered[i / counts.each] += oblique_hits_[i].t <= 1.0F ? 1.0F : 0.0F;
    }
    float all_covered = 0.0F;
    for (std::size_t i = 0; i < counts.directions; ++i) {
        covered[i] *= oblique_.silhouettes[i] / static_cast<float>(counts.each);
        all_covered += covered[i];
    }
    const auto covered_by = [&](std::size_t i, const glm::vec3& gains) {
        return oblique_.silhouettes[i] *
               alpha_along(cube, size, oblique_.directions[i], gains, 1.0F);
    };
    ObliqueLook result;
    if (side_ < kGainEach) {
        // On a scale of powers of two.
        const float power = halve_to(-4.0F, 4.0F, 7, all_covered, [&](float of) {
            float sum = 0.0F;
            for (std::size_t i = 0; i < counts.directions; ++i) {
                sum += covered_by(i, glm::vec3(std::exp2(of)));
            }
            return sum;
        });
        result.gains = glm::vec3(std::exp2(power));
    }
    for (int round = 0; side_ >= kGainEach && round < kRounds; ++round) {
        AxisAreas areas;
        for (std::size_t i = 0; i < counts.directions; ++i) {
            areas.add(oblique_.directions[i], covered[i], covered_by(i, result.gains));
        }
        result.gains = glm::clamp(result.gains * areas.factors(), 1.0F / 16.0F, 16.0F);
    }
    result.sheet = is_sheet_seen();
    return result;
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
    const std::vector<Box3f> boxes = contents_boxes(tree);
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
                const auto index = static_cast<std::uint32_t>(i);
                cell_sampler.sample(index, boxes[i], &tree.cubes[i], cells);
                if (!composed_interiors) {
                    looks[i] = cell_sampler.look(index, boxes[i], tree.cubes[i]);
                }
            }
        }
    });
    if (composed_interiors) {
        compose_interiors(tree);
        return;
    }
    keep_surfaces(tree, looks);
    tree.gains.reserve(cells);
    for (const ObliqueLook& look : looks) {
        tree.gains.push_back(make_gain(look.gains, look.sheet));
    }
}

} // namespace farfield::image
