#include "run/program.hpp"

#include "scenes/scene_catalog.hpp"

#include <cstdio>
#include <exception>
#include <filesystem>
#include <malloc.h>
#include <numbers>
#include <string>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace farfield::run {

void add_scene_options(CLI::App& app, WorldOptions& options) {
    std::string names;
    // One option may be a parameter of several scenes; its help says what it is for which.
    std::map<std::string, std::string> parameters;
    for (const auto& entry : scenes::scene_catalog()) {
        names += std::string(entry.name) + ", ";
        for (const auto& parameter : entry.parameters) {
            const std::string help(parameter.help);
            std::string& all = parameters[std::string(parameter.name)];
            if (all.find(help) == std::string::npos) {
                all += (all.empty() ? "" : "; ") + std::string(entry.name) + ": " + help;
            }
        }
    }
    app.add_option("--scene", options.scene, names + "or a file");
    app.add_option("--size", options.size, "WIDTHxHEIGHT [px]");
    app.add_option("--movers", options.movers, "balloons that go round in the scene");
    app.add_option("--up", options.up, "axis that points up in a mesh file")
        ->check(CLI::IsMember({"y", "z"}));
    app.add_option("--path", options.path, "JSON file of a camera path");
    for (const auto& [name, help] : parameters) {
        app.add_option_function<double>(
            "--" + name,
            [&options, name = name](double value) { options.scene_values[name] = value; },
            help
        );
    }
}

void add_partition_options(CLI::App& app, WorldOptions& options) {
    app.add_option("--partition", options.partition, "of the scene")
        ->check(CLI::IsMember({"bsp", "kdtree", "octree"}));
    app.add_option("--directions", options.bsp.directions, "bsp: of splitting planes around up");
    app.add_flag("--split-vertically", options.bsp.split_vertically, "bsp: splits storeys as well");
    app.add_option("--max-items", options.max_items, "bsp: kept whole rather than cut one");
    app.add_option(
        "--max-piece-primitives",
        options.bsp.max_piece_primitives,
        "bsp: of split surfaces in a leaf"
    );
    app.add_option("--branching", options.cells.branching, "kdtree: boxes in a box")
        ->check(CLI::IsMember({2, 4, 8}));
    app.add_option("--max-primitives", options.cells.max_primitives, "kdtree, octree: of a leaf");
    app.add_option(
        "--max-depth", options.cells.max_depth, "kdtree, octree: levels of boxes in boxes"
    );
    app.add_option_function<float>(
        "--inflation",
        [&options](float value) {
            options.bsp.inflation = value;
            options.cells.inflation = value;
        },
        "overlap of split surfaces [fraction]"
    );
    app.parse_complete_callback([&app, &options] {
        const bool bsp = options.partition == "bsp";
        const bool kdtree = options.partition == "kdtree";
        for (const auto& [name, taken] :
             {std::pair{"--directions", bsp},
              std::pair{"--split-vertically", bsp},
              std::pair{"--max-items", bsp},
              std::pair{"--max-piece-primitives", bsp},
              std::pair{"--branching", kdtree},
              std::pair{"--max-primitives", !bsp},
              std::pair{"--max-depth", !bsp}}) {
            if (app.count(name) > 0 && !taken) {
                throw CLI::ValidationError(name, "no option of the partition " + options.partition);
            }
        }
    });
}

void add_axis_options(CLI::App& app, RunOptions& options) {
    add_names(
        app, "--validity", options.validity, validity_names(), "when images may still be shown"
    );
    add_names(
        app, "--orientation", options.orientation, orientation_names(), "of the planes of images"
    );
    add_names(app, "--policy", options.policy, policy_names(), "which images are made");
    add_names(
        app, "--surfaces", options.cache.surfaces, surface_names(), "where split surfaces are drawn"
    );
    add_names(
        app, "--quad-depth", options.cache.quad_depth, depth_names(), "how images stand in depth"
    );
    app.add_flag(
        "--all-around", options.cache.all_around, "keeps images of what is behind the viewer"
    );
}

void add_cube_options(CLI::App& app, RunOptions& options) {
    CubeModelOptions& model = options.cube_model;
    app.add_option("--cell-px", options.cubes.cell_px, "largest colour cube on the screen [px]");
    add_names(
        app, "--cube-drawing", options.cubes.drawing, cube_drawing_names(), "how cubes are drawn"
    );
    add_names(
        app, "--cube-sheets", options.cubes.sheets, cube_sheet_names(), "how surfaces are drawn"
    );
    app.add_flag_callback(
        "--always-cubes",
        [&options] { options.cubes.never_slower = false; },
        "colour cubes even where geometry is cheaper"
    );
    add_names(
        app, "--cube-colors", model.build.colors, cube_color_names(), "where colours come from"
    );
    app.add_option("--cube-rays", model.build.rays, "rays a side of a face");
    app.add_option("--cube-shared-rays", model.build.shared_rays, "rays that leaves share");
    app.add_option("--cube-cost", model.build.cube_cost, "of drawing a cube [triangles]");
    app.add_option(
        "--min-shared", model.min_shared, "least triangles of a mesh that has its own octree"
    );
    app.add_option(
        "--cubes", model.file, "file of the colour cubes: read if it is there, else written"
    );
}

