#include "eval/text_file.hpp"
#include <farfield/eval/image_errors.hpp>
#include <farfield/eval/walk.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

namespace farfield::eval {

namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// The target goes with the run, whatever way it ends.
class OwnedTarget {
  public:
    OwnedTarget(Backend& backend, TargetId id) : backend_(&backend), id_(id) {}
    OwnedTarget(const OwnedTarget&) = delete;
    OwnedTarget& operator=(const OwnedTarget&) = delete;
    ~OwnedTarget() { backend_->destroy_target(id_); }
    [[nodiscard]] TargetId id() const noexcept { return id_; }

  private:
    Backend* backend_;
    TargetId id_;
};

struct Timed {
    double frame_ms = 0.0;
    double plan_ms = 0.0;
};

/// Plans and draws one frame with the device idle before and after.
template <typename Plan>
Result<Timed> time_frame(const WalkSetup& setup, TargetId target, const Plan& make_plan) {
    setup.backend->finish();
    const Clock::time_point begin = Clock::now();
    const FramePlan& plan = make_plan();
    Timed timed;
    timed.plan_ms = milliseconds_since(begin);
    if (Result<void> drawn = setup.backend->execute(plan, target, setup.clear); !drawn) {
        return tl::unexpected(std::move(drawn).error());
    }
    setup.backend->finish();
    timed.frame_ms = milliseconds_since(begin);
    return timed;
}

/// The faster of both orders for a view, best of two each; the first two frames warm up.
Result<GeometryOrder>
faster_order(const WalkSetup& setup, TargetId target, const View& view, int warm_up_frames) {
    CulledGeometry stored(*setup.hierarchy, GeometryOrder::stored);
    CulledGeometry sorted(*setup.hierarchy, GeometryOrder::front_to_back);
    for (int i = 0; i < warm_up_frames; ++i) {
        const auto warmed =
            time_frame(setup, target, [&]() -> const FramePlan& { return sorted.plan(view); });
        if (!warmed) {
            return tl::unexpected(warmed.error());
        }
    }
    double best_stored = 0.0;
    double best_sorted = 0.0;
    for (int i = 0; i < 2; ++i) {
        const auto a =
            time_frame(setup, target, [&]() -> const FramePlan& { return stored.plan(view); });
        const auto b =
            time_frame(setup, target, [&]() -> const FramePlan& { return sorted.plan(view); });
        if (!a || !b) {
            return tl::unexpected(!a ? a.error() : b.error());
        }
        best_stored = i == 0 ? a->frame_ms : std::min(best_stored, a->frame_ms);
        best_sorted = i == 0 ? b->frame_ms : std::min(best_sorted, b->frame_ms);
    }
    return best_stored < best_sorted ? GeometryOrder::stored : GeometryOrder::front_to_back;
}

} // namespace

