#include "image/cube_cells.hpp"
#include "image/cube_colors.hpp"
#include "image/cube_levels.hpp"
#include <farfield/image/build_color_cubes.hpp>
#include <farfield/math/box3.hpp>

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace farfield {

namespace {

using image::CellContents;
using image::Triangle3f;

/// How far a placement may be from a similarity, relative to its scale: what it shows is off by as
/// much, a thousandth of the 1e-3 that a thousand pixels would show.
constexpr double kSimilar = 1e-6;
/// Light that falls from closer than this is the same. [rad]
constexpr float kSameLight = 1e-3F;
/// Numbers of contents leave the highest bit free.
constexpr std::uint64_t kMostContents = ColorCubeTree::kLast;

tl::unexpected<Error> refused(std::string what) {
    return fail(ErrorCode::invalid_argument, "colour cubes: " + std::move(what));
}

tl::unexpected<Error> bad(std::string what) {
    return fail(ErrorCode::bad_data, "colour cubes: " + std::move(what));
}

std::string text(const Box3d& box) {
    std::string result;
    for (const double value : {box.lo.x, box.lo.y, box.lo.z, box.hi.x, box.hi.y, box.hi.z}) {
        result += (result.empty() ? "" : " ") + std::to_string(value);
    }
    return result;
}

std::string text(const Triangle3d& triangle) {
    return text(Box3d{triangle[0], triangle[1]}) + " " + std::to_string(triangle[2].x) + " " +
           std::to_string(triangle[2].y) + " " + std::to_string(triangle[2].z);
}

/// Corner by corner: boxes around triangles lose what is no number.
bool is_finite(const Triangle3d& triangle) noexcept {
    return std::all_of(triangle.begin(), triangle.end(), [](const glm::dvec3& corner_at) {
        return std::isfinite(corner_at.x) && std::isfinite(corner_at.y) &&
               std::isfinite(corner_at.z);
    });
}

Result<void> check(const ColorCubeOptions& options) {
    const auto outside = [](const char* name, auto value, const char* range) {
        return refused(std::string(name) + " is " + std::to_string(value) + ", expected " + range);
    };
    if (!(options.cube_cost > 0.0 && options.cube_cost <= 1e6)) {
        return outside("cube_cost", options.cube_cost, "(0, 1e6]");
    }
    if (options.max_depth > 20) {
        return outside("max_depth", options.max_depth, "[0, 20]");
    }
    if (options.max_copies < 1 || options.max_copies > 1024) {
        return outside("max_copies", options.max_copies, "[1, 1024]");
    }
    if (options.rays < 1 || options.rays > 64) {
        return outside("rays", options.rays, "[1, 64]");
    }
    if (options.colors > CubeColors::composed) {
        return outside("colors", static_cast<unsigned>(options.colors), "sampled or composed");
    }
    if (options.shared_rays > 1'000'000'000) {
        return outside("shared_rays", options.shared_rays, "[0, 1e9]");
    }
    if (options.max_light_sets < 1 || options.max_light_sets > 64) {
        return outside("max_light_sets", options.max_light_sets, "[1, 64]");
    }
    return {};
}

/// A placement taken apart.
struct Similarity {
    double scale = 1.0;
    glm::dmat3 rotation{1.0};
    glm::dvec3 translation{0.0};
};

Result<Similarity> similarity(std::size_t item, const glm::dmat4x3& matrix) {
    Similarity result;
    const glm::dmat3 linear(matrix[0], matrix[1], matrix[2]);
    result.translation = matrix[3];
    result.scale = std::cbrt(glm::determinant(linear));
    const glm::dmat3 square = glm::transpose(linear) * linear;
    // Scales are kept in float.
    bool similar =
        result.scale >= double{std::numeric_limits<float>::min()} &&
        result.scale <= double{std::numeric_limits<float>::max()} &&
        std::isfinite(result.translation.x + result.translation.y + result.translation.z);
    for (int column = 0; similar && column < 3; ++column) {
        for (int row = 0; row < 3; ++row) {
            const double expected = column == row ? result.scale * result.scale : 0.0;
            similar = similar && std::abs(square[column][row] - expected) <=
                                     kSimilar * result.scale * result.scale;
        }
    }
    if (!similar) {
        return bad(
            "placement of item " + std::to_string(item) + " has the columns " +
            text(Box3d{linear[0], linear[1]}) + " " + std::to_string(linear[2].x) + " " +
            std::to_string(linear[2].y) + " " + std::to_string(linear[2].z) +
            ", expected a rotation with one positive scale"
        );
    }
    result.rotation = linear / result.scale;
    return result;
}

/// The cube around a box, a little larger so that rounding loses nothing.
void set_cube(ColorCubeTree& tree, const Box3f& box) noexcept {
    constexpr float kMargin = 1e-5F;
    const glm::vec3 size = extent(box);
    const glm::vec3 middle = center(box);
    const float magnitude = std::max(
        {std::abs(middle.x), std::abs(middle.y), std::abs(middle.z), size.x, size.y, size.z, 1e-9F}
    );
    tree.edge = std::max({size.x, size.y, size.z}) + magnitude * kMargin;
    tree.lo = middle - tree.edge * 0.5F;
}

Result<void> check_cube(const ColorCubeTree& tree) {
    const glm::vec3 far = tree.lo + tree.edge;
    if (!std::isfinite(far.x) || !std::isfinite(far.y) || !std::isfinite(far.z)) {
        return bad(
            "a tree of " + std::to_string(tree.edge) +
            " m around what is there is too large for "
            "float"
        );
    }
    return {};
}

class Builder {
  public:
    Builder(
        const ColorCubeInput& input,
        const SurfaceSampler& sampler,
        const ColorCubeOptions& options,
        Executor& executor
    ) noexcept
        : input_(&input), sampler_(&sampler), options_(&options), executor_(&executor) {}

    Result<ColorCubeModel> build() {
        if (Result<void> valid = check_input(); !valid) {
            return tl::unexpected(std::move(valid).error());
        }
        Box3d world;
        for (const Object& object : input_->objects) {
            world = unite(world, object.bounds);
        }
        model_.origin = sampler_->origin();
        model_.item_count = static_cast<std::uint32_t>(input_->objects.size());
        const glm::vec3 light = input_->light.to_light;
        to_light_ = glm::normalize(light);
        if (Result<void> added = add_references(); !added) {
            return tl::unexpected(std::move(added).error());
        }
        if (Result<void> added = add_prototypes(); !added) {
            return tl::unexpected(std::move(added).error());
        }
        if (Result<void> added = add_scene(local_box(world, model_.origin)); !added) {
            return tl::unexpected(std::move(added).error());
        }
        return std::move(model_);
    }

  private:
    [[nodiscard]] Result<void> check_input() const;
    /// As published cells are shown whole.
    void set_bounds(ColorCubeTree& tree, const Box3f& box) const noexcept {
        if (options_->colors == CubeColors::sampled) {
            tree.bounds = box;
        }
    }
    Result<void> add_references();
    Result<void> add_prototypes();
    Result<void> add_scene(const Box3f& world);
    void
    choose_lights(const std::vector<std::uint32_t>& references, std::vector<glm::vec3>& lights);
    [[nodiscard]] bool is_reference(std::size_t item) const noexcept {
        return item < input_->placements.size() && input_->placements[item].prototype != UINT32_MAX;
    }

    const ColorCubeInput* input_;
    const SurfaceSampler* sampler_;
    const ColorCubeOptions* options_;
    Executor* executor_;
    glm::vec3 to_light_{0.0F, 1.0F, 0.0F};
    ColorCubeModel model_;
};

Result<void> Builder::check_input() const {
    if (Result<void> valid = check(*options_); !valid) {
        return valid;
    }
    const ColorCubeInput& input = *input_;
    if (input.objects.empty()) {
        return bad("there are no objects");
    }
    std::uint64_t contents = 0;
    for (std::size_t i = 0; i < input.objects.size(); ++i) {
        const Object& object = input.objects[i];
        if (is_empty(object.bounds) || !is_finite(object.bounds)) {
            return bad("box of object " + std::to_string(i) + " is " + text(object.bounds));
        }
        contents += object.splittable && !is_reference(i) ? object.primitives : 1;
        if (object.splittable && !is_reference(i) && !input.triangle) {
            return refused(
                "object " + std::to_string(i) + " is splittable, but no triangles are told"
            );
        }
    }
    if (contents == 0) {
        return bad("no object has a primitive");
    }
    if (contents >= kMostContents) {
        return bad(
            std::to_string(contents) + " primitives, at most " + std::to_string(kMostContents - 1)
        );
    }
    if (!input.placements.empty() && input.placements.size() != input.objects.size()) {
        return refused(
            std::to_string(input.placements.size()) + " placements of " +
            std::to_string(input.objects.size()) + " objects"
        );
    }
    for (std::size_t i = 0; i < input.prototypes.size(); ++i) {
        const CubePrototype& prototype = input.prototypes[i];
        const std::string name = "prototype " + std::to_string(i);
        if (index_of(prototype.item) >= input.objects.size()) {
            return refused(
                name + " is sampled as item " + std::to_string(index_of(prototype.item))
            );
        }
        if (prototype.primitives == 0 || prototype.primitives >= (1U << 30U)) {
            return bad(name + " has " + std::to_string(prototype.primitives) + " primitives");
        }
        if (is_empty(prototype.bounds) || !is_finite(prototype.bounds)) {
            return bad("box of " + name + " is " + text(prototype.bounds));
        }
        if (!input.prototype_triangle) {
            return refused("there are prototypes, but none of their triangles are told");
        }
    }
    for (std::size_t i = 0; i < input.placements.size(); ++i) {
        const std::uint32_t prototype = input.placements[i].prototype;
        if (prototype != UINT32_MAX && prototype >= input.prototypes.size()) {
            return refused(
                "placement of item " + std::to_string(i) + " has prototype " +
                std::to_string(prototype) + " of " + std::to_string(input.prototypes.size())
            );
        }
    }
    const glm::dvec3 origin = sampler_->origin();
    if (!std::isfinite(origin.x) || !std::isfinite(origin.y) || !std::isfinite(origin.z)) {
        return refused("origin of the sampler is " + text(Box3d{origin, origin}));
    }
    const glm::vec3& light = input.light.to_light;
    const float length = glm::length(light);
    if (!(length > 0.0F) || !std::isfinite(length) || !(input.light.ambient >= 0.0F) ||
        !(input.light.ambient <= 1.0F)) {
        return refused(
            "light from " + std::to_string(light.x) + " " + std::to_string(light.y) + " " +
            std::to_string(light.z) + ", ambient " + std::to_string(input.light.ambient)
        );
    }
    return {};
}

Result<void> Builder::add_references() {
    for (std::size_t i = 0; i < input_->placements.size(); ++i) {
        if (!is_reference(i)) {
            continue;
        }
        const Result<Similarity> placed = similarity(i, input_->placements[i].object_to_world);
        if (!placed) {
            return tl::unexpected(placed.error());
        }
        CubeReference reference;
        reference.item = make_id<ItemId>(i);
        reference.tree = input_->placements[i].prototype;
        reference.scale = static_cast<float>(placed->scale);
        reference.rotation = glm::mat3(placed->rotation);
        reference.translation = local_point(placed->translation, model_.origin);
        model_.references.push_back(reference);
    }
    return {};
}

/// Sets of light that are as far apart as they can be: the first, then always the farthest from
/// those chosen.
void Builder::choose_lights(
    const std::vector<std::uint32_t>& references, std::vector<glm::vec3>& lights
) {
    std::vector<glm::vec3> seen;
    seen.reserve(references.size());
    for (const std::uint32_t reference : references) {
        seen.push_back(glm::transpose(model_.references[reference].rotation) * to_light_);
    }
    std::vector<float> apart(seen.size(), std::numeric_limits<float>::infinity());
    std::size_t farthest = 0;
    while (lights.size() < options_->max_light_sets) {
        const auto set = static_cast<std::uint32_t>(lights.size());
        lights.push_back(seen.empty() ? to_light_ : seen[farthest]);
        farthest = 0;
        for (std::size_t i = 0; i < seen.size(); ++i) {
            const float distance = glm::distance(seen[i], lights.back());
            if (distance < apart[i]) {
                apart[i] = distance;
                model_.references[references[i]].light_set = set;
            }
            farthest = apart[i] > apart[farthest] ? i : farthest;
        }
        if (seen.empty() || apart[farthest] < kSameLight) {
            break;
        }
    }
}

Result<void> Builder::add_prototypes() {
    std::vector<std::vector<std::uint32_t>> used(input_->prototypes.size());
    for (std::size_t i = 0; i < model_.references.size(); ++i) {
        used[model_.references[i].tree].push_back(static_cast<std::uint32_t>(i));
    }
    for (std::size_t i = 0; i < input_->prototypes.size(); ++i) {
        const CubePrototype& prototype = input_->prototypes[i];
        CellContents contents;
        contents.triangles.resize(prototype.primitives);
        Box3f bounds;
        for (std::uint32_t k = 0; k < prototype.primitives; ++k) {
            const Triangle3d triangle =
                input_->prototype_triangle(static_cast<std::uint32_t>(i), k);
            if (!is_finite(triangle)) {
                return bad(
                    "triangle " + std::to_string(k) + " of prototype " + std::to_string(i) +
                    " has the corners " + text(triangle)
                );
            }
            for (std::size_t corner_index = 0; corner_index < 3; ++corner_index) {
                contents.triangles[k][corner_index] = glm::vec3(triangle[corner_index]);
                bounds = unite(bounds, contents.triangles[k][corner_index]);
            }
        }
        ColorCubeTree tree;
        set_cube(tree, bounds);
        set_bounds(tree, bounds);
        if (Result<void> fits = check_cube(tree); !fits) {
            return fits;
        }
        tree.primitives.push_back({kNone<ItemId>, 0, prototype.primitives});
        image::divide_cells(contents, *options_, *executor_, tree);
        std::vector<glm::vec3> lights;
        choose_lights(used[i], lights);
        image::color_cells(
            *sampler_, prototype.item, lights, input_->light.ambient, *options_, *executor_, tree
        );
        if (options_->colors == CubeColors::sampled) {
            std::vector<CubeReference> places;
            places.reserve(used[i].size());
            for (const std::uint32_t reference : used[i]) {
                places.push_back(model_.references[reference]);
            }
            image::fit_level_factors(
                *sampler_, prototype.item, places, *options_, *executor_, tree
            );
        }
        model_.trees.push_back(std::move(tree));
    }
    return {};
}

Result<void> Builder::add_scene(const Box3f& world) {
    CellContents contents;
    ColorCubeTree tree;
    Box3f bounds = world;
    std::vector<float> item_costs;
    for (const CubeReference& reference : model_.references) {
        const Object& object = input_->objects[index_of(reference.item)];
        contents.references.push_back(local_box(object.bounds, model_.origin));
        contents.costs.push_back(static_cast<float>(object.primitives));
    }
    for (std::size_t i = 0; i < input_->objects.size(); ++i) {
        const Object& object = input_->objects[i];
        if (is_reference(i)) {
            continue;
        }
        if (!object.splittable) {
            tree.items.push_back(make_id<ItemId>(i));
            tree.item_primitives.push_back(
                static_cast<std::uint32_t>(std::min<std::uint64_t>(object.primitives, UINT32_MAX))
            );
            contents.items.push_back(local_box(object.bounds, model_.origin));
            item_costs.push_back(static_cast<float>(object.primitives));
            continue;
        }
        for (std::uint32_t k = 0; k < object.primitives; ++k) {
            const Triangle3d triangle = input_->triangle(static_cast<std::uint32_t>(i), k);
            if (!is_finite(triangle)) {
                return bad(
                    "triangle " + std::to_string(k) + " of object " + std::to_string(i) +
                    " has the corners " + text(triangle)
                );
            }
            Triangle3f& local = contents.triangles.emplace_back();
            for (std::size_t corner_index = 0; corner_index < 3; ++corner_index) {
                local[corner_index] = local_point(triangle[corner_index], model_.origin);
                bounds = unite(bounds, local[corner_index]);
            }
        }
    }
    contents.costs.insert(contents.costs.end(), item_costs.begin(), item_costs.end());
    tree.reference_count = static_cast<std::uint32_t>(model_.references.size());
    auto next = static_cast<std::uint32_t>(contents.references.size() + contents.items.size());
    for (std::size_t i = 0; i < input_->objects.size(); ++i) {
        if (!is_reference(i) && input_->objects[i].splittable) {
            const auto count = static_cast<std::uint32_t>(input_->objects[i].primitives);
            tree.primitives.push_back({make_id<ItemId>(i), next, count});
            next += count;
        }
    }
    if (input_->part) {
        contents.part = [&](std::size_t item, const Box3f& box) {
            const Box3d part = input_->part(
                static_cast<std::uint32_t>(index_of(tree.items[item])),
                {model_.origin + glm::dvec3(box.lo), model_.origin + glm::dvec3(box.hi)}
            );
            return is_empty(part) ? Box3f{} : local_box(part, model_.origin);
        };
    }
    set_cube(tree, bounds);
    // What is lower than wide, as woods and fields are, stands in one layer of cells: a plane
    // through the middle would make two of it.
    const float beside =
        0.25F * (tree.edge - std::max({extent(bounds).x, extent(bounds).y, extent(bounds).z}));
    tree.lo = glm::max(tree.lo, bounds.lo - beside);
    set_bounds(tree, bounds);
    if (Result<void> fits = check_cube(tree); !fits) {
        return fits;
    }
    image::divide_cells(contents, *options_, *executor_, tree);
    const std::array<glm::vec3, 1> lights = {to_light_};
    image::color_cells(
        *sampler_, kNone<ItemId>, lights, input_->light.ambient, *options_, *executor_, tree
    );
    if (options_->colors == CubeColors::sampled) {
        image::fit_level_factors(*sampler_, kNone<ItemId>, {}, *options_, *executor_, tree);
    }
    model_.trees.push_back(std::move(tree));
    return {};
}

} // namespace

Result<ColorCubeModel> build_color_cubes(
    const ColorCubeInput& input,
    const SurfaceSampler& sampler,
    const ColorCubeOptions& options,
    Executor& executor
) {
    return Builder(input, sampler, options, executor).build();
}

} // namespace farfield
