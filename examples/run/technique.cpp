#include "run/technique.hpp"

#include <farfield/eval/cost_model_file.hpp>
#include <farfield/gpu/calibrate.hpp>

#include <algorithm>
#include <array>
#include <span>
#include <string_view>
#include <utility>

namespace farfield::run {

namespace {

Result<void>
check_name(const char* what, const std::string& name, std::span<const std::string_view> known) {
    if (std::find(known.begin(), known.end(), name) != known.end()) {
        return {};
    }
    std::string names;
    for (const std::string_view one : known) {
        names += (names.empty() ? "" : ", ") + std::string(one);
    }
    return fail(
        ErrorCode::invalid_argument,
        std::string(what) + " \"" + name + "\" does not exist, expected one of " + names
    );
}

/// The model of a file, one measured now, or the stored one.
Result<CostModel>
choose_cost_model(const World& world, const RunOptions& options, Backend& backend) {
    if (options.cost_model.empty()) {
        return options.backend == "embree" ? ray_casting_costs() : CostModel{};
    }
    if (options.cost_model == "measure") {
        return gpu::calibrate(
            backend,
            world.hierarchy,
            std::span(world.item_primitives).first(static_cast<std::size_t>(world.instances))
        );
    }
    return eval::load_cost_model(options.cost_model);
}

/// What the preset and the options beside it come to.
ImageCacheOptions cache_options(const RunOptions& options) {
    ImageCacheOptions cache = options.preset == "schaufler1996"
                                  ? presets::schaufler1996(options.cache)
                                  : presets::shade1996(options.cache);
    cache.validity = options.validity.value_or(cache.validity);
    cache.orientation = options.orientation.value_or(cache.orientation);
    cache.policy = options.policy.value_or(cache.policy);
    return cache;
}

LodSpriteOptions sprite_options(const RunOptions& options) {
    LodSpriteOptions sprite = options.sprite;
    sprite.error_px = options.cache.error_px;
    if (options.preset == "chen1999") {
        sprite = presets::chen1999(sprite);
    } else if (options.preset == "guaranteed-sprite") {
        sprite = presets::guaranteed_sprite(sprite);
    }
    sprite.criterion = options.criterion.value_or(sprite.criterion);
    return sprite;
}

} // namespace

const Names<ImageValidity>& validity_names() {
    static const Names<ImageValidity> names = {
        {"angle", ImageValidity::angle},
        {"zone", ImageValidity::zone},
        {"impostor-angles", ImageValidity::impostor_angles},
        {"bound", ImageValidity::bound}};
    return names;
}

const Names<ImageOrientation>& orientation_names() {
    static const Names<ImageOrientation> names = {
        {"view-aligned", ImageOrientation::view_aligned},
        {"facing-eye", ImageOrientation::facing_eye}};
    return names;
}

const Names<ImagePolicy>& policy_names() {
    static const Names<ImagePolicy> names = {
        {"amortized", ImagePolicy::amortized},
        {"whenever-possible", ImagePolicy::whenever_possible}};
    return names;
}

const Names<QuadDepth>& depth_names() {
    static const Names<QuadDepth> names = {
        {"none", QuadDepth::none}, {"plane", QuadDepth::plane}, {"texel", QuadDepth::texel}};
    return names;
}

const Names<SurfacePlacement>& surface_names() {
    static const Names<SurfacePlacement> names = {
        {"automatic", SurfacePlacement::automatic},
        {"in-images", SurfacePlacement::in_images},
        {"first", SurfacePlacement::first}};
    return names;
}

const Names<CubeDrawing>& cube_drawing_names() {
    static const Names<CubeDrawing> names = {
        {"splats", CubeDrawing::splats}, {"faces", CubeDrawing::faces}};
    return names;
}

const Names<CubeSheets>& cube_sheet_names() {
    static const Names<CubeSheets> names = {
        {"blended", CubeSheets::blended}, {"opaque", CubeSheets::opaque}};
    return names;
}

const Names<CubeColors>& cube_color_names() {
    static const Names<CubeColors> names = {
        {"sampled", CubeColors::sampled}, {"composed", CubeColors::composed}};
    return names;
}

const Names<SpriteCriterion>& criterion_names() {
    static const Names<SpriteCriterion> names = {
        {"rms", SpriteCriterion::rms}, {"largest", SpriteCriterion::largest}};
    return names;
}

Result<void> validate(const RunOptions& options) {
    constexpr std::array<std::string_view, 6> kTechniques = {
        "geometry", "mesh-lod", "image-cache", "color-cubes", "lod-sprite", "placement"};
    constexpr std::array<std::string_view, 4> kPresets = {
        "shade1996", "schaufler1996", "chen1999", "guaranteed-sprite"};
    constexpr std::array<std::string_view, 2> kLevels = {"collapse", "cluster"};
    constexpr std::array<std::string_view, 3> kBackends = {"opengl", "embree", "null"};
    if (auto known = check_name("technique", options.technique, kTechniques); !known) {
        return known;
    }
    if (auto known = check_name("preset", options.preset, kPresets); !known) {
        return known;
    }
    const bool of_sprites = options.preset == "chen1999" || options.preset == "guaranteed-sprite";
    if (of_sprites && options.technique != "lod-sprite") {
        return fail(
            ErrorCode::invalid_argument,
            "preset \"" + options.preset + "\" is one of lod-sprite, not of " + options.technique
        );
    }
    if (auto known = check_name("levels", options.levels, kLevels); !known) {
        return known;
    }
    return check_name("backend", options.backend, kBackends);
}

Result<void> prepare(World& world, const RunOptions& options) {
    if (options.technique != "lod-sprite" || !world.pairs.empty()) {
        return {};
    }
    auto pairs = make_proxies(world, options.proxy);
    if (!pairs) {
        return tl::unexpected(std::move(pairs).error());
    }
    world.pairs = std::move(*pairs);
    return {};
}

Result<Technique>
Technique::create(const World& world, const RunOptions& options, Backend& backend) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    Technique technique;
    technique.options_ = options;
    if (options.technique == "geometry") {
        technique.geometry_ = std::make_unique<CulledGeometry>(world.hierarchy);
        return technique;
    }
    if (options.technique == "mesh-lod") {
        const LodTable& table = options.levels == "collapse" ? world.collapsed : world.clustered;
        // Pixels become angles as for images, or the two would promise different things.
        const ImageCacheOptions cache = presets::shade1996(options.cache);
        auto made = MeshLod::create(
            world.hierarchy, table, {.error_px = cache.error_px, .conversion = cache.conversion}
        );
        if (!made) {
            return tl::unexpected(made.error());
        }
        technique.levels_ = std::make_unique<MeshLod>(std::move(*made));
        return technique;
    }
    if (options.technique == "placement") {
        auto placed = place_images(world, options.placement);
        if (!placed) {
            return tl::unexpected(std::move(placed).error());
        }
        technique.placed_ = std::make_unique<PlacedWorld>(std::move(*placed));
        auto made = ImagePlacement::create(
            world.hierarchy, technique.placed_->map, *technique.placed_->images, options.placed
        );
        if (!made) {
            return tl::unexpected(std::move(made).error());
        }
        technique.placement_ = std::make_unique<ImagePlacement>(std::move(*made));
        return technique;
    }
    const auto costs = choose_cost_model(world, options, backend);
    if (!costs) {
        return tl::unexpected(costs.error());
    }
    technique.costs_ = *costs;
    if (options.technique == "color-cubes") {
        auto model = make_color_cubes(world, options.cube_model);
        if (!model) {
            return tl::unexpected(std::move(model).error());
        }
        technique.cube_model_ = std::make_unique<CubeModel>(std::move(*model));
        ColorCubesOptions cubes = options.cubes;
        cubes.costs = *costs;
        auto made = ColorCubes::create(world.hierarchy, technique.cube_model_->model, cubes);
        if (!made) {
            return tl::unexpected(std::move(made).error());
        }
        technique.cubes_ = std::make_unique<ColorCubes>(std::move(*made));
        return technique;
    }
    if (options.technique == "lod-sprite") {
        LodSpriteOptions sprite = sprite_options(options);
        sprite.costs = *costs;
        sprite.image_budget_bytes = options.budget_mib << 20U;
        sprite.keyframe_samples = options.cache.image_samples;
        auto made = LodSprite::create(world.hierarchy, world.pairs, sprite);
        if (!made) {
            return tl::unexpected(std::move(made).error());
        }
        technique.sprite_ = std::make_unique<LodSprite>(std::move(*made));
        technique.sprite_options_ = sprite;
        return technique;
    }
    ImageCacheOptions cache = cache_options(options);
    cache.costs = *costs;
    cache.frame_samples = options.samples;
    cache.image_budget_bytes = options.budget_mib << 20U;
    auto made = ImageCache::create(world.hierarchy, cache);
    if (!made) {
        return tl::unexpected(made.error());
    }
    technique.cache_ = std::make_unique<ImageCache>(std::move(*made));
    technique.cache_options_ = cache;
    return technique;
}

