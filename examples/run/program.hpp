#pragma once

#include "run/technique.hpp"
#include "run/world.hpp"
#include <farfield/core/result.hpp>

#include <CLI/CLI.hpp>

#include <functional>
#include <optional>
#include <string>
#include <vector>

/// What the programs do alike around their work.
namespace farfield::run {

/// Adds the options that say which scene is seen how large: --scene, --size, --movers, --up,
/// --path, and the parameters of every scene of the catalogue.
void add_scene_options(CLI::App& app, WorldOptions& options);

/// Adds the options that say how the scene is cut: --partition, and what a BSP, a k-d tree and an
/// octree leave open. Those of another partition than the chosen one are refused.
void add_partition_options(CLI::App& app, WorldOptions& options);

/// Adds the options that say how an image cache decides: --validity, --orientation and --policy in
/// place of the preset's, --surfaces, --quad-depth, --all-around.
void add_axis_options(CLI::App& app, RunOptions& options);

/// Adds the options that say how colour cubes are built and drawn: --cell-px, --cube-drawing,
/// --cube-sheets, --always-cubes, --cube-colors, --cube-rays, --cube-shared-rays, --cube-cost,
/// --min-shared, --cubes.
void add_cube_options(CLI::App& app, RunOptions& options);

/// Adds the options that say how LOD-sprites are built and shown: --proxy, --coarse,
/// --coarse-triangles, --criterion, --paper-theta, --guaranteed, --own-share, --max-texel-px,
/// --whole-triangles, --keyframes, --keyframes-shown, --keyframe-margin, --predict-frames,
/// --keyframe-tiles, --refine, --refine-share, --max-triangles, --always-keyframes.
void add_sprite_options(CLI::App& app, RunOptions& options);

/// Adds the options that say how images are placed: --budget, --target, --grid, --max-level,
/// --cell-depth, --clearance, --lookahead, --texels, --max-pitch-deg, --eyes, --construction-views.
void add_placement_options(CLI::App& app, PlacementSetup& setup);

/// Adds an option that takes one of the named values. CLI11 itself would print the values beside
/// the names: bytes that no terminal should get.
/// @param names outlives the app
template <typename Stored, typename Value>
void add_names(
    CLI::App& app, const char* flag, Stored& stored, const Names<Value>& names, const char* help
) {
    std::vector<std::string> known;
    for (const auto& [name, value] : names) {
        known.push_back(name);
    }
    app.add_option_function<std::string>(
           flag, [&stored, &names](const std::string& name) { stored = names.at(name); }, help
    )
        ->check(CLI::IsMember(known));
}

/// Makes a folder, and those above it. An empty name makes none.
[[nodiscard]] Result<void> make_folder(const std::string& folder);

/// File of one frame: OUT/KIND_00012.png.
[[nodiscard]] std::string frame_file(const std::string& out, const std::string& kind, int frame);

/// A bar on standard error that fills as the frames go; nothing where that is no terminal.
/// @param name of what goes, before the bar @param seconds_left as far as that is known
void print_progress(
    const std::string& name, int frame, int frames, std::optional<double> seconds_left = {}
);

/// Keeps memory that was freed. llvmpipe gives its own back after every frame and asks for it
/// again; that would be timed.
void keep_freed_memory();

/// What a program does: adds its options, has the command line parsed, and does the work.
using Program = Result<void> (*)(CLI::App& app, const std::function<void()>& parse);

/// Runs it. Errors go to standard error under the program's name.
/// @return status of the program: 0, 1 where the work failed, 2 for a wrong command line
[[nodiscard]] int run_program(
    const char* name, const char* description, int argc, char** argv, Program program
) noexcept;

} // namespace farfield::run
