// Draws plain geometry of one scene on two backends that share no code for it, OpenGL, which
// rasterises, and Embree, which casts rays, and compares what their pixels show. Where both agree,
// the geometry that everything else is held against is right.
#include "run/backends.hpp"
#include "run/program.hpp"
#include "run/world.hpp"
#include <farfield/eval/image_errors.hpp>
#include <farfield/eval/item_agreement.hpp>
#include <farfield/eval/log_histogram.hpp>
#include <farfield/eval/run_report.hpp>
#include <farfield/io/png.hpp>
#include <farfield/technique/culled_geometry.hpp>

#include <CLI/CLI.hpp>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace farfield;

struct Options {
    run::WorldOptions world;
    double least = 0.995;
    std::string json;
    std::string out;
};

/// What one backend shows of one frame.
struct Shown {
    Picture picture;
    PositionPicture positions;
};

/// One backend with its own target and its own plans: each plan is executed once.
struct Drawer {
    Backend* backend = nullptr;
    CulledGeometry geometry;
    TargetId target{};

    [[nodiscard]] Result<Shown> draw(const View& view, const FrameClear& clear) {
        if (auto drawn = backend->execute(geometry.plan(view), target, clear); !drawn) {
            return tl::unexpected(std::move(drawn).error());
        }
        auto picture = backend->read_target(target);
        if (!picture) {
            return tl::unexpected(std::move(picture).error());
        }
        auto positions = backend->read_positions(target);
        if (!positions) {
            return tl::unexpected(std::move(positions).error());
        }
        return Shown{std::move(*picture), std::move(*positions)};
    }
};

Result<Drawer>
make_drawer(const run::World& world, run::Backends& backends, const std::string& name) {
    const auto backend = backends.make(name, true);
    if (!backend) {
        return tl::unexpected(backend.error());
    }
    const auto target = (*backend)->create_target(world.width, world.height, 1);
    if (!target) {
        return tl::unexpected(target.error());
    }
    return Drawer{*backend, CulledGeometry(world.hierarchy), *target};
}

/// Over all frames.
struct Findings {
    ItemAgreement items;
    std::uint64_t same_pixels = 0;       ///< of `items.pixels`: the same id, borders included
    std::uint64_t coincident_pixels = 0; ///< of the settled ones that differ: in the same place
    std::vector<double> psnr_db;
    /// Between the points that both show where they agree on the item and its borders are not near.
    /// [px] In sizes of a pixel as far away as the points.
    LogHistogram points_px;
    double points_max_m = 0.0;
    std::uint64_t other_surface_pixels = 0; ///< of them, more than a pixel apart
};

/// How two pixels compare, for the picture of it.
enum class Verdict : std::uint8_t { background, equal, border, border_differs, differs };

std::size_t pixel_of(const PositionPicture& picture, int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
           static_cast<std::size_t>(x);
}

/// Whether a pixel and its neighbours show one item, as `eval::compare_items` settles it.
bool settled(const PositionPicture& picture, int x, int y) {
    const ItemId item = picture.texels[pixel_of(picture, x, y)].item;
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, picture.height - 1); ++v) {
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, picture.width - 1); ++u) {
            if (picture.texels[pixel_of(picture, u, v)].item != item) {
                return false;
            }
        }
    }
    return true;
}

Verdict judge(const PositionPicture& a, const PositionPicture& b, int x, int y) {
    const ItemId item_a = a.texels[pixel_of(a, x, y)].item;
    const ItemId item_b = b.texels[pixel_of(b, x, y)].item;
    if (item_a == kNone<ItemId> && item_b == kNone<ItemId>) {
        return Verdict::background;
    }
    if (settled(a, x, y) && settled(b, x, y)) {
        return item_a == item_b ? Verdict::equal : Verdict::differs;
    }
    return item_a == item_b ? Verdict::border : Verdict::border_differs;
}

glm::u8vec3 color_of(Verdict verdict) {
    switch (verdict) {
    case Verdict::background:
        return {16, 20, 28};
    case Verdict::equal:
        return {70, 76, 84};
    case Verdict::border:
        return {110, 116, 124};
    case Verdict::border_differs:
        return {230, 180, 60};
    case Verdict::differs:
        break;
    }
    return {255, 40, 40};
}

/// How far apart the surface points are that both backends show in one pixel.
struct Apart {
    double m = 0.0;
    double px = 0.0; ///< in sizes of a pixel as far away as the points
};

/// @pre both pixels show an item
Apart points_apart(
    const run::World& world, const View& view, const PositionTexel& a, const PositionTexel& b
) {
    const auto world_point = [&](const PositionTexel& texel) {
        return world.item_frames[index_of(texel.item)] * glm::dvec4(glm::dvec3(texel.point), 1.0);
    };
    const glm::dvec3 point = world_point(a);
    const double apart_m = glm::distance(point, world_point(b));
    const double depth_m = glm::dot(view.eye - point, view.camera_to_world[2]);
    return {apart_m, apart_m * focal_length_px(view) / depth_m};
}

