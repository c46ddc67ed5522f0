// Places images in a scene so that no view renders more than a number of primitives, as Aliaga and
// Lastra 1999 do, checks the promise on random views, and tells what it takes: table 1 and figure
// 13 of the paper.
#include "run/backends.hpp"
#include "run/page.hpp"
#include "run/placement.hpp"
#include "run/program.hpp"
#include "run/world.hpp"
#include <farfield/eval/disparity.hpp>
#include <farfield/eval/disparity_series.hpp>
#include <farfield/eval/flip.hpp>
#include <farfield/eval/image_errors.hpp>
#include <farfield/eval/run_report.hpp>
#include <farfield/gpu/plan_work.hpp>
#include <farfield/io/placement_file.hpp>
#include <farfield/io/png.hpp>
#include <farfield/parallel/parallel_executor.hpp>
#include <farfield/technique/build_placement.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/image_placement.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace {

using namespace farfield;
using run::Page;

struct Options {
    run::WorldOptions world;
    run::PlacementSetup setup;
    std::vector<std::uint64_t> budgets;
    std::uint64_t checks = 100'000;
    int pictures = 0;
    std::uint32_t seed = 1;
    unsigned threads = 0;
    std::string file; ///< of all images; empty: none is made
    std::string out = "placement";
};

/// [px] What steps of places and depths displace a sample by, at most: half a diagonal of a
/// sixteenth of a texel, seen twice as large as it was made, and less than as much again by depth.
constexpr double kStepsPx = 0.1;
/// Random views for each that is to show an image: where fewer do, there is nothing to compare.
constexpr std::uint64_t kMostTries = 10'000;

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Has every image and none: where plans are counted and not drawn.
class EmptyImages final : public LayeredImageSource {
  public:
    void want(std::span<const std::uint32_t> /*images*/) noexcept override {}
    [[nodiscard]] const LayeredDepthImage* find(std::uint32_t /*image*/) noexcept override {
        return &empty_;
    }

  private:
    LayeredDepthImage empty_;
};

/// Random eyes and directions that a map serves.
class RandomViews {
  public:
    RandomViews(const PlacementMap& map, std::uint32_t seed)
        : map_(&map), frame_(yaw_frame(map.options.up)), random_(seed) {
        screen_.lens = map.options.lens;
        screen_.width = map.options.width;
        screen_.height = map.options.height;
    }

    [[nodiscard]] View next() {
        const Box3d& eyes = map_->options.eyes;
        const glm::dvec3 at(uniform(), uniform(), uniform());
        const double yaw = (2.0 * uniform() - 1.0) * std::numbers::pi;
        const double pitch = (2.0 * uniform() - 1.0) * map_->options.max_pitch;
        return level_view(frame_, eyes.lo + extent(eyes) * at, yaw, pitch, screen_);
    }

  private:
    [[nodiscard]] double uniform() { return static_cast<double>(random_() >> 11U) * 0x1p-53; }

    const PlacementMap* map_;
    YawFrame frame_;
    View screen_;
    std::mt19937_64 random_;
};

/// What random views render.
struct Checked {
    std::uint64_t views = 0;
    std::uint64_t over = 0; ///< the budget
    std::uint64_t with_image = 0;
    std::uint64_t most = 0;
    std::uint64_t most_before = 0; ///< without images, of the views that show one
    double mean = 0.0;
    double plan_us = 0.0;
};

Result<Checked>
check(const run::World& world, const PlacementMap& map, std::uint64_t views, std::uint32_t seed) {
    EmptyImages images;
    auto placement = ImagePlacement::create(world.hierarchy, map, images);
    if (!placement) {
        return tl::unexpected(std::move(placement).error());
    }
    RandomViews random(map, seed);
    Checked checked;
    checked.views = views;
    const auto start = std::chrono::steady_clock::now();
    for (std::uint64_t i = 0; i < views; ++i) {
        const FramePlan& plan = placement->plan(random.next(), {});
        const std::uint64_t rendered = work_of(plan, world.item_primitives).triangles;
        checked.most = std::max(checked.most, rendered);
        checked.mean += static_cast<double>(rendered);
        const ImagePlacementStatistics& statistics = placement->statistics();
        if (rendered > map.options.max_primitives || statistics.refusal != PlacementRefusal::none) {
            ++checked.over;
        }
        checked.with_image += statistics.image != UINT32_MAX ? 1U : 0U;
    }
    checked.plan_us = seconds_since(start) * 1e6 / static_cast<double>(views);
    checked.mean /= static_cast<double>(views);
    return checked;
}

/// Draws plans on one backend with positions.
class Drawer {
  public:
    struct Shown {
        Picture picture;
        PositionPicture positions;
    };

