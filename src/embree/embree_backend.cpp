#include "embree/blend.hpp"
#include "embree/cast_scene.hpp"
#include "embree/frame_work.hpp"
#include "embree/samples.hpp"
#include "embree/tile.hpp"
#include "embree/worker_pool.hpp"
#include <farfield/core/executor.hpp>
#include <farfield/embree/embree_backend.hpp>
#include <farfield/gpu/layered_drawing.hpp>
#include <farfield/gpu/plan_rules.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <functional>
#include <new>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace farfield::embree {

namespace {

/// Shares the work of warping.
class PoolExecutor final : public Executor {
  public:
    explicit PoolExecutor(WorkerPool& pool) noexcept : pool_(&pool) {}
    void run(std::size_t count, const std::function<void(std::size_t)>& task) override {
        pool_->run(static_cast<std::uint32_t>(count), [&](std::uint32_t index, unsigned) {
            task(index);
        });
    }

  private:
    WorkerPool* pool_;
};

/// A layered image that was handed over.
struct KeptLayers {
    std::uint32_t cache = 0;
    LayeredImageId id = kNone<LayeredImageId>;
    LayeredDepthImage content; ///< with points if positions are kept
};

constexpr unsigned kMostThreads = 256;
constexpr std::int32_t kMostSamples = 64;
constexpr std::int32_t kLargestPage = 16384;

tl::unexpected<Error> invalid(std::string what) {
    return fail(ErrorCode::invalid_argument, "plan: " + std::move(what));
}

tl::unexpected<Error> no_target(TargetId target) {
    return fail(
        ErrorCode::invalid_argument,
        "Embree: target " + std::to_string(index_of(target)) + " does not exist"
    );
}

tl::unexpected<Error> no_memory(const std::string& what) {
    return fail(ErrorCode::out_of_memory, "Embree: no memory for " + what);
}

std::string command_name(std::size_t pass, std::uint32_t command) {
    return "pass " + std::to_string(pass) + ", command " + std::to_string(command);
}

std::size_t texels_of(std::int32_t width, std::int32_t height) noexcept {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

} // namespace

struct EmbreeBackend::Impl {
    std::unique_ptr<CastScene> scene;
    EmbreeBackendOptions options;
    std::unique_ptr<WorkerPool> pool;
    std::vector<std::unique_ptr<Workspace>> workspaces; ///< by thread
    std::vector<std::unique_ptr<Page>> pages;
    std::vector<std::unique_ptr<KeptLayers>> layered;
    LayeredWarper warper;
    std::vector<Target> targets; ///< TargetId is the position plus one
    std::array<std::vector<glm::vec2>, kMostSamples + 1> places; ///< by number of samples
    FrameWork work;

    [[nodiscard]] Page* find(std::uint32_t cache, PageId id) noexcept {
        for (const std::unique_ptr<Page>& page : pages) {
            if (page->cache == cache && page->id == id) {
                return page.get();
            }
        }
        return nullptr;
    }
    [[nodiscard]] KeptLayers* find(std::uint32_t cache, LayeredImageId id) noexcept {
        for (const std::unique_ptr<KeptLayers>& image : layered) {
            if (image->cache == cache && image->id == id) {
                return image.get();
            }
        }
        return nullptr;
    }
    [[nodiscard]] Target* target(TargetId id) noexcept {
        const std::size_t index = index_of(id);
        const bool exists = index >= 1 && index <= targets.size() && targets[index - 1].width > 0;
        return exists ? &targets[index - 1] : nullptr;
    }
    [[nodiscard]] std::int32_t samples_of(std::int32_t asked) const noexcept {
        return options.positions ? 1 : asked;
    }

