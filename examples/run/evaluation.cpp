#include "run/evaluation.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <utility>

namespace farfield::run {

namespace {

using nlohmann::json;

constexpr std::string_view kFull = R"({
 "title": "Farfield: speed against error",
 "walks": [
  {"name": "island", "scene": "island", "frames": 240, "reference_every": 24, "runs": [
   {"name": "images 0.5 px", "error_px": 0.5, "measure": true},
   {"name": "images 1 px", "error_px": 1, "measure": true},
   {"name": "images 2 px", "error_px": 2, "measure": true},
   {"name": "images 4 px", "error_px": 4, "measure": true},
   {"name": "images 8 px", "error_px": 8, "measure": true},
   {"name": "levels 2 px", "technique": "mesh-lod", "levels": "collapse", "error_px": 2},
   {"name": "clusters 0.5 px", "technique": "mesh-lod", "levels": "cluster", "error_px": 0.5},
   {"name": "clusters 2 px", "technique": "mesh-lod", "levels": "cluster", "error_px": 2},
   {"name": "clusters 8 px", "technique": "mesh-lod", "levels": "cluster", "error_px": 8},
   {"name": "rays", "technique": "geometry", "backend": "embree"},
   {"name": "rays, 16 samples", "technique": "geometry", "backend": "embree", "samples": 16},
   {"name": "rays, images 2 px", "backend": "embree", "error_px": 2, "measure": true},
   {"name": "rays, images 2 px, 16 samples", "backend": "embree", "error_px": 2,
    "samples": 16, "image_samples": 16}]},
  {"name": "island, 60 frames", "scene": "island", "frames": 60, "reference_every": 15,
   "truth_samples": 0, "runs": [{"name": "images 2 px", "error_px": 2}]},
  {"name": "island, 120 frames", "scene": "island", "frames": 120, "reference_every": 30,
   "truth_samples": 0, "runs": [{"name": "images 2 px", "error_px": 2}]},
  {"name": "island, 559 trees", "scene": "island", "parameters": {"trees": 559}, "frames": 240,
   "reference_every": 48, "truth_samples": 0, "runs": [{"name": "images 2 px", "error_px": 2}]},
  {"name": "island, 280 trees", "scene": "island", "parameters": {"trees": 280}, "frames": 240,
   "reference_every": 48, "truth_samples": 0, "runs": [{"name": "images 2 px", "error_px": 2}]},
  {"name": "island, 140 trees", "scene": "island", "parameters": {"trees": 140}, "frames": 240,
   "reference_every": 48, "truth_samples": 0, "runs": [{"name": "images 2 px", "error_px": 2}]}
 ]
})";

constexpr std::string_view kQuick = R"({
 "title": "Farfield: speed against error, in short",
 "walks": [
  {"name": "island, 300 trees", "scene": "island", "parameters": {"trees": 300}, "frames": 60,
   "reference_every": 20, "runs": [
   {"name": "images 1 px", "error_px": 1, "measure": true},
   {"name": "images 2 px", "error_px": 2, "measure": true},
   {"name": "images 8 px", "error_px": 8, "measure": true},
   {"name": "clusters 2 px", "technique": "mesh-lod", "levels": "cluster", "error_px": 2},
   {"name": "rays", "technique": "geometry", "backend": "embree"},
   {"name": "rays, images 2 px", "backend": "embree", "error_px": 2, "measure": true}]}
 ]
})";

tl::unexpected<Error> bad(const std::string& where, const std::string& message) {
    return fail(ErrorCode::bad_data, where + ": " + message);
}

/// A value for a message; nested ones are named only, since they may be nested without end.
std::string shown(const json& value) {
    const bool nested = std::any_of(value.begin(), value.end(), [](const json& child) {
        return child.is_structured();
    });
    if (value.is_structured() && nested) {
        return value.is_array() ? "a nested array" : "a nested object";
    }
    constexpr std::size_t kLongest = 40;
    std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
    return text.size() > kLongest ? text.substr(0, kLongest) + "..." : text;
}

/// Takes values out of one object, and knows at the end which keys nobody asked for. The first
/// error stays.
class Reader {
  public:
    Reader(const json& object, std::string where) : object_(&object), where_(std::move(where)) {
        if (!object.is_object()) {
            error_ = Error{
                ErrorCode::bad_data, where_ + ": is " + shown(object) + ", expected an object"};
        }
    }