    Drawer(Backend& backend, TargetId target, const FrameClear& clear)
        : backend_(&backend), target_(target), clear_(clear) {}

    [[nodiscard]] Result<Shown> draw(const FramePlan& plan) {
        if (Result<void> drawn = backend_->execute(plan, target_, clear_); !drawn) {
            return tl::unexpected(std::move(drawn).error());
        }
        auto picture = backend_->read_target(target_);
        if (!picture) {
            return tl::unexpected(std::move(picture).error());
        }
        auto positions = backend_->read_positions(target_);
        if (!positions) {
            return tl::unexpected(std::move(positions).error());
        }
        return Shown{std::move(*picture), std::move(*positions)};
    }

  private:
    Backend* backend_;
    TargetId target_;
    FrameClear clear_;
};

CoverageMask covered(const PositionPicture& positions) {
    CoverageMask mask;
    mask.width = positions.width;
    mask.height = positions.height;
    mask.covered.reserve(positions.texels.size());
    for (const PositionTexel& texel : positions.texels) {
        mask.covered.push_back(texel.item != kNone<ItemId> ? 1 : 0);
    }
    return mask;
}

double median_of(std::vector<double> values) {
    return eval::summarize(values).value_or(Statistics{}).median;
}

/// Pictures of random views that show an image, cast, against geometry cast: with images made of
/// one view and of nine.
Result<void> compare_pictures(
    const run::World& world, const PlacementMap& map, const Options& options, Page& page
) {
    run::Backends backends(world);
    const auto backend = backends.make("embree", true);
    if (!backend) {
        return tl::unexpected(backend.error());
    }
    const auto target = (*backend)->create_target(map.options.width, map.options.height, 1);
    if (!target) {
        return tl::unexpected(target.error());
    }
    Drawer drawer(**backend, *target, {true, glm::vec4(world.scene.sky, 1.0F)});
    CulledGeometry geometry(world.hierarchy);
    page.line("| views an image is made of | layers, most | made in [s] | KiB an image | "
              "missing, sky inside [%% of covered] | extra | PSNR [dB] | FLIP | disparity p99, "
              "largest [px] | over their promise, of pixels |");
    page.line("|---|---|---|---|---|---|---|---|---|---|");
    for (const std::uint32_t views : {1U, 9U}) {
        run::PlacementSetup setup = options.setup;
        setup.making.views = views;
        setup.making.merging.keep_points = true;
        auto maker = LayeredImageMaker::create(
            world.hierarchy, map, **backend, world.item_frames, setup.making
        );
        if (!maker) {
            return tl::unexpected(std::move(maker).error());
        }
        run::MadeImages images(map.images.size());
        auto placement = ImagePlacement::create(world.hierarchy, map, images);
        if (!placement) {
            return tl::unexpected(std::move(placement).error());
        }
        RandomViews random(map, options.seed);
        std::vector<double> psnr;
        std::vector<double> flip;
        double made_s = 0.0;
        double bytes = 0.0;
        double layers = 0.0;
        std::uint32_t most_layers = 0;
        std::uint64_t made = 0;
        CoverageErrors coverage;
        std::uint64_t holes = 0;
        DisparitySeries series;
        std::uint64_t tried = 0;
        for (int shown = 0; shown < options.pictures;) {
            if (++tried > kMostTries * static_cast<std::uint64_t>(options.pictures)) {
                return fail(
                    ErrorCode::not_found,
                    "only " + std::to_string(shown) + " of " + std::to_string(tried - 1) +
                        " random views show an image at a budget of " +
                        std::to_string(map.options.max_primitives) + " primitives, --pictures is " +
                        std::to_string(options.pictures)
                );
            }
            const View view = random.next();
            const PlacedView found = find(map, view);
            const std::uint32_t image = found.refusal == PlacementRefusal::none
                                            ? map.ranges[found.range].image
                                            : UINT32_MAX;
            if (image == UINT32_MAX) {
                continue;
            }
            if (images.find(image) == nullptr) {
                const auto start = std::chrono::steady_clock::now();
                auto built = maker->make(image);
                if (!built) {
                    return tl::unexpected(std::move(built).error());
                }
                made_s += seconds_since(start);
                ++made;
                layers += built->quality.mean_layers;
                most_layers = std::max(most_layers, built->quality.most_layers);
                built->image.points.shrink_to_fit();
                bytes += static_cast<double>(
                    memory_bytes(built->image) - built->image.points.size() * sizeof(PositionTexel)
                );
                images.add(image, std::move(built->image));
            }
            const auto warped = drawer.draw(placement->plan(view, {}));
            if (!warped) {
                return tl::unexpected(warped.error());
            }
            const auto reference = drawer.draw(geometry.plan(view));
            if (!reference) {
                return tl::unexpected(reference.error());
            }
            const auto decibels = eval::psnr_db(reference->picture, warped->picture);
            const auto map_of_flip = eval::flip_map(reference->picture, warped->picture);
            const CoverageMask its = covered(reference->positions);
            const CoverageMask mine = covered(warped->positions);
            const auto covering = eval::compare_coverage(its, mine);
            const auto sky = eval::find_sky_holes(its, mine);
            const auto disparity =
                eval::measure_disparity(warped->positions, view, world.item_frames, kStepsPx);
            if (!decibels || !map_of_flip || !covering || !sky || !disparity) {
                return fail(ErrorCode::device, "pictures of different sizes");
            }
            psnr.push_back(*decibels);
            flip.push_back(eval::mean(*map_of_flip).value_or(0.0));
            coverage.missing_pixels += covering->missing_pixels;
            coverage.extra_pixels += covering->extra_pixels;
            coverage.covered_pixels += covering->covered_pixels;
            holes += sky->pixels;
            series.add(shown, *disparity, {});
            if (views == 9 && shown < 3) {
                for (const auto& [kind, picture] :
                     {std::pair("placed", &warped->picture),
                      std::pair("geometry", &reference->picture)}) {
                    if (Result<void> written =
                            io::write_png(run::frame_file(options.out, kind, shown), *picture);
                        !written) {
                        return written;
                    }
                }
            }
            run::print_progress("pictures", ++shown, options.pictures);
        }
        const auto of_covered = [&](std::uint64_t pixels) {
            return 100.0 * static_cast<double>(pixels) /
                   static_cast<double>(std::max(coverage.covered_pixels, std::uint64_t{1}));
        };
        const auto count = static_cast<double>(made);
        const DisparitySummary summary = series.summary();
        page.line(
            "| %u | %.2f, %u | %.2f | %.0f | %.3f %%, %.3f %% | %.3f %% | %.1f | %.4f | %.2f, %.2f "
            "| %llu, %llu |",
            views,
            layers / count,
            most_layers,
            made_s / count,
            bytes / count / 1024.0,
            of_covered(coverage.missing_pixels),
            of_covered(holes),
            of_covered(coverage.extra_pixels),
            median_of(psnr),
            median_of(flip),
            summary.p99_px.value_or(0.0),
            summary.max_px.value_or(0.0),
            static_cast<unsigned long long>(summary.over_bound.value_or(0)),
            static_cast<unsigned long long>(summary.image_pixels)
        );
    }
    return {};
}

