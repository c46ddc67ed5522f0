#include "image/cube_levels.hpp"

#include "image/cube_rays.hpp"

#include <glm/ext/matrix_float3x3.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

namespace farfield::image {

namespace {

/// What stands around one place of a tree, as it has it: p there is offset + matrix p here.
struct Neighbour {
    glm::mat3 matrix{1.0F};
    glm::mat3 rotation{1.0F};
    glm::vec3 offset{0.0F};

    [[nodiscard]] SurfaceRay ray(const SurfaceRay& here) const noexcept {
        return {offset + matrix * here.from, matrix * here.along};
    }
};

/// A cell that a ray meets.
struct Met {
    std::uint32_t cell = 0;
    std::uint32_t neighbour = 0;
};

/// What rays of one direction meet.
struct MetCells {
    std::vector<Met> cells;
    std::vector<std::uint32_t> ends; ///< by ray: after how many cells it ends
};

/// Where a ray is in a box: its parameter from `enter` to `leave`, none where that is less.
struct Chord {
    float enter = -std::numeric_limits<float>::infinity();
    float leave = std::numeric_limits<float>::infinity();
};

Chord chord_of(const SurfaceRay& ray, const Box3f& box) noexcept {
    Chord chord;
    for (int axis = 0; axis < 3; ++axis) {
        const float along = ray.along[axis];
        const float lo = box.lo[axis] - ray.from[axis];
        const float hi = box.hi[axis] - ray.from[axis];
        if (along == 0.0F) {
            if (lo > 0.0F || hi < 0.0F) {
                return {0.0F, -1.0F};
            }
            continue;
        }
        chord.enter = std::max(chord.enter, std::min(lo / along, hi / along));
        chord.leave = std::min(chord.leave, std::max(lo / along, hi / along));
    }
    return chord;
}

class LevelFitter {
  public:
    LevelFitter(
        const SurfaceSampler& sampler,
        ItemId item,
        std::span<const CubeReference> places,
        const ColorCubeOptions& options,
        Executor& executor,
        const ColorCubeTree& tree
    )
        : tree_(&tree), executor_(&executor),
          counts_{128, std::clamp<std::size_t>(options.shared_rays / 128, 64, 2048)},
          boxes_(contents_boxes(tree)), scale_(level_scale(tree)) {
        const Box3f& box = boxes_.front();
        const Box3f around{box.lo - 2.0F * extent(box), box.hi + 2.0F * extent(box)};
        find_neighbours(places, around);
        aim(0, neighbours_.size() > 1 ? around : box, counts_, oblique_);
        cast(sampler, item);
    }

    /// @return by depth
    [[nodiscard]] std::vector<LevelFactors> fit() const {
        std::vector<std::uint8_t> depths(tree_->cells.size(), 0);
        for (std::size_t i = 0; i < depths.size(); ++i) {
            const CubeCell& cell = tree_->cells[i];
            for (std::uint32_t k = 0; cell.octants != 0 && k < child_count(cell); ++k) {
                depths[cell.first + k] = static_cast<std::uint8_t>(depths[i] + 1);
            }
        }
        std::vector<LevelFactors> factors;
        for (std::uint32_t depth = 0; depth <= tree_->quality.depth; ++depth) {
            add_factors(depths, factors);
        }
        return factors;
    }

  private:
    /// The place in the middle of all, first, and those that reach into a box around it.
    void find_neighbours(std::span<const CubeReference> places, const Box3f& around) {
        constexpr std::size_t kMost = 32;
        neighbours_.emplace_back();
        if (places.empty()) {
            return;
        }
        glm::dvec3 sum(0.0);
        for (const CubeReference& place : places) {
            sum += glm::dvec3(place.translation);
        }
        const glm::vec3 middle(sum / static_cast<double>(places.size()));
        const auto distance_to = [](const glm::vec3& point) {
            return [point](const CubeReference& a, const CubeReference& b) {
                const glm::vec3 from_a = a.translation - point;
                const glm::vec3 from_b = b.translation - point;
                return glm::dot(from_a, from_a) < glm::dot(from_b, from_b);
            };
        };
        const CubeReference& here =
            *std::min_element(places.begin(), places.end(), distance_to(middle));
        std::vector<CubeReference> nearest(places.begin(), places.end());
        const auto end =
            nearest.begin() + static_cast<std::ptrdiff_t>(std::min(nearest.size(), kMost));
        std::partial_sort(nearest.begin(), end, nearest.end(), distance_to(here.translation));
        for (auto at = nearest.begin() + 1; at != end; ++at) {
            Neighbour neighbour;
            neighbour.rotation = glm::transpose(at->rotation) * here.rotation;
            neighbour.matrix = neighbour.rotation * (here.scale / at->scale);
            neighbour.offset =
                glm::transpose(at->rotation) * (here.translation - at->translation) / at->scale;
            if (!is_empty(intersect(box_here(neighbour), around))) {
                neighbours_.push_back(neighbour);
            }
        }
    }