    void text(const char* key, std::string& value) {
        if (const json* found = find(key)) {
            if (found->is_string()) {
                value = found->get<std::string>();
            } else {
                refuse(key, *found, "a text");
            }
        }
    }
    void flag(const char* key, bool& value) {
        if (const json* found = find(key)) {
            if (found->is_boolean()) {
                value = found->get<bool>();
            } else {
                refuse(key, *found, "true or false");
            }
        }
    }
    void number(const char* key, double& value) {
        if (const json* found = find(key)) {
            if (found->is_number()) {
                value = found->get<double>();
            } else {
                refuse(key, *found, "a number");
            }
        }
    }
    void number(const char* key, std::optional<double>& value) {
        if (object_->is_object() && object_->contains(key)) {
            value.emplace();
            number(key, *value);
        }
    }
    template <typename Integer>
    void whole(const char* key, Integer& value, Integer least, Integer most) {
        const json* found = find(key);
        if (found == nullptr) {
            return;
        }
        const double number = found->is_number() ? found->get<double>() : std::nan("");
        if (number >= static_cast<double>(least) && number <= static_cast<double>(most) &&
            number == std::floor(number)) {
            value = static_cast<Integer>(number);
        } else {
            refuse(
                key,
                *found,
                "a whole number from " + std::to_string(least) + " to " + std::to_string(most)
            );
        }
    }
    template <typename Integer>
    void whole(const char* key, std::optional<Integer>& value, Integer least, Integer most) {
        if (object_->is_object() && object_->contains(key)) {
            value.emplace();
            whole(key, *value, least, most);
        }
    }
    /// The value of a key that was asked for, or null.
    const json* find(const char* key) {
        if (error_ || !object_->is_object() || !object_->contains(key)) {
            return nullptr;
        }
        asked_.insert(key);
        return &(*object_)[key];
    }
    void refuse(const char* key, const json& value, const std::string& expected) {
        if (!error_) {
            error_ = Error{
                ErrorCode::bad_data,
                where_ + ": " + key + " is " + shown(value) + ", expected " + expected};
        }
    }
    [[nodiscard]] Result<void> done() const {
        if (error_) {
            return tl::unexpected(*error_);
        }
        for (const auto& member : object_->items()) {
            if (asked_.find(member.key()) == asked_.end()) {
                return bad(where_, "\"" + member.key() + "\" is no key of it");
            }
        }
        return {};
    }

  private:
    const json* object_;
    std::string where_;
    std::set<std::string, std::less<>> asked_;
    std::optional<Error> error_;
};

/// Reads one of the named values; `value` stays where the key is not there.
template <typename Value, typename Stored>
void read_name(Reader& reader, const char* key, const Names<Value>& names, Stored& value) {
    const json* found = reader.find(key);
    if (found == nullptr) {
        return;
    }
    std::string known;
    for (const auto& [name, meaning] : names) {
        if (found->is_string() && *found == name) {
            value = meaning;
            return;
        }
        known += (known.empty() ? "" : ", ") + name;
    }
    reader.refuse(key, *found, "one of " + known);
}