Planner Technique::planner() const {
    Planner planner;
    if (geometry_) {
        planner.plan = [geometry = geometry_.get()](const View& view, const Motion& /*motion*/)
            -> const FramePlan& { return geometry->plan(view); };
    } else if (levels_) {
        planner.plan = [levels = levels_.get()](const View& view, const Motion& /*motion*/)
            -> const FramePlan& { return levels->plan(view); };
    } else if (cubes_) {
        planner.plan =
            [cubes = cubes_.get()](const View& view, const Motion& /*motion*/) -> const FramePlan& {
            return cubes->plan(view);
        };
    } else if (placement_) {
        planner.plan = [placement = placement_.get()](
                           const View& view, const Motion& motion
                       ) -> const FramePlan& { return placement->plan(view, motion); };
    } else if (sprite_) {
        planner.plan = [sprite = sprite_.get()](
                           const View& view, const Motion& motion
                       ) -> const FramePlan& { return sprite->plan(view, motion); };
        planner.keyframes = [sprite = sprite_.get()]() -> const LodSpriteStatistics& {
            return sprite->statistics();
        };
    } else {
        planner.plan = [cache = cache_.get()](
                           const View& view, const Motion& motion
                       ) -> const FramePlan& { return cache->plan(view, motion); };
        planner.statistics = [cache = cache_.get()]() -> const ImageCacheStatistics& {
            return cache->statistics();
        };
    }
    return planner;
}