    /// Box around what a neighbour shows.
    [[nodiscard]] Box3f box_here(const Neighbour& neighbour) const noexcept {
        const Box3f& box = boxes_.front();
        const glm::mat3 back = glm::inverse(neighbour.matrix);
        Box3f result;
        for (unsigned corner = 0; corner < 8; ++corner) {
            const glm::vec3 upper(corner & 1U, corner >> 1U & 1U, corner >> 2U);
            const glm::vec3 there = box.lo + upper * extent(box);
            result = unite(result, back * (there - neighbour.offset));
        }
        return result;
    }

    /// What share of each silhouette is covered.
    void cast(const SurfaceSampler& sampler, ItemId item) {
        const glm::vec3 size = extent(boxes_.front());
        const float spacing = std::max({size.x, size.y, size.z}) / 64.0F;
        found_.assign(counts_.directions, 0.0F);
        executor_->run(counts_.directions, [&](std::size_t i) {
            std::vector<std::uint8_t> covered(counts_.each, 0);
            std::vector<std::size_t> asked;
            std::vector<SurfaceRay> rays;
            std::vector<SurfaceHit> hits;
            for (const Neighbour& neighbour : neighbours_) {
                asked.clear();
                rays.clear();
                for (std::size_t k = 0; k < counts_.each; ++k) {
                    const SurfaceRay ray = neighbour.ray(oblique_.rays[i * counts_.each + k]);
                    const Chord chord = chord_of(ray, boxes_.front());
                    const bool inside =
                        chord.enter <= std::min(chord.leave, 1.0F) && chord.leave >= 0.0F;
                    if (covered[k] == 0 && inside) {
                        asked.push_back(k);
                        rays.push_back(ray);
                    }
                }
                hits.resize(rays.size());
                sampler.cast(item, rays, spacing, hits);
                for (std::size_t k = 0; k < hits.size(); ++k) {
                    covered[asked[k]] = hits[k].t <= 1.0F ? 1 : 0;
                }
            }
            const auto sum = std::count(covered.begin(), covered.end(), std::uint8_t{1});
            found_[i] = static_cast<float>(sum) / static_cast<float>(counts_.each);
        });
    }

    /// Those of the next level, whose cells are shown with the leaves above them.
    /// @param factors of the levels above; grows
    void
    add_factors(const std::vector<std::uint8_t>& depths, std::vector<LevelFactors>& factors) const {
        const auto depth = static_cast<std::uint8_t>(factors.size());
        factors.emplace_back().fill(1.0F);
        std::vector<float> wanted(counts_.directions); // factor along each direction
        std::vector<float> modelled(counts_.directions);
        executor_->run(counts_.directions, [&](std::size_t i) {
            const MetCells met = find_met(i, depth);
            const auto covered_by = [&](float factor) {
                return covered(i, met, [&](std::uint32_t cell, const glm::vec3& direction) {
                    if (is_sheet(tree_->gains[cell])) {
                        return 1.0F;
                    }
                    return depths[cell] == depth
                               ? factor
                               : level_factor(factors[depths[cell]], direction, scale_);
                });
            };
            // As if all that is covered were behind each other: nearer to it each time.
            constexpr int kRounds = 3;
            constexpr float kLeastPassed = 1e-3F;
            const auto depth_of = [&](float share) {
                return -std::log(std::max(1.0F - share, kLeastPassed));
            };
            modelled[i] = covered_by(1.0F);
            wanted[i] = 1.0F;
            float share = modelled[i];
            for (int round = 0; share > 0.0F && round < kRounds; ++round) {
                share = round == 0 ? share : covered_by(wanted[i]);
                wanted[i] = std::clamp(
                    wanted[i] * depth_of(found_[i]) / depth_of(share),
                    kLeastLevelFactor,
                    kMostLevelFactor
                );
            }
        });
        factors.back() = nearest(wanted, modelled);
    }

    /// Share of the silhouette that cells cover.
    template <typename Factor>
    [[nodiscard]] float
    covered(std::size_t direction, const MetCells& met, const Factor& factor_of) const {
        float hidden = 0.0F;
        std::size_t next = 0;
        for (const std::uint32_t end : met.ends) {
            float through = 1.0F;
            for (; next < end; ++next) {
                const std::uint32_t cell = met.cells[next].cell;
                const glm::vec3 along = neighbours_[met.cells[next].neighbour].rotation *
                                        oblique_.directions[direction];
                through *= 1.0F - alpha_along(
                                      tree_->cubes[cell],
                                      extent(boxes_[cell]),
                                      along,
                                      gain_of(tree_->gains[cell]),
                                      factor_of(cell, along)
                                  );
            }
            hidden += 1.0F - through;
        }
        return hidden / static_cast<float>(met.ends.size());
    }

    /// In the mean over all that stands there.
    [[nodiscard]] LevelFactors weights_of(const glm::vec3& direction) const noexcept {
        LevelFactors sum{};
        for (const Neighbour& neighbour : neighbours_) {
            const LevelFactors weights = level_weights(neighbour.rotation * direction, scale_);
            for (std::size_t i = 0; i < sum.size(); ++i) {
                sum[i] += weights[i] / static_cast<float>(neighbours_.size());
            }
        }
        return sum;
    }