void add_sprite_options(CLI::App& app, RunOptions& options) {
    LodSpriteOptions& sprite = options.sprite;
    app.add_option("--proxy", options.proxy.proxy, "coarse models of lod-sprite")
        ->check(CLI::IsMember({"grid", "refined", "mesh"}));
    app.add_option("--coarse", options.proxy.coarse, "grid: squares a side");
    app.add_option(
        "--coarse-triangles",
        options.proxy.coarse_triangles,
        "refined: of the finest choice; mesh: of each"
    );
    add_names(
        app, "--criterion", options.criterion, criterion_names(), "what keyframes are held to"
    );
    app.add_flag("--paper-theta", sprite.paper_theta, "one turn for all samples, with rms");
    app.add_flag("--guaranteed", sprite.guaranteed, "keeps the threshold fragment by fragment");
    app.add_option("--own-share", sprite.max_own_share, "most of a picture without its keyframe");
    app.add_option("--max-texel-px", sprite.max_texel_px, "largest texel of a keyframe [px]");
    app.add_flag_callback(
        "--whole-triangles",
        [&sprite] { sprite.visibility = SpriteVisibility::triangles; },
        "triangles show a keyframe that sees all corners, or none"
    );
    app.add_option("--keyframes", sprite.max_keyframes, "most keyframes kept");
    app.add_option("--keyframes-shown", sprite.keyframes_shown, "most keyframes in a frame");
    app.add_option("--keyframe-margin", sprite.keyframe_margin, "of a keyframe's lens [factor]");
    app.add_option(
        "--predict-frames", sprite.predict_frames, "how far ahead keyframes are made [frames]"
    );
    app.add_option("--keyframe-tiles", sprite.keyframe_tiles, "frames that one is made in");
    app.add_flag("--refine", sprite.refine, "cuts coarse models anew for every frame");
    app.add_option("--refine-share", sprite.refine_share, "of the threshold, for cuts");
    app.add_option("--max-triangles", sprite.max_triangles, "of cuts");
    app.add_flag_callback(
        "--always-keyframes",
        [&sprite] { sprite.never_slower = false; },
        "keyframes even where geometry is cheaper"
    );
}

void add_placement_options(CLI::App& app, PlacementSetup& setup) {
    PlacementOptions& placement = setup.placement;
    app.add_option("--budget", placement.max_primitives, "primitives that a frame may render");
    app.add_option("--target", placement.target_primitives, "that are left where images are shown");
    app.add_option("--grid", placement.first_grid, "sites along the longest side at first");
    app.add_option("--max-level", placement.max_level, "how often a site may be halved");
    app.add_option("--cell-depth", placement.cell_depth, "steps down the hierarchy to cells");
    app.add_option("--clearance", placement.clearance, "of images from eyes [half diagonals]");
    app.add_option("--lookahead", placement.lookahead, "steps that searches look ahead");
    app.add_option("--texels", placement.texels_per_pixel, "of images for a pixel");
    app.add_option_function<double>(
        "--max-pitch-deg",
        [&placement](double degrees) { placement.max_pitch = degrees * std::numbers::pi / 180.0; },
        "that views look up or down"
    );
    app.add_option_function<std::vector<double>>(
           "--eyes",
           [&placement](const std::vector<double>& at) {
               placement.eyes = {{at[0], at[1], at[2]}, {at[3], at[4], at[5]}};
           },
           "box of eyes: x y z of its corners [m]; all of the model if not given"
    )
        ->expected(6);
    app.add_option("--construction-views", setup.making.views, "of an image: 1 or 9");
}

Result<void> make_folder(const std::string& folder) {
    if (folder.empty()) {
        return {};
    }
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) {
        return fail(
            ErrorCode::device, "cannot make the folder '" + folder + "': " + error.message()
        );
    }
    return {};
}

std::string frame_file(const std::string& out, const std::string& kind, int frame) {
    char number[16];
    std::snprintf(number, sizeof number, "_%05d.png", frame);
    return (std::filesystem::path(out) / (kind + number)).string();
}

void print_progress(
    const std::string& name, int frame, int frames, std::optional<double> seconds_left
) {
    if (isatty(STDERR_FILENO) == 0) {
        return;
    }
    constexpr int kWidth = 30;
    const int filled = frame * kWidth / frames;
    std::string left;
    if (seconds_left) {
        const auto seconds = static_cast<long>(*seconds_left);
        left = ", " + (seconds < 120 ? std::to_string(seconds) + " s left  "
                                     : std::to_string(seconds / 60) + " min left");
    }
    std::fprintf(
        stderr,
        "\r%-24s [%.*s%*s] %d/%d%s",
        name.c_str(),
        filled,
        "##############################",
        kWidth - filled,
        "",
        frame,
        frames,
        left.c_str()
    );
    if (frame == frames) {
        std::fprintf(stderr, "\n");
    }
}

void keep_freed_memory() {
    constexpr int kNever = 1 << 30;
    mallopt(M_TRIM_THRESHOLD, kNever);
    mallopt(M_MMAP_THRESHOLD, kNever);
}

int run_program(
    const char* name, const char* description, int argc, char** argv, Program program
) noexcept {
    // The library throws nothing, but its memory and the command line may.
    try {
        CLI::App app(description, name);
        Result<void> done;
        try {
            done = program(app, [&] { app.parse(argc, argv); });
        } catch (const CLI::ParseError& error) {
            return app.exit(error) == 0 ? 0 : 2;
        }
        if (done) {
            return 0;
        }
        std::fprintf(stderr, "%s: %s\n", name, done.error().message.c_str());
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s: %s\n", name, error.what());
    } catch (...) {
        std::fprintf(stderr, "%s: ended by an unknown exception\n", name);
    }
    return 1;
}

} // namespace farfield::run