Result<WalkResult>
walk(const WalkSetup& setup, const WalkOptions& options, const WalkObserver& observer) {
    if (options.frames < 1) {
        return fail(
            ErrorCode::invalid_argument,
            "walk: frames is " + std::to_string(options.frames) + ", expected at least 1"
        );
    }
    if (!(options.frame_seconds > 0.0) || !std::isfinite(options.frame_seconds)) {
        return fail(
            ErrorCode::invalid_argument,
            "walk: frame_seconds is " + std::to_string(options.frame_seconds) +
                ", expected a finite time above 0 seconds"
        );
    }
    std::vector<View> views;
    views.reserve(static_cast<std::size_t>(options.frames));
    for (int frame = 0; frame < options.frames; ++frame) {
        views.push_back(setup.view(frame));
        if (Result<void> valid = validate(views.back()); !valid) {
            return fail(
                valid.error().code, "frame " + std::to_string(frame) + ": " + valid.error().message
            );
        }
    }
    const Result<TargetId> made =
        setup.backend->create_target(views[0].width, views[0].height, options.samples);
    if (!made) {
        return tl::unexpected(made.error());
    }
    const OwnedTarget target(*setup.backend, *made);

    WalkResult result;
    const Result<GeometryOrder> order =
        faster_order(setup, target.id(), views[0], options.warm_up_frames);
    if (!order) {
        return tl::unexpected(order.error());
    }
    result.reference_order = *order;
    CulledGeometry geometry(*setup.hierarchy, *order);
    const std::vector<int> sampled =
        sampled_frames(options.frames, options.reference_every, options.seed);
    auto next_sample = sampled.begin();
    int compared = 0;

    for (int frame = 0; frame < options.frames; ++frame) {
        const auto at = static_cast<std::size_t>(frame);
        const View& view = views[at];
        // Motion comes from frames already seen: none on the first, no acceleration on the second.
        Motion motion;
        motion.frame_seconds = options.frame_seconds;
        if (frame >= 2) {
            motion = estimate_motion(
                view.eye, views[at - 1].eye, views[at - 2].eye, options.frame_seconds
            );
        } else if (frame == 1) {
            motion.velocity = (view.eye - views[0].eye) / options.frame_seconds;
        }
        WalkFrame measured;
        const FramePlan* plan = nullptr;
        const auto timed = time_frame(setup, target.id(), [&]() -> const FramePlan& {
            plan = setup.cache != nullptr ? &setup.cache->plan(view, motion) : &geometry.plan(view);
            return *plan;
        });
        if (!timed) {
            return tl::unexpected(timed.error());
        }
        measured.work = work_of(*plan, setup.item_primitives);
        measured.frame_ms = timed->frame_ms;
        measured.plan_ms = timed->plan_ms;
        if (setup.cache != nullptr) {
            measured.cache = setup.cache->statistics();
        }
        result.image_bytes_peak = std::max(result.image_bytes_peak, setup.backend->image_bytes());
        if (observer.on_frame) {
            if (Result<void> observed = observer.on_frame(frame, view, *plan); !observed) {
                return tl::unexpected(std::move(observed).error());
            }
        }

        const bool sample = next_sample != sampled.end() && *next_sample == frame;
        const bool show =
            observer.on_pictures && options.picture_every > 0 && frame % options.picture_every == 0;
        Picture picture;
        Picture reference;
        if (sample || show) {
            Result<Picture> read = setup.backend->read_target(target.id());
            if (!read) {
                return tl::unexpected(read.error());
            }
            picture = std::move(*read);
        }
        if (sample || show) {
            const auto plain = time_frame(setup, target.id(), [&]() -> const FramePlan& {
                return geometry.plan(view);
            });
            if (!plain) {
                return tl::unexpected(plain.error());
            }
            Result<Picture> read = setup.backend->read_target(target.id());
            if (!read) {
                return tl::unexpected(read.error());
            }
            reference = std::move(*read);
            if (sample) {
                ++next_sample;
                measured.reference_ms = plain->frame_ms;
            }
            const Result<double> psnr = psnr_db(reference, picture);
            if (!psnr) {
                return tl::unexpected(psnr.error());
            }
            measured.psnr_db = *psnr;
            const glm::u8vec3 background(glm::vec3(setup.clear.color) * 255.0F + 0.5F);
            const auto reference_mask = coverage_by_background(reference, background);
            const auto picture_mask = coverage_by_background(picture, background);
            if (reference_mask && picture_mask) {
                if (const auto holes = find_sky_holes(*reference_mask, *picture_mask)) {
                    result.sky_holes += holes->pixels;
                }
                const auto errors = compare_coverage(*reference_mask, *picture_mask);
                if (errors && errors->missing_fraction) {
                    result.missing_fraction += *errors->missing_fraction;
                    result.extra_fraction += *errors->extra_fraction;
                    ++compared;
                }
            }
        }
        if (show) {
            const WalkPictures pictures{.frame = frame, .picture = picture, .reference = reference};
            if (Result<void> shown = observer.on_pictures(pictures); !shown) {
                return tl::unexpected(std::move(shown).error());
            }
        }
        result.frames.push_back(measured);
        if (observer.on_progress) {
            observer.on_progress(frame + 1, options.frames);
        }
    }
    if (compared > 0) {
        result.compared = true;
        result.missing_fraction /= compared;
        result.extra_fraction /= compared;
    }
    return result;
}