/// Keys of other techniques than the chosen one are left unread, and so refused.
void read_technique(Reader& reader, RunOptions& run) {
    constexpr std::uint32_t kMost = 1U << 30U;
    if (run.technique == "color-cubes") {
        reader.number("cell_px", run.cubes.cell_px);
        read_name(reader, "cube_drawing", cube_drawing_names(), run.cubes.drawing);
        read_name(reader, "cube_sheets", cube_sheet_names(), run.cubes.sheets);
        read_name(reader, "cube_colors", cube_color_names(), run.cube_model.build.colors);
        reader.number("cube_cost", run.cube_model.build.cube_cost);
        reader.flag("never_slower", run.cubes.never_slower);
    } else if (run.technique == "lod-sprite") {
        LodSpriteOptions& sprite = run.sprite;
        reader.text("proxy", run.proxy.proxy);
        reader.whole("coarse", run.proxy.coarse, 1U, kMost);
        reader.whole("coarse_triangles", run.proxy.coarse_triangles, 1U, kMost);
        read_name(reader, "criterion", criterion_names(), run.criterion);
        reader.flag("paper_theta", sprite.paper_theta);
        reader.flag("guaranteed", sprite.guaranteed);
        reader.number("own_share", sprite.max_own_share);
        reader.number("max_texel_px", sprite.max_texel_px);
        reader.whole("keyframes", sprite.max_keyframes, 1U, kMost);
        reader.whole("keyframes_shown", sprite.keyframes_shown, 1U, kMostKeyframes);
        reader.number("keyframe_margin", sprite.keyframe_margin);
        reader.whole("predict_frames", sprite.predict_frames, 0U, kMost);
        reader.whole("keyframe_tiles", sprite.keyframe_tiles, 1U, kMost);
        reader.flag("refine", sprite.refine);
        reader.number("refine_share", sprite.refine_share);
        reader.flag("never_slower", sprite.never_slower);
    } else if (run.technique == "placement") {
        PlacementOptions& placement = run.placement.placement;
        reader.whole("budget", placement.max_primitives, std::uint64_t{1}, std::uint64_t{1} << 53U);
        reader.whole("grid", placement.first_grid, 1U, 64U);
        reader.whole("max_level", placement.max_level, 0U, 12U);
        reader.whole("cell_depth", placement.cell_depth, 0U, 24U);
        reader.number("clearance", placement.clearance);
        reader.number("texels", placement.texels_per_pixel);
        reader.whole("construction_views", run.placement.making.views, 1U, 9U);
    }
}

Result<ComparedRun> parse_run(const json& object, const std::string& where) {
    constexpr std::int32_t kMostSamples = 64;
    constexpr std::uint64_t kMostMib = 1U << 20U;
    ComparedRun run;
    Reader reader(object, where);
    reader.text("name", run.name);
    reader.text("technique", run.options.technique);
    reader.text("preset", run.options.preset);
    reader.text("levels", run.options.levels);
    reader.text("backend", run.options.backend);
    reader.text("cost_model", run.options.cost_model);
    read_name(reader, "validity", validity_names(), run.options.validity);
    read_name(reader, "orientation", orientation_names(), run.options.orientation);
    read_name(reader, "policy", policy_names(), run.options.policy);
    read_name(reader, "surfaces", surface_names(), run.options.cache.surfaces);
    read_name(reader, "quad_depth", depth_names(), run.options.cache.quad_depth);
    reader.flag("all_around", run.options.cache.all_around);
    reader.number("error_px", run.options.cache.error_px);
    reader.whole("samples", run.options.samples, 1, kMostSamples);
    reader.whole("image_samples", run.options.cache.image_samples, 1, kMostSamples);
    reader.whole("image_budget_mib", run.options.budget_mib, std::uint64_t{0}, kMostMib);
    reader.flag("measure", run.measure);
    read_technique(reader, run.options);
    if (Result<void> done = reader.done(); !done) {
        return tl::unexpected(std::move(done).error());
    }
    if (run.name.empty()) {
        return bad(where, "no \"name\"");
    }
    if (Result<void> valid = validate(run.options); !valid) {
        return bad(where, valid.error().message);
    }
    if (run.options.backend == "null") {
        return bad(where, "the backend null draws no pictures to compare");
    }
    return run;
}

/// Keys of other partitions than the chosen one are left unread, and so refused.
void read_partition(Reader& reader, WorldOptions& world) {
    constexpr std::uint32_t kMost = 1U << 30U;
    reader.text("partition", world.partition);
    if (world.partition == "bsp") {
        reader.whole("max_items", world.max_items, 1U, kMost);
        return;
    }
    reader.whole("max_primitives", world.cells.max_primitives, 1U, kMost);
    reader.whole("max_depth", world.cells.max_depth, 0U, 64U);
    if (world.partition == "kdtree") {
        reader.whole("branching", world.cells.branching, 2U, 8U);
    }
}