/// Stands for a scene and for how its images are made, in the file that they are kept in.
std::uint64_t making_key(const PlacementMap& map, const Options& options) {
    // FNV-1a.
    std::uint64_t key = 14695981039346656037ULL;
    const auto add = [&key](std::uint64_t word) {
        for (unsigned byte = 0; byte < 8; ++byte) {
            key = (key ^ ((word >> (8U * byte)) & 0xFFU)) * 1099511628211ULL;
        }
    };
    for (const char letter : options.world.scene) {
        add(static_cast<unsigned char>(letter));
    }
    add(map.model_digest);
    add(options.setup.making.views);
    return key;
}

/// Makes all images of a map and keeps them in a file; goes on where a run was cut off.
Result<void>
make_file(const run::World& world, const PlacementMap& map, const Options& options, Page& page) {
    const auto start = std::chrono::steady_clock::now();
    auto writer =
        io::PlacementWriter::open(options.file, map, {.making_key = making_key(map, options)});
    if (!writer) {
        return tl::unexpected(std::move(writer).error());
    }
    run::Backends backends(world);
    const auto backend = backends.make("embree", true);
    if (!backend) {
        return tl::unexpected(backend.error());
    }
    auto maker = LayeredImageMaker::create(
        world.hierarchy, map, **backend, world.item_frames, options.setup.making
    );
    if (!maker) {
        return tl::unexpected(std::move(maker).error());
    }
    const std::uint32_t images = writer->image_count();
    std::uint32_t made = 0;
    std::uint32_t found = 0;
    double layers = 0.0;
    double bytes = 0.0;
    for (std::uint32_t image = 0; image < images; ++image) {
        if (writer->has(image)) {
            ++found;
            continue;
        }
        auto built = maker->make(image);
        if (!built) {
            return tl::unexpected(std::move(built).error());
        }
        if (Result<void> added = writer->add(image, built->image); !added) {
            return added;
        }
        ++made;
        layers += built->quality.mean_layers;
        bytes += static_cast<double>(memory_bytes(built->image));
        run::print_progress(
            "make images",
            static_cast<int>(image + 1),
            static_cast<int>(images),
            seconds_since(start) / made * (images - image - 1)
        );
    }
    if (Result<void> finished = writer->finish(); !finished) {
        return finished;
    }
    std::error_code error;
    const auto size = static_cast<double>(std::filesystem::file_size(options.file, error));
    constexpr double kMib = 1024.0 * 1024.0;
    page.line(
        "%u images made in %.1f min, %u found; %.0f MiB in the file, %.2f an image, %.2f in "
        "memory; "
        "%.2f layers.\n",
        made,
        seconds_since(start) / 60.0,
        found,
        error ? 0.0 : size / kMib,
        error || images == 0 ? 0.0 : size / kMib / images,
        made > 0 ? bytes / made / kMib : 0.0,
        made > 0 ? layers / made : 0.0
    );
    return {};
}