std::optional<double> Technique::promise_px() const noexcept {
    if (sprite_ && sprite_options_.guaranteed) {
        return sprite_options_.error_px;
    }
    return cache_ ? std::optional(cache_options_.error_px) : std::nullopt;
}

void Technique::add_to_report(RunReport& report) const {
    report.technique = options_.technique;
    const bool of_sprites = options_.preset == "chen1999" || options_.preset == "guaranteed-sprite";
    report.preset = cache_ || (sprite_ && of_sprites) ? options_.preset
                    : levels_                         ? options_.levels
                                                      : "";
    report.backend = options_.backend;
    if (cache_ || levels_ || sprite_) {
        report.error_px = options_.cache.error_px;
    }
    if (cubes_) {
        report.memory.hierarchy_bytes = memory_bytes(cube_model_->model);
        report.scene.build_ms = cube_model_->build_s * 1e3;
    }
    if (cache_ || cubes_ || sprite_) {
        report.cost_model = costs_;
    }
    if (cache_) {
        report.memory.image_budget_bytes = cache_options_.image_budget_bytes;
    }
    if (sprite_) {
        report.memory.image_budget_bytes = sprite_options_.image_budget_bytes;
    }
}

RunReport report_of(const World& world) {
    RunReport report;
    report.scene.name = world.scene.name;
    report.scene.triangles = world.triangles;
    report.scene.instances = world.instances;
    report.scene.build_ms = world.build_ms;
    report.scene.nodes = world.hierarchy.nodes.size();
    report.scene.depth = world.hierarchy.quality.depth;
    report.width = world.width;
    report.height = world.height;
    report.fov_deg = world.fov_deg;
    report.memory.hierarchy_bytes = memory_bytes(world.hierarchy);
    report.memory.scene_bytes = world.scene_bytes;
    return report;
}

} // namespace farfield::run