Result<ComparedWalk> parse_walk(const json& object, const std::string& where) {
    constexpr int kMost = 10'000'000;
    ComparedWalk walk;
    Reader reader(object, where);
    reader.text("name", walk.name);
    reader.text("scene", walk.world.scene);
    reader.text("path", walk.world.path);
    reader.text("up", walk.world.up);
    reader.text("size", walk.world.size);
    reader.number("fov_deg", walk.world.fov_deg);
    reader.number("step_m", walk.world.step_m);
    reader.whole("frames", walk.world.frames, 1, kMost);
    reader.whole("whole_path", walk.world.whole_path, 1, kMost);
    read_partition(reader, walk.world);
    reader.whole("reference_every", walk.reference_every, 1, kMost);
    reader.whole("truth_samples", walk.truth_samples, 0, 64);
    if (const json* parameters = reader.find("parameters")) {
        if (!parameters->is_object()) {
            reader.refuse("parameters", *parameters, "an object of numbers");
        } else {
            for (const auto& [key, value] : parameters->items()) {
                if (!value.is_number()) {
                    reader.refuse(key.c_str(), value, "a number");
                    break;
                }
                walk.world.scene_values[key] = value.get<double>();
            }
        }
    }
    const json* runs = reader.find("runs");
    if (Result<void> done = reader.done(); !done) {
        return tl::unexpected(std::move(done).error());
    }
    if (walk.name.empty()) {
        return bad(where, "no \"name\"");
    }
    if (walk.world.partition != "bsp" && walk.world.partition != "kdtree" &&
        walk.world.partition != "octree") {
        return bad(
            where, "partition is \"" + walk.world.partition + "\", expected bsp, kdtree or octree"
        );
    }
    if (!walk.world.up.empty() && walk.world.up != "y" && walk.world.up != "z") {
        return bad(where, "up is \"" + walk.world.up + "\", expected y or z");
    }
    if (runs == nullptr || !runs->is_array() || runs->empty()) {
        return bad(where, "no \"runs\", expected an array of at least one");
    }
    std::set<std::string> names;
    for (std::size_t i = 0; i < runs->size(); ++i) {
        auto run = parse_run((*runs)[i], where + ".runs[" + std::to_string(i) + "]");
        if (!run) {
            return tl::unexpected(run.error());
        }
        if (!names.insert(run->name).second) {
            return bad(where, "two runs are named \"" + run->name + "\"");
        }
        // Coarse models are made once for all runs of a walk.
        const auto of_other_models = [&](const ComparedRun& other) {
            return other.options.technique == "lod-sprite" &&
                   other.options.proxy != run->options.proxy;
        };
        if (run->options.technique == "lod-sprite" &&
            std::any_of(walk.runs.begin(), walk.runs.end(), of_other_models)) {
            return bad(
                where,
                "run \"" + run->name +
                    "\" has another proxy, coarse or coarse_triangles than the one before"
            );
        }
        walk.world.levels = walk.world.levels || run->options.technique == "mesh-lod";
        walk.runs.push_back(std::move(*run));
    }
    return walk;
}

} // namespace

std::string_view built_in_evaluation(bool quick) noexcept {
    return quick ? kQuick : kFull;
}

Result<EvaluationPlan> parse_evaluation(std::string_view text, std::string_view name) {
    const std::string where(name);
    json root;
    // The parser tells line and column only by its exception; nothing leaves this function.
    try {
        root = json::parse(text);
    } catch (const json::exception& exception) {
        return bad(where, std::string("not JSON: ") + exception.what());
    }
    EvaluationPlan plan;
    Reader reader(root, where);
    reader.text("title", plan.title);
    const json* walks = reader.find("walks");
    if (Result<void> done = reader.done(); !done) {
        return tl::unexpected(std::move(done).error());
    }
    if (walks == nullptr || !walks->is_array() || walks->empty()) {
        return bad(where, "no \"walks\", expected an array of at least one");
    }
    std::set<std::string> names;
    for (std::size_t i = 0; i < walks->size(); ++i) {
        auto walk = parse_walk((*walks)[i], where + ": walks[" + std::to_string(i) + "]");
        if (!walk) {
            return tl::unexpected(walk.error());
        }
        if (!names.insert(walk->name).second) {
            return bad(where, "two walks are named \"" + walk->name + "\"");
        }
        plan.walks.push_back(std::move(*walk));
    }
    return plan;
}

Result<EvaluationPlan> load_evaluation(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) {
        return fail(ErrorCode::not_found, file.string() + " cannot be opened");
    }
    const std::string text{
        std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    return parse_evaluation(text, file.string());
}

} // namespace farfield::run