/// Adds one pixel, which shows an item in at least one of the pictures.
void add_pixel(
    const run::World& world,
    const View& view,
    Verdict verdict,
    const PositionTexel& a,
    const PositionTexel& b,
    Findings& findings
) {
    findings.same_pixels += a.item == b.item ? 1 : 0;
    const bool shown = a.item != kNone<ItemId> && b.item != kNone<ItemId>;
    if (!shown || (verdict != Verdict::equal && verdict != Verdict::differs)) {
        return;
    }
    const Apart apart = points_apart(world, view, a, b);
    if (verdict == Verdict::differs) {
        // Of surfaces in one place either may be in front. Rounding moves the points of either
        // backend by a thousandth of a pixel, so a tenth is the same place.
        constexpr double kSamePlacePx = 0.1;
        findings.coincident_pixels += apart.px < kSamePlacePx ? 1 : 0;
        return;
    }
    findings.points_px.add(apart.px);
    findings.points_max_m = std::max(findings.points_max_m, apart.m);
    findings.other_surface_pixels += apart.px > 1.0 ? 1 : 0;
}

/// @return the picture of where ids differ
Result<Picture> compare(
    const run::World& world, const View& view, const Shown& a, const Shown& b, Findings& findings
) {
    const auto items = eval::compare_items(a.positions, b.positions);
    if (!items) {
        return tl::unexpected(items.error());
    }
    findings.items.pixels += items->pixels;
    findings.items.settled_pixels += items->settled_pixels;
    findings.items.equal_pixels += items->equal_pixels;
    const auto psnr = eval::psnr_db(a.picture, b.picture);
    if (!psnr) {
        return tl::unexpected(psnr.error());
    }
    findings.psnr_db.push_back(*psnr);
    Picture verdicts{view.width, view.height, {}};
    verdicts.rgba.reserve(a.positions.texels.size() * 4);
    for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
            const Verdict verdict = judge(a.positions, b.positions, x, y);
            const glm::u8vec3 color = color_of(verdict);
            verdicts.rgba.insert(verdicts.rgba.end(), {color.r, color.g, color.b, 255});
            if (verdict != Verdict::background) {
                const std::size_t pixel = pixel_of(a.positions, x, y);
                const PositionTexel& texel_a = a.positions.texels[pixel];
                const PositionTexel& texel_b = b.positions.texels[pixel];
                add_pixel(world, view, verdict, texel_a, texel_b, findings);
            }
        }
    }
    return verdicts;
}

std::optional<double> share(std::uint64_t part, std::uint64_t whole) {
    return whole == 0 ? std::optional<double>()
                      : static_cast<double>(part) / static_cast<double>(whole);
}

Result<void>
write_picture(const Options& options, const char* kind, int frame, const Picture& picture) {
    char name[64];
    std::snprintf(name, sizeof name, "%s_%02d.png", kind, frame);
    return io::write_png(std::filesystem::path(options.out) / name, picture);
}

Result<Findings>
compare_frames(const Options& options, const run::World& world, Drawer& opengl, Drawer& embree) {
    FrameClear clear;
    // Between two steps of 8 bits one device may round up and the other down, and the sky is not
    // what is compared.
    clear.color = glm::vec4(glm::round(world.scene.sky * 255.0F) / 255.0F, 1.0F);
    Findings findings;
    for (int frame = 0; frame < world.frames; ++frame) {
        const View view = world.view(frame);
        const auto a = opengl.draw(view, clear);
        if (!a) {
            return tl::unexpected(a.error());
        }
        const auto b = embree.draw(view, clear);
        if (!b) {
            return tl::unexpected(b.error());
        }
        const auto verdicts = compare(world, view, *a, *b, findings);
        if (!verdicts) {
            return tl::unexpected(verdicts.error());
        }
        if (options.out.empty()) {
            continue;
        }
        for (const auto& [kind, picture] :
             {std::pair{"opengl", &a->picture},
              std::pair{"embree", &b->picture},
              std::pair{"items", &*verdicts}}) {
            if (auto written = write_picture(options, kind, frame, *picture); !written) {
                return tl::unexpected(std::move(written).error());
            }
        }
    }
    findings.items.settled_fraction = share(findings.items.settled_pixels, findings.items.pixels);
    findings.items.equal_fraction =
        share(findings.items.equal_pixels, findings.items.settled_pixels);
    return findings;
}

/// One figure for the file and the terminal: what was not measured is null, and no line.
void add_figure(
    nlohmann::ordered_json& figures,
    const char* key,
    const char* name,
    std::optional<double> value,
    const char* unit
) {
    figures[key] = value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
    if (value) {
        std::printf("  %-36s %14.6g %s\n", name, *value, unit);
    }
}