    [[nodiscard]] Result<void> run(const FramePlan& plan, Target& frame, const FrameClear& clear);
    [[nodiscard]] Result<void> update_page(std::uint32_t cache, const PageUpdate& update);
    [[nodiscard]] Result<void> update_layers(std::uint32_t cache, const LayeredUpdate& update);
    [[nodiscard]] Result<void> check_pages(const FramePlan& plan, const Target& frame);
    [[nodiscard]] Result<void>
    check_geometry(const FramePlan& plan, std::size_t pass, std::uint32_t command) const;
    [[nodiscard]] Result<void> check_selection(
        const FramePlan& plan, std::size_t pass, std::uint32_t command, std::uint32_t selection
    ) const;
    [[nodiscard]] Result<void>
    check_keyframes(const FramePlan& plan, std::size_t pass, std::uint32_t command);
    [[nodiscard]] Result<void>
    check_images(const FramePlan& plan, std::size_t pass, std::uint32_t command);
    [[nodiscard]] Result<void>
    check_layers(const FramePlan& plan, std::size_t pass, std::uint32_t command);
    void add_pass(const FramePlan& plan, const Pass& pass, Target& frame, const FrameClear& clear);
    void add_keyframes(const FramePlan& plan, const Pass& pass, const Command& command);
    void add_layers(
        const FramePlan& plan, const Pass& pass, const Command& command, std::uint32_t order
    );
    void add_commands(const FramePlan& plan, const Pass& pass);
    void begin_phase(Phase& phase) const noexcept;
    void close_phase(const Pass& pass, Phase& phase);
    void draw_batch();
    void copy_pass(const FramePlan& plan, const Pass& pass) noexcept;
};

Result<void> EmbreeBackend::Impl::update_page(std::uint32_t cache, const PageUpdate& update) {
    if (Page* old = find(cache, update.page)) {
        std::erase_if(pages, [&](const std::unique_ptr<Page>& page) { return page.get() == old; });
    }
    if (update.action == PageUpdate::Action::destroy) {
        return {};
    }
    if (Result<void> valid = gpu::check_page(update, kLargestPage, kMostSamples); !valid) {
        return valid;
    }
    auto page = std::make_unique<Page>();
    page->cache = cache;
    page->id = update.page;
    page->size = update.size;
    page->samples = samples_of(update.samples);
    page->scratch = update.scratch;
    page->depth = update.depth;
    // Filtering reads a row and a texel beyond the last, with a weight of zero.
    const std::size_t texels = texels_of(update.size, update.size);
    const std::size_t filtered = texels + static_cast<std::size_t>(update.size) + 2;
    const bool depths = update.depth || update.scratch;
    page->colors = allocate<std::uint32_t>(filtered);
    if (depths) {
        page->depths = allocate<std::uint16_t>(filtered);
    }
    if (options.positions) {
        page->positions = allocate<PositionTexel>(texels);
    }
    if (page->colors == nullptr || (depths && page->depths == nullptr) ||
        (options.positions && page->positions == nullptr)) {
        const std::string size = std::to_string(update.size);
        return no_memory("an image page of " + size + " x " + size + " texels");
    }
    if (options.positions) {
        std::fill_n(page->positions.get(), texels, PositionTexel());
    }
    pages.push_back(std::move(page));
    return {};
}

Result<void> EmbreeBackend::Impl::update_layers(std::uint32_t cache, const LayeredUpdate& update) {
    if (Result<void> valid = gpu::check_layered_update(update); !valid) {
        return valid;
    }
    if (const KeptLayers* old = find(cache, update.image)) {
        std::erase_if(layered, [&](const std::unique_ptr<KeptLayers>& image) {
            return image.get() == old;
        });
    }
    if (update.action == LayeredUpdate::Action::destroy) {
        return {};
    }
    const LayeredDepthImage& content = *update.content;
    auto image = std::make_unique<KeptLayers>();
    image->cache = cache;
    image->id = update.image;
    image->content = {
        .view = content.view,
        .near_depth = content.near_depth,
        .far_depth = content.far_depth,
        .counts = content.counts,
        .rows = content.rows,
        .samples = content.samples,
        .points = {}};
    if (options.positions) {
        image->content.points = content.points;
    }
    layered.push_back(std::move(image));
    return {};
}

Result<void> EmbreeBackend::Impl::check_pages(const FramePlan& plan, const Target& frame) {
    const Region whole{0, 0, frame.width, frame.height};
    for (std::size_t i = 0; i < plan.passes.size(); ++i) {
        const Pass& pass = plan.passes[i];
        if (Result<void> valid = gpu::check_places(
                plan, i, whole, find(plan.cache, pass.page), find(plan.cache, pass.copy_page)
            );
            !valid) {
            return valid;
        }
        for (std::uint32_t c = 0; c < pass.command_count; ++c) {
            const std::uint32_t command = pass.first_command + c;
            Result<void> valid;
            if (draws_images(plan.commands[command])) {
                valid = check_images(plan, i, command);
            } else if (draws_geometry(plan.commands[command])) {
                valid = check_geometry(plan, i, command);
                if (valid) {
                    valid = check_keyframes(plan, i, command);
                }
            } else if (plan.commands[command].kind == Command::Kind::layers) {
                valid = check_layers(plan, i, command);
            }
            if (!valid) {
                return valid;
            }
        }
    }
    return {};
}

Result<void> EmbreeBackend::Impl::check_geometry(
    const FramePlan& plan, std::size_t pass, std::uint32_t index
) const {
    const Command& command = plan.commands[index];
    for (std::uint32_t i = command.first; i < command.first + command.count; ++i) {
        if (index_of(plan.items[i]) >= scene->items().size()) {
            return invalid(
                command_name(pass, index) + ": items[" + std::to_string(i) + "] is item " +
                std::to_string(index_of(plan.items[i])) + " of " +
                std::to_string(scene->items().size())
            );
        }
    }
    const std::uint32_t end = command.first_piece + command.piece_count;
    for (std::uint32_t i = command.first_piece; i < end; ++i) {
        const Piece& piece = plan.pieces[i];
        if (scene->run_of(piece) == nullptr) {
            return invalid(
                command_name(pass, index) + ": pieces[" + std::to_string(i) + "], primitives " +
                std::to_string(piece.first) + " to " +
                std::to_string(std::uint64_t{piece.first} + piece.count) + ", is no run of item " +
                std::to_string(index_of(piece.item))
            );
        }
    }
    for (std::uint32_t i = 0; i < command.selection_count; ++i) {
        if (Result<void> valid = check_selection(plan, pass, index, command.first_selection + i);
            !valid) {
            return valid;
        }
    }
    return {};
}

Result<void> EmbreeBackend::Impl::check_selection(
    const FramePlan& plan, std::size_t pass, std::uint32_t command, std::uint32_t index
) const {
    const Selection& selection = plan.selections[index];
    const auto refused = [&](const std::string& what) {
        return invalid(
            command_name(pass, command) + ": selections[" + std::to_string(index) + "] " + what
        );
    };
    const std::size_t item = index_of(selection.item);
    if (item >= scene->items().size()) {
        return refused(
            "is of item " + std::to_string(item) + " of " + std::to_string(scene->items().size())
        );
    }
    for (const std::uint32_t primitive :
         std::span(plan.selected).subspan(selection.first, selection.count)) {
        if (!scene->has_primitive(selection.item, primitive)) {
            return refused(
                "has primitive " + std::to_string(primitive) + " of item " + std::to_string(item) +
                ", which has none of that number"
            );
        }
    }
    return {};
}

Result<void>
EmbreeBackend::Impl::check_keyframes(const FramePlan& plan, std::size_t pass, std::uint32_t index) {
    const Command& command = plan.commands[index];
    for (std::uint32_t i = 0; i < command.keyframe_count; ++i) {
        const std::uint32_t keyframe = command.first_keyframe + i;
        const Page* page = find(plan.cache, plan.keyframes[keyframe].page);
        if (Result<void> valid = gpu::check_keyframe_page(plan, pass, index, keyframe, page);
            !valid) {
            return valid;
        }
    }
    return {};
}

Result<void>
EmbreeBackend::Impl::check_images(const FramePlan& plan, std::size_t pass, std::uint32_t index) {
    const Command& command = plan.commands[index];
    const Page* page = nullptr;
    for (std::uint32_t i = command.first; i < command.first + command.count; ++i) {
        const ImageQuad& quad = plan.quads[i];
        if (page == nullptr || page->id != quad.page) {
            page = find(plan.cache, quad.page);
        }
        if (Result<void> valid = gpu::check_image_page(plan, pass, index, i, page); !valid) {
            return valid;
        }
        // Only sizes that add up without overflow; what lies beyond the page is its last texel.
        const Region& source = quad.source;
        const bool possible = source.x >= 0 && source.y >= 0 && source.width >= 1 &&
                              source.height >= 1 && source.x <= kLargestPage &&
                              source.y <= kLargestPage && source.width <= kLargestPage &&
                              source.height <= kLargestPage;
        if (!possible) {
            return invalid(
                command_name(pass, index) + ", quad " + std::to_string(i) + " shows " +
                std::to_string(source.width) + " x " + std::to_string(source.height) +
                " texels at " + std::to_string(source.x) + ", " + std::to_string(source.y)
            );
        }
    }
    return {};
}

Result<void>
EmbreeBackend::Impl::check_layers(const FramePlan& plan, std::size_t pass, std::uint32_t index) {
    const Command& command = plan.commands[index];
    for (std::uint32_t i = command.first; i < command.first + command.count; ++i) {
        const bool exists = find(plan.cache, plan.layers[i].image) != nullptr;
        if (Result<void> valid = gpu::check_shown_layers(plan, pass, index, i, exists); !valid) {
            return valid;
        }
    }
    return {};
}

/// Ends the phase that takes in commands and begins another.
void EmbreeBackend::Impl::close_phase(const Pass& pass, Phase& phase) {
    add_listed_draws(*scene, pass, work);
    phase.draw_count = static_cast<std::uint32_t>(work.draws.size()) - phase.first_draw;
    phase.layer_count = static_cast<std::uint32_t>(work.layers.size()) - phase.first_layer;
    phase.quad_count = static_cast<std::uint32_t>(work.quads.size()) - phase.first_quad;
    phase.flat_count = static_cast<std::uint32_t>(work.flats.size()) - phase.first_flat;
    if (phase.draw_count + phase.layer_count + phase.quad_count + phase.flat_count > 0) {
        // Nearest first, so that what lies behind is not looked at; equal ones in the plan's order.
        std::sort(
            work.draws.begin() + phase.first_draw,
            work.draws.end(),
            [](const Draw& a, const Draw& b) {
                if (a.nearest != b.nearest) {
                    return a.nearest < b.nearest;
                }
                return a.use != b.use ? a.use < b.use : a.item_index < b.item_index;
            }
        );
        work.phases.push_back(phase);
        ++work.passes.back().phase_count;
    }
    begin_phase(phase);
}

void EmbreeBackend::Impl::begin_phase(Phase& phase) const noexcept {
    phase.first_draw = static_cast<std::uint32_t>(work.draws.size());
    phase.first_layer = static_cast<std::uint32_t>(work.layers.size());
    phase.first_quad = static_cast<std::uint32_t>(work.quads.size());
    phase.first_flat = static_cast<std::uint32_t>(work.flats.size());
}

void EmbreeBackend::Impl::add_keyframes(
    const FramePlan& plan, const Pass& pass, const Command& command
) {
    for (std::uint32_t i = 0; i < command.keyframe_count; ++i) {
        const Keyframe& keyframe = plan.keyframes[command.first_keyframe + i];
        work.keyframes.push_back(
            {.lookup = gpu::KeyframeLookup(gpu::keyframe_terms(keyframe, pass.view)),
             .page = find(plan.cache, keyframe.page),
             .node = keyframe.node}
        );
    }
}

/// Warps the layered images of a command, once for each sample of a pixel.
void EmbreeBackend::Impl::add_layers(
    const FramePlan& plan, const Pass& pass, const Command& command, std::uint32_t order
) {
    PoolExecutor executor(*pool);
    const std::vector<glm::vec2>& samples =
        places[static_cast<std::size_t>(work.passes.back().samples)];
    for (const ShownLayers& shown : std::span(plan.layers).subspan(command.first, command.count)) {
        PassLayers layers;
        layers.image = &find(plan.cache, shown.image)->content;
        layers.first_warped = static_cast<std::uint32_t>(work.warped_count);
        layers.order = order;
        layers.node = shown.node;
        if (options.positions) {
            layers.terms = layered_terms(*layers.image, pass.view);
        }
        for (const glm::vec2& place : samples) {
            if (work.warped_count == work.warped.size()) {
                work.warped.emplace_back();
            }
            const View view =
                samples.size() == 1 ? pass.view : gpu::view_of_sample(pass.view, glm::dvec2(place));
            warper.warp(
                *layers.image,
                view,
                executor,
                work.warped[work.warped_count++],
                options.positions,
                LayeredFront::depth
            );
        }
        work.layers.push_back(layers);
    }
}

void EmbreeBackend::Impl::add_commands(const FramePlan& plan, const Pass& pass) {
    Phase phase;
    begin_phase(phase);
    const std::vector<glm::vec2>& samples =
        places[static_cast<std::size_t>(work.passes.back().samples)];
    bool shows = false;  // something but masks in this phase
    bool writes = false; // depths of quads
    for (std::uint32_t c = 0; c < pass.command_count; ++c) {
        const Command& command = plan.commands[pass.first_command + c];
        const std::uint32_t order = c + 1;
        const bool layers = command.kind == Command::Kind::layers;
        const bool cast = draws_geometry(command) || layers;
        if (cast && (writes || (shows && command.kind == Command::Kind::mask))) {
            close_phase(pass, phase);
            shows = false;
            writes = false;
        }
        if (command.kind == Command::Kind::mask) {
            add_draws(*scene, plan, pass, command, order, work);
            continue;
        }
        shows = true;
        if (layers) {
            add_layers(plan, pass, command, order);
            continue;
        }
        if (cast) {
            add_keyframes(plan, pass, command);
            add_draws(*scene, plan, pass, command, order, work);
            continue;
        }
        if (command.kind == Command::Kind::splats) {
            add_splats(plan, pass, command, order, samples, work);
            continue;
        }
        if (command.kind == Command::Kind::cubes) {
            add_cubes(plan, pass, command, order, work);
            continue;
        }
        writes = writes || command.kind == Command::Kind::image_depths;
        const Page* page = nullptr;
        for (std::uint32_t i = command.first; i < command.first + command.count; ++i) {
            const ImageQuad& quad = plan.quads[i];
            if (page == nullptr || page->id != quad.page) {
                page = find(plan.cache, quad.page);
            }
            add_quad(plan, pass, command, quad, *page, order, work);
        }
    }
    close_phase(pass, phase);
}

void EmbreeBackend::Impl::add_pass(
    const FramePlan& plan, const Pass& pass, Target& frame, const FrameClear& clear
) {
    PassWork next;
    next.pass = &pass;
    if (pass.page == kNone<PageId>) {
        next.target = &frame;
        next.samples = frame.samples;
        next.clear = clear.enabled;
        next.clear_color = clear.color;
    } else {
        next.scratch = find(plan.cache, pass.page);
        next.samples = next.scratch->samples;
        const Page* copy = find(plan.cache, pass.copy_page);
        next.keeps_depth = copy != nullptr && copy->depth;
    }
    next.first_phase = static_cast<std::uint32_t>(work.phases.size());
    next.first_flat = static_cast<std::uint32_t>(work.flats.size());
    add_view(next);
    work.passes.push_back(next);
    add_commands(plan, pass);
    add_tiles(work);
}

void EmbreeBackend::Impl::draw_batch() {
    std::int32_t most_samples = 1;
    std::size_t most_draws = 0;
    for (const PassWork& pass : work.passes) {
        most_samples = std::max(most_samples, pass.samples);
    }
    for (const Phase& phase : work.phases) {
        most_draws = std::max<std::size_t>(most_draws, phase.draw_count);
    }
    for (const std::unique_ptr<Workspace>& workspace : workspaces) {
        workspace->reserve(most_draws, static_cast<std::size_t>(most_samples), options.positions);
    }
    pool->run(
        static_cast<std::uint32_t>(work.tiles.size()),
        [&](std::uint32_t task, unsigned thread) {
            const TileTask& tile = work.tiles[task];
            const auto samples = static_cast<std::size_t>(work.passes[tile.pass].samples);
            draw_tile(*scene, work, tile, places[samples], *workspaces[thread]);
        }
    );
}

void EmbreeBackend::Impl::copy_pass(const FramePlan& plan, const Pass& pass) noexcept {
    if (pass.copy_page == kNone<PageId>) {
        return;
    }
    const Page& from = *find(plan.cache, pass.page);
    Page& to = *find(plan.cache, pass.copy_page);
    const auto width = static_cast<std::size_t>(pass.copy.width);
    for (std::int32_t row = 0; row < pass.copy.height; ++row) {
        const std::size_t source =
            texels_of(pass.scissor.y + row, from.size) + static_cast<std::size_t>(pass.scissor.x);
        const std::size_t place =
            texels_of(pass.copy.y + row, to.size) + static_cast<std::size_t>(pass.copy.x);
        std::copy_n(from.colors.get() + source, width, to.colors.get() + place);
        if (to.depth) {
            std::copy_n(from.depths.get() + source, width, to.depths.get() + place);
        }
        if (options.positions) {
            std::copy_n(from.positions.get() + source, width, to.positions.get() + place);
        }
    }
}

Result<void>
EmbreeBackend::Impl::run(const FramePlan& plan, Target& frame, const FrameClear& clear) {
    for (const PageUpdate& update : plan.pages) {
        if (Result<void> updated = update_page(plan.cache, update); !updated) {
            return updated;
        }
    }
    for (const LayeredUpdate& update : plan.layered_updates) {
        if (Result<void> updated = update_layers(plan.cache, update); !updated) {
            return updated;
        }
    }
    if (Result<void> valid = check_pages(plan, frame); !valid) {
        return valid;
    }
    for (std::size_t first = 0; first < plan.passes.size();) {
        std::size_t last = first;
        work.clear();
        for (; last < plan.passes.size() && plan.passes[last].batch == plan.passes[first].batch;
             ++last) {
            add_pass(plan, plan.passes[last], frame, clear);
        }
        draw_batch();
        for (; first < last; ++first) {
            copy_pass(plan, plan.passes[first]);
        }
    }
    return {};
}

EmbreeBackend::EmbreeBackend(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
EmbreeBackend::~EmbreeBackend() = default;

Result<std::unique_ptr<EmbreeBackend>> EmbreeBackend::create(
    const Scene& scene, const Hierarchy* hierarchy, const EmbreeBackendOptions& options
) {
    if (options.threads > kMostThreads) {
        return fail(
            ErrorCode::invalid_argument,
            "Embree: threads is " + std::to_string(options.threads) + ", expected 0 to " +
                std::to_string(kMostThreads)
        );
    }
    auto impl = std::make_unique<Impl>();
    impl->options = options;
    const unsigned cores = std::clamp(std::thread::hardware_concurrency(), 1U, kMostThreads);
    const unsigned threads = options.threads == 0 ? cores : options.threads;
    Result<std::unique_ptr<CastScene>> made = CastScene::create(scene, hierarchy);
    if (!made) {
        return tl::unexpected(std::move(made).error());
    }
    impl->scene = std::move(*made);
    for (std::int32_t samples = 1; samples <= kMostSamples; ++samples) {
        impl->places[static_cast<std::size_t>(samples)] = sample_places(samples);
    }
    for (unsigned thread = 0; thread < threads; ++thread) {
        impl->workspaces.push_back(std::make_unique<Workspace>());
    }
    try {
        impl->pool = std::make_unique<WorkerPool>(threads);
    } catch (const std::system_error& error) {
        return fail(
            ErrorCode::device,
            "Embree: cannot start " + std::to_string(threads) + " threads: " + error.what()
        );
    }
    return std::unique_ptr<EmbreeBackend>(new EmbreeBackend(std::move(impl)));
}

Result<void>
EmbreeBackend::execute(const FramePlan& plan, TargetId target, const FrameClear& clear) noexcept {
    Target* frame = impl_->target(target);
    if (frame == nullptr) {
        return no_target(target);
    }
    if (Result<void> valid = gpu::check_structure(plan); !valid) {
        return valid;
    }
    try {
        return impl_->run(plan, *frame, clear);
    } catch (const std::bad_alloc&) {
        return no_memory("the work of a plan of " + std::to_string(plan.passes.size()) + " passes");
    }
}

Result<TargetId> EmbreeBackend::create_target(
    std::int32_t width, std::int32_t height, std::int32_t samples
) noexcept {
    if (Result<void> valid = gpu::check_target(width, height, samples, kMostSamples); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    Target target;
    target.width = width;
    target.height = height;
    target.samples = impl_->samples_of(samples);
    const std::size_t pixels = texels_of(width, height);
    target.colors = allocate<std::uint32_t>(pixels);
    target.depths = allocate<float>(pixels);
    bool whole = target.colors != nullptr && target.depths != nullptr;
    if (whole && target.samples > 1) {
        const std::size_t stored = pixels * static_cast<std::size_t>(target.samples);
        target.mixed = allocate<std::uint8_t>(pixels);
        target.sample_colors = allocate<std::uint32_t>(stored);
        target.sample_depths = allocate<float>(stored);
        whole = target.mixed != nullptr && target.sample_colors != nullptr &&
                target.sample_depths != nullptr;
    }
    if (whole && impl_->options.positions) {
        target.positions = allocate<PositionTexel>(pixels);
        whole = target.positions != nullptr;
    }
    if (!whole) {
        return no_memory(
            "a target of " + std::to_string(width) + " x " + std::to_string(height) +
            " pixels with " + std::to_string(target.samples) + " samples"
        );
    }
    if (impl_->options.positions) {
        std::fill_n(target.positions.get(), pixels, PositionTexel());
    }
    impl_->targets.push_back(std::move(target));
    return make_id<TargetId>(impl_->targets.size());
}

void EmbreeBackend::destroy_target(TargetId target) noexcept {
    if (Target* old = impl_->target(target)) {
        *old = {};
    }
}

Result<Picture> EmbreeBackend::read_target(TargetId target) {
    const Target* read = impl_->target(target);
    if (read == nullptr) {
        return no_target(target);
    }
    Picture picture;
    picture.width = read->width;
    picture.height = read->height;
    const auto width = static_cast<std::size_t>(read->width);
    const auto height = static_cast<std::size_t>(read->height);
    picture.rgba.resize(width * height * 4);
    // Rows of a target go up, a picture's go down.
    for (std::size_t row = 0; row < height; ++row) {
        std::memcpy(
            &picture.rgba[row * width * 4],
            read->colors.get() + (height - 1 - row) * width,
            width * 4
        );
    }
    return picture;
}

Result<PositionPicture> EmbreeBackend::read_positions(TargetId target) {
    const Target* read = impl_->target(target);
    if (read == nullptr) {
        return no_target(target);
    }
    if (read->positions == nullptr) {
        return fail(
            ErrorCode::unsupported,
            "Embree: target " + std::to_string(index_of(target)) + " keeps no positions"
        );
    }
    PositionPicture picture;
    picture.width = read->width;
    picture.height = read->height;
    const auto width = static_cast<std::size_t>(read->width);
    const auto height = static_cast<std::size_t>(read->height);
    picture.texels.reserve(width * height);
    for (std::size_t row = height; row > 0; --row) {
        const PositionTexel* first = read->positions.get() + (row - 1) * width;
        picture.texels.insert(picture.texels.end(), first, first + width);
    }
    return picture;
}

Backend::Limits EmbreeBackend::limits() const noexcept {
    return {
        .page_size = kLargestPage, .samples = kMostSamples, .positions = impl_->options.positions};
}

std::string EmbreeBackend::device() const {
    return std::string("Embree ") + RTC_VERSION_STRING + ", " +
           std::to_string(impl_->pool->threads()) +
           (impl_->pool->threads() == 1 ? " thread" : " threads");
}

std::uint64_t EmbreeBackend::image_bytes() const noexcept {
    std::uint64_t bytes = 0;
    for (const std::unique_ptr<Page>& page : impl_->pages) {
        bytes += gpu::page_bytes(*page, page->samples);
    }
    for (const std::unique_ptr<KeptLayers>& image : impl_->layered) {
        bytes += gpu::layered_bytes(image->content);
    }
    return bytes;
}

std::uint64_t EmbreeBackend::position_bytes() const noexcept {
    std::uint64_t bytes = 0;
    for (const std::unique_ptr<Page>& page : impl_->pages) {
        bytes += page->positions == nullptr
                     ? 0
                     : std::uint64_t{texels_of(page->size, page->size)} * sizeof(PositionTexel);
    }
    for (const std::unique_ptr<KeptLayers>& image : impl_->layered) {
        bytes += std::uint64_t{image->content.points.size()} * sizeof(PositionTexel);
    }
    return bytes;
}

Result<void> EmbreeBackend::set_transform(ItemId item, const glm::dmat4x3& object_to_world) {
    return impl_->scene->set_transform(item, object_to_world);
}

std::uint64_t EmbreeBackend::scene_bytes() const noexcept {
    return impl_->scene->bytes();
}

} // namespace farfield::embree