Result<void> place(CLI::App& app, const std::function<void()>& parse) {
    Options options;
    options.world.scene = "pipes";
    options.world.partition = "octree";
    options.world.cells.max_primitives = 1024;
    run::add_scene_options(app, options.world);
    run::add_partition_options(app, options.world);
    run::add_placement_options(app, options.setup);
    app.add_option("--budgets", options.budgets, "several, one after the other");
    app.add_option("--check", options.checks, "random views to count primitives of");
    app.add_option("--pictures", options.pictures, "random views with images to compare")
        ->check(CLI::Range(0, 100'000));
    app.add_option(
        "--file", options.file, "makes all images for the last budget and keeps them in this file"
    );
    app.add_option("--check-seed", options.seed, "of random views");
    app.add_option("--threads", options.threads, "0: one for every core");
    app.add_option("--out", options.out, "folder for results");
    parse();
    if (Result<void> made = run::make_folder(options.out); !made) {
        return made;
    }
    const auto world = run::load_world(options.world);
    if (!world) {
        return tl::unexpected(world.error());
    }
    PlacementOptions placement = run::placement_options(*world, options.setup);
    if (options.budgets.empty()) {
        options.budgets = {placement.max_primitives};
    }
    parallel::ParallelExecutor executor(options.threads);
    Page page(std::filesystem::path(options.out) / "README.md");
    page.line(
        "%s: %llu triangles, %zu nodes.\n",
        options.world.scene.c_str(),
        static_cast<unsigned long long>(world->triangles),
        world->hierarchy.nodes.size()
    );
    page.line("| P | target | cells | sites, levels | views | images | of a site | miss | worst, "
              "before | placed [s] | views checked | over | most | mean | with image | plan [us] |"
    );
    page.line("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (const std::uint64_t budget : options.budgets) {
        placement.max_primitives = budget;
        const auto start = std::chrono::steady_clock::now();
        const auto map = build_placement(
            world->hierarchy,
            placement,
            executor,
            [](std::size_t placed, std::size_t known) {
                run::print_progress("place", static_cast<int>(placed), static_cast<int>(known));
            }
        );
        if (!map) {
            return tl::unexpected(map.error());
        }
        const double seconds = seconds_since(start);
        const auto checked = check(*world, *map, options.checks, options.seed);
        if (!checked) {
            return tl::unexpected(checked.error());
        }
        page.line(
            "| %llu | %llu | %zu | %zu, %u | %llu | %zu | %.2f | %.1f %% | %llu, %llu | %.1f | "
            "%llu | "
            "%llu | %llu | %.0f | %.1f %% | %.1f |",
            static_cast<unsigned long long>(budget),
            static_cast<unsigned long long>(*map->options.target_primitives),
            map->cells.size(),
            map->sites.size(),
            map->quality.level,
            static_cast<unsigned long long>(map->quality.views),
            map->images.size(),
            static_cast<double>(map->images.size()) / static_cast<double>(map->sites.size()),
            100.0 * map->quality.miss,
            static_cast<unsigned long long>(map->quality.worst),
            static_cast<unsigned long long>(map->quality.worst_before),
            seconds,
            static_cast<unsigned long long>(checked->views),
            static_cast<unsigned long long>(checked->over),
            static_cast<unsigned long long>(checked->most),
            checked->mean,
            100.0 * static_cast<double>(checked->with_image) / static_cast<double>(checked->views),
            checked->plan_us
        );
        if (!options.file.empty() && budget == options.budgets.back()) {
            page.line("");
            if (Result<void> made = make_file(*world, *map, options, page); !made) {
                return made;
            }
        }
        if (options.pictures > 0) {
            page.line("");
            if (Result<void> compared = compare_pictures(*world, *map, options, page); !compared) {
                return compared;
            }
            page.line("");
        }
    }
    return {};
}

} // namespace

int main(int argc, char** argv) {
    return farfield::run::run_program(
        "place",
        "Places images so that no view renders more than a number of primitives.",
        argc,
        argv,
        place
    );
}