Result<void> save(const nlohmann::ordered_json& figures, const std::string& file) {
    std::ofstream stream(file, std::ios::binary);
    // Names come from files, which may hold anything.
    stream << figures.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << '\n';
    stream.close();
    if (!stream) {
        return fail(ErrorCode::device, "cannot write '" + file + "'");
    }
    return {};
}

Result<void> report(
    const Options& options,
    const run::World& world,
    const Drawer& opengl,
    const Drawer& embree,
    const Findings& findings
) {
    std::printf(
        "%s: %.2f million triangles, %d frames of %dx%d, %s against %s\n",
        world.scene.name.c_str(),
        static_cast<double>(world.triangles) * 1e-6,
        world.frames,
        world.width,
        world.height,
        opengl.backend->device().c_str(),
        embree.backend->device().c_str()
    );
    const auto psnr = eval::summarize(findings.psnr_db);
    nlohmann::ordered_json figures;
    const auto number =
        [&](const char* key, const char* name, std::optional<double> value, const char* unit) {
            add_figure(figures, key, name, value, unit);
        };
    figures["scene"] = world.scene.name;
    figures["opengl"] = opengl.backend->device();
    figures["embree"] = embree.backend->device();
    figures["triangles"] = world.triangles;
    figures["frames"] = world.frames;
    figures["width"] = world.width;
    figures["height"] = world.height;
    figures["pixels"] = findings.items.pixels;
    std::printf(
        "  %-36s %14llu\n",
        "pixels that show geometry",
        static_cast<unsigned long long>(findings.items.pixels)
    );
    number(
        "same_fraction",
        "same item, of them",
        share(findings.same_pixels, findings.items.pixels),
        ""
    );
    number("settled_fraction", "one item around, of them", findings.items.settled_fraction, "");
    number("equal_fraction", "same item, of those", findings.items.equal_fraction, "");
    number(
        "coincident_fraction",
        "others in the same place, of those",
        share(findings.coincident_pixels, findings.items.settled_pixels),
        ""
    );
    number(
        "psnr_db_median",
        "PSNR of the colours, median",
        psnr ? std::optional(psnr->median) : std::nullopt,
        "dB"
    );
    number(
        "psnr_db_min",
        "PSNR of the colours, least",
        *std::min_element(findings.psnr_db.begin(), findings.psnr_db.end()),
        "dB"
    );
    number("points_px_median", "points apart, median", findings.points_px.percentile(0.5), "px");
    number("points_px_p99", "points apart, p99", findings.points_px.percentile(0.99), "px");
    number("points_px_max", "points apart, largest", findings.points_px.max(), "px");
    const std::uint64_t measured = findings.points_px.count();
    number(
        "points_m_max",
        "points apart, largest",
        measured != 0 ? std::optional(findings.points_max_m) : std::nullopt,
        "m"
    );
    number(
        "other_surface_fraction",
        "points apart by more than a pixel",
        share(findings.other_surface_pixels, measured),
        ""
    );
    return options.json.empty() ? Result<void>{} : save(figures, options.json);
}

Result<void> run_crosscheck(const Options& options) {
    const auto world = run::load_world(options.world);
    if (!world) {
        return tl::unexpected(world.error());
    }
    if (Result<void> made = run::make_folder(options.out); !made) {
        return made;
    }
    run::Backends backends(*world);
    auto opengl = make_drawer(*world, backends, "opengl");
    if (!opengl) {
        return tl::unexpected(opengl.error());
    }
    auto embree = make_drawer(*world, backends, "embree");
    if (!embree) {
        return tl::unexpected(embree.error());
    }
    const auto findings = compare_frames(options, *world, *opengl, *embree);
    if (!findings) {
        return tl::unexpected(findings.error());
    }
    if (auto reported = report(options, *world, *opengl, *embree, *findings); !reported) {
        return reported;
    }
    if (!findings->items.equal_fraction) {
        return fail(
            ErrorCode::bad_data, "no pixel to compare: nothing is in view, or all is borders"
        );
    }
    if (*findings->items.equal_fraction < options.least) {
        return fail(
            ErrorCode::bad_data,
            "items agree on " + std::to_string(*findings->items.equal_fraction) +
                " of the pixels, expected at least " + std::to_string(options.least)
        );
    }
    return {};
}

Result<void> run_program(CLI::App& app, const std::function<void()>& parse) {
    Options options;
    options.world.whole_path = 8;
    run::add_scene_options(app, options.world);
    run::add_partition_options(app, options.world);
    app.add_option("--frames", options.world.whole_path, "so many, spread over the scene's walk")
        ->check(CLI::Range(1, 10'000));
    app.add_option("--least", options.least, "share of agreeing pixels below which it fails")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--json", options.json, "file for all figures");
    app.add_option("--out", options.out, "folder for the pictures, and one of where items differ");
    parse();
    return run_crosscheck(options);
}

} // namespace

int main(int argc, char** argv) {
    return run::run_program(
        "crosscheck",
        "Compares plain geometry as OpenGL draws it with what Embree casts.",
        argc,
        argv,
        run_program
    );
}