    /// The six factors whose values along all directions are nearest to those wanted, by least
    /// squares. A direction counts as much as its rays say: what is covered by about half says
    /// most.
    [[nodiscard]] LevelFactors
    nearest(const std::vector<float>& wanted, const std::vector<float>& modelled) const {
        constexpr std::size_t kUnknown = std::tuple_size_v<LevelFactors>;
        // A thousandth of all directions says 1: what few of them tell of is not far from it.
        constexpr double kUnchanged = 0.001;
        std::array<std::array<double, kUnknown + 1>, kUnknown> rows{};
        double all = 0.0;
        for (std::size_t i = 0; i < wanted.size(); ++i) {
            const LevelFactors weights = weights_of(oblique_.directions[i]);
            const double says = double{modelled[i]} * (1.0 - double{modelled[i]});
            all += says;
            for (std::size_t row = 0; row < kUnknown; ++row) {
                const double part = says * double{weights[row]};
                for (std::size_t column = 0; column < kUnknown; ++column) {
                    rows[row][column] += part * double{weights[column]};
                }
                rows[row][kUnknown] += part * double{wanted[i]};
            }
        }
        const double unchanged = kUnchanged * all + std::numeric_limits<double>::min();
        for (std::size_t row = 0; row < kUnknown; ++row) {
            rows[row][row] += unchanged;
            rows[row][kUnknown] += unchanged;
        }
        // Symmetric and positive definite, so no pivots are sought.
        for (std::size_t pivot = 0; pivot < kUnknown; ++pivot) {
            for (std::size_t row = 0; row < kUnknown; ++row) {
                const double times = rows[row][pivot] / rows[pivot][pivot];
                for (std::size_t column = pivot; row != pivot && column <= kUnknown; ++column) {
                    rows[row][column] -= times * rows[pivot][column];
                }
            }
        }
        LevelFactors result{};
        for (std::size_t i = 0; i < kUnknown; ++i) {
            const double value = rows[i][kUnknown] / rows[i][i];
            result[i] = std::clamp(static_cast<float>(value), kLeastLevelFactor, kMostLevelFactor);
        }
        return result;
    }

    /// Cells that rays of a direction meet.
    [[nodiscard]] MetCells find_met(std::size_t direction, std::uint8_t depth) const {
        // Of rays that meet many cells, fewer say as much.
        constexpr std::size_t kEnough = std::size_t{1} << 12U;
        constexpr std::size_t kFewest = 256;
        struct Open {
            std::uint32_t cell;
            std::uint8_t depth;
        };
        MetCells met;
        std::vector<Open> open;
        for (std::size_t i = 0; i < counts_.each; ++i) {
            if (i >= kFewest && met.cells.size() >= kEnough) {
                break;
            }
            // In another order than they were aimed in, so that any of them are everywhere.
            constexpr std::size_t kStride = 997;
            const std::size_t place = i * kStride % counts_.each;
            for (std::uint32_t k = 0; k < neighbours_.size(); ++k) {
                const SurfaceRay ray =
                    neighbours_[k].ray(oblique_.rays[direction * counts_.each + place]);
                open.push_back({0, 0});
                while (!open.empty()) {
                    const Open at = open.back();
                    open.pop_back();
                    const Chord chord = chord_of(ray, boxes_[at.cell]);
                    if (chord.enter > std::min(chord.leave, 1.0F) || chord.leave < 0.0F) {
                        continue;
                    }
                    const CubeCell& cell = tree_->cells[at.cell];
                    if (cell.octants == 0 || at.depth == depth) {
                        // What is partly beyond the ends counts half of the time.
                        const float middle = 0.5F * (chord.enter + chord.leave);
                        if (middle >= 0.0F && middle <= 1.0F) {
                            met.cells.push_back({at.cell, k});
                        }
                        continue;
                    }
                    for (std::uint32_t child = 0; child < child_count(cell); ++child) {
                        open.push_back({cell.first + child, static_cast<std::uint8_t>(at.depth + 1)}
                        );
                    }
                }
            }
            met.ends.push_back(static_cast<std::uint32_t>(met.cells.size()));
        }
        return met;
    }

    const ColorCubeTree* tree_;
    Executor* executor_;
    ObliqueCounts counts_;
    std::vector<Box3f> boxes_;
    glm::vec3 scale_;
    std::vector<Neighbour> neighbours_;
    ObliqueRays oblique_;
    std::vector<float> found_; ///< share of the silhouette, by direction
};

} // namespace

void fit_level_factors(
    const SurfaceSampler& sampler,
    ItemId item,
    std::span<const CubeReference> places,
    const ColorCubeOptions& options,
    Executor& executor,
    ColorCubeTree& tree
) {
    tree.level_factors = LevelFitter(sampler, item, places, options, executor, tree).fit();
}

} // namespace farfield::image