Result<void> add_to_report(const WalkResult& result, RunReport& report) {
    std::vector<double> frame_ms;
    std::vector<double> plan_ms;
    std::vector<double> psnr;
    std::vector<SampledTime> reference;
    PlanWork work;
    RunReport::Work counts;
    std::uint64_t created = 0;
    std::uint64_t combined = 0;
    std::uint64_t reused = 0;
    std::uint64_t stale = 0;
    std::uint64_t evicted = 0;
    std::uint64_t refused = 0;
    for (std::size_t i = 0; i < result.frames.size(); ++i) {
        const WalkFrame& frame = result.frames[i];
        frame_ms.push_back(frame.frame_ms);
        plan_ms.push_back(frame.plan_ms);
        if (frame.reference_ms) {
            reference.push_back({static_cast<int>(i), *frame.reference_ms});
        }
        if (frame.psnr_db) {
            psnr.push_back(*frame.psnr_db);
        }
        work.triangles += frame.work.triangles;
        work.draws += frame.work.draws;
        work.image_quads += frame.work.image_quads;
        work.image_texels += frame.work.image_texels;
        created += frame.cache.images_created;
        combined += frame.cache.images_combined;
        reused += frame.cache.images_reused;
        stale += frame.cache.images_stale;
        evicted += frame.cache.images_evicted;
        refused += frame.cache.images_refused;
    }
    report.frames = static_cast<int>(result.frames.size());
    report.frame_ms = frame_times(frame_ms);
    if (const auto plan = summarize(plan_ms)) {
        report.plan_ms = {.mean = plan->mean, .p95 = plan->p95, .max = plan->max};
    }
    if (!reference.empty()) {
        auto figures = reference_figures(reference, report.frames);
        if (!figures) {
            return tl::unexpected(figures.error());
        }
        report.reference_frame_ms = *figures;
        auto faster = speedup(frame_ms, reference);
        if (!faster) {
            return tl::unexpected(faster.error());
        }
        report.speedup = *faster;
    }
    if (const auto errors = summarize(psnr)) {
        report.image.psnr_db_min = *std::min_element(psnr.begin(), psnr.end());
        report.image.psnr_db_median = errors->median;
    }
    if (result.compared) {
        report.image.missing_fraction = result.missing_fraction;
        report.image.extra_fraction = result.extra_fraction;
    }
    const auto frames = static_cast<double>(result.frames.size());
    counts.triangles_per_frame = static_cast<double>(work.triangles) / frames;
    counts.draw_calls_per_frame = static_cast<double>(work.draws) / frames;
    counts.image_quads_per_frame = static_cast<double>(work.image_quads) / frames;
    counts.images_created = created;
    counts.images_reused = reused;
    counts.texels_created = work.image_texels;
    counts.evicted = evicted;
    counts.stale = stale;
    counts.new_count = created - combined;
    counts.combined = combined;
    counts.reused = reused;
    counts.budget_misses = refused;
    report.work = counts;
    report.memory.image_bytes_peak = result.image_bytes_peak;
    return {};
}

Result<void> save_frames(const WalkResult& result, const std::filesystem::path& file) {
    std::string text = "frame,frame_ms,plan_ms,reference_ms,psnr_db,triangles,image_quads,"
                       "images_created,images_shown,image_bytes,texels_used,texels_allocated\n";
    const auto cell = [](std::optional<double> value) {
        return value ? std::to_string(*value) : std::string();
    };
    for (std::size_t i = 0; i < result.frames.size(); ++i) {
        const WalkFrame& frame = result.frames[i];
        text += std::to_string(i) + "," + cell(frame.frame_ms) + "," + cell(frame.plan_ms) + "," +
                cell(frame.reference_ms) + "," + cell(frame.psnr_db) + "," +
                std::to_string(frame.work.triangles) + "," +
                std::to_string(frame.work.image_quads) + "," +
                std::to_string(frame.cache.images_created) + "," +
                std::to_string(frame.cache.images_shown) + "," +
                std::to_string(frame.cache.image_bytes) + "," +
                std::to_string(frame.cache.texels_used) + "," +
                std::to_string(frame.cache.texels_allocated) + "\n";
    }
    return detail::write_text(file, text);
}

} // namespace farfield::eval
