#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/gpu/plan_rules.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace farfield {

namespace {

/// Depths are floats, a technique's comes from another formula than the lens's: relative rounding.
constexpr double kDepthRounding = 1e-4;

/// Frames are floats and may be products of several rotations.
constexpr float kFrameRounding = 1e-4F;

struct NullPage : gpu::PageFacts {
    std::uint32_t cache = 0;
    PageId id = kNone<PageId>;
    std::int32_t samples = 1;
    std::vector<Region> images; ///< copied as a whole, disjoint, ordered by y, then x
};

struct NullLayers {
    std::uint32_t cache = 0;
    LayeredImageId id = kNone<LayeredImageId>;
    std::uint64_t bytes = 0;
    std::uint64_t point_bytes = 0;
    bool made = true; ///< false after an error: it has to be handed over once more
};

struct NullTarget {
    std::int32_t width = 0; ///< [px] 0: destroyed
    std::int32_t height = 0;
};

/// Neighbouring pieces of one item in `Hierarchy::primitives`.
struct PieceRun {
    ItemId item = kNone<ItemId>;
    std::uint32_t first = 0;
    std::uint64_t end = 0;
};

bool before(const Region& a, const Region& b) noexcept {
    return a.y != b.y ? a.y < b.y : a.x < b.x;
}

bool is_finite(const glm::vec3& v) noexcept {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Axes of length 1, normal to each other; a mirrored frame is none.
bool is_rotation(const glm::mat3& frame) noexcept {
    const glm::mat3 product = glm::transpose(frame) * frame;
    for (int column = 0; column < 3; ++column) {
        for (int row = 0; row < 3; ++row) {
            const float expected = row == column ? 1.0F : 0.0F;
            if (!(std::abs(product[column][row] - expected) <= kFrameRounding)) {
                return false;
            }
        }
    }
    return glm::determinant(frame) > 0.0F;
}

std::string text(const Region& region) {
    return std::to_string(region.width) + " x " + std::to_string(region.height) + " at " +
           std::to_string(region.x) + ", " + std::to_string(region.y);
}

std::string page_name(PageId id) {
    return "page " + std::to_string(index_of(id));
}

tl::unexpected<Error> invalid(std::string what) {
    return fail(ErrorCode::invalid_argument, "plan: " + std::move(what));
}

tl::unexpected<Error> no_target(TargetId target) {
    return fail(
        ErrorCode::invalid_argument,
        "null backend: target " + std::to_string(index_of(target)) + " does not exist"
    );
}

} // namespace

struct NullBackend::Impl {
    std::vector<std::uint64_t> item_primitives;
    std::vector<PieceRun> runs; ///< ordered by `first`; empty: pieces are not known
    bool runs_known = false;
    Limits limits;
    std::vector<NullPage> pages;
    std::vector<NullLayers> layered;
    std::vector<NullTarget> targets; ///< TargetId is the position plus one
    std::vector<std::uint32_t> by_row;
    std::vector<std::uint32_t> in_order; ///< primitives of a selection
    PlanWork total;
    std::uint64_t plans = 0;

    [[nodiscard]] NullPage* find(std::uint32_t cache, PageId id) noexcept {
        const auto found = std::find_if(pages.begin(), pages.end(), [&](const NullPage& page) {
            return page.cache == cache && page.id == id;
        });
        return found == pages.end() ? nullptr : &*found;
    }
    [[nodiscard]] NullLayers* find(std::uint32_t cache, LayeredImageId id) noexcept {
        const auto found = std::find_if(layered.begin(), layered.end(), [&](const NullLayers& of) {
            return of.cache == cache && of.id == id;
        });
        return found == layered.end() ? nullptr : &*found;
    }
    [[nodiscard]] const NullTarget* target(TargetId id) const noexcept {
        const std::size_t index = index_of(id);
        const bool exists = index >= 1 && index <= targets.size() && targets[index - 1].width > 0;
        return exists ? &targets[index - 1] : nullptr;
    }

    [[nodiscard]] Result<void> run(const FramePlan& plan, const NullTarget& frame);
    [[nodiscard]] Result<void> check_numbers(const FramePlan& plan) const;
    [[nodiscard]] Result<void> update_page(std::uint32_t cache, const PageUpdate& update);
    [[nodiscard]] Result<void> update_layers(std::uint32_t cache, const LayeredUpdate& update);
    [[nodiscard]] Result<void>
    check_pass(const FramePlan& plan, std::size_t pass, const NullTarget& frame);
    [[nodiscard]] Result<void>
    check_geometry(const FramePlan& plan, std::size_t pass, std::uint32_t command);
    [[nodiscard]] Result<void> check_selection(
        const FramePlan& plan, std::size_t pass, std::uint32_t command, std::uint32_t selection
    );
    [[nodiscard]] Result<void>
    check_keyframes(const FramePlan& plan, std::size_t pass, std::uint32_t command);
    [[nodiscard]] Result<void>
    check_images(const FramePlan& plan, std::size_t pass, std::uint32_t command);
    [[nodiscard]] Result<void>
    check_layers(const FramePlan& plan, std::size_t pass, std::uint32_t command);
    [[nodiscard]] Result<void>
    check_disjoint(const FramePlan& plan, std::size_t first, std::size_t last);
    void copy(const FramePlan& plan, const Pass& pass);
    [[nodiscard]] bool piece_exists(const Piece& piece) const noexcept;
};

Result<void> NullBackend::Impl::check_numbers(const FramePlan& plan) const {
    for (std::size_t i = 0; i < plan.quads.size(); ++i) {
        const ImageQuad& quad = plan.quads[i];
        if (!is_finite(quad.origin) || !is_finite(quad.edge_u) || !is_finite(quad.edge_v) ||
            !std::isfinite(quad.depth) || !is_finite(quad.viewpoint) ||
            !std::isfinite(quad.near_ratio) || !std::isfinite(quad.far_ratio)) {
            return invalid("quad " + std::to_string(i) + " has a number that is not finite");
        }
        if (quad.near_ratio < 0.0F || quad.near_ratio > quad.far_ratio) {
            return invalid(
                "quad " + std::to_string(i) + " keeps depths of " +
                std::to_string(quad.near_ratio) + " to " + std::to_string(quad.far_ratio) +
                " of its distance"
            );
        }
    }
    for (std::size_t i = 0; i < plan.clips.size(); ++i) {
        if (!farfield::is_finite(plan.clips[i]) || is_empty(plan.clips[i])) {
            return invalid("clip box " + std::to_string(i) + " is empty or not finite");
        }
    }
    for (std::size_t i = 0; i < plan.cube_frames.size(); ++i) {
        if (!is_rotation(plan.cube_frames[i])) {
            return invalid("cube frame " + std::to_string(i) + " is no rotation");
        }
    }
    return {};
}

Result<void> NullBackend::Impl::update_page(std::uint32_t cache, const PageUpdate& update) {
    NullPage* page = find(cache, update.page);
    if (update.action == PageUpdate::Action::destroy) {
        if (page != nullptr) {
            std::swap(*page, pages.back());
            pages.pop_back();
        }
        return {};
    }
    if (Result<void> valid = gpu::check_page(update, limits.page_size, limits.samples); !valid) {
        return valid;
    }
    if (page == nullptr) {
        page = &pages.emplace_back();
    }
    page->cache = cache;
    page->id = update.page;
    page->size = update.size;
    page->samples = update.samples;
    page->scratch = update.scratch;
    page->depth = update.depth;
    page->images.clear();
    return {};
}

Result<void> NullBackend::Impl::update_layers(std::uint32_t cache, const LayeredUpdate& update) {
    if (Result<void> valid = gpu::check_layered_update(update); !valid) {
        return valid;
    }
    NullLayers* image = find(cache, update.image);
    if (update.action == LayeredUpdate::Action::destroy) {
        if (image != nullptr) {
            std::swap(*image, layered.back());
            layered.pop_back();
        }
        return {};
    }
    if (image == nullptr) {
        image = &layered.emplace_back();
    }
    const LayeredDepthImage& content = *update.content;
    const std::uint64_t bytes = gpu::layered_bytes(content);
    *image = {cache, update.image, bytes, memory_bytes(content) - bytes};
    return {};
}

bool NullBackend::Impl::piece_exists(const Piece& piece) const noexcept {
    const std::size_t item = index_of(piece.item);
    if (item >= item_primitives.size() || piece.count == 0 || piece.count > item_primitives[item]) {
        return false;
    }
    if (!runs_known) {
        return true;
    }
    const auto after = std::upper_bound(
        runs.begin(),
        runs.end(),
        piece.first,
        [](std::uint32_t first, const PieceRun& run) { return first < run.first; }
    );
    if (after == runs.begin()) {
        return false;
    }
    const PieceRun& run = *(after - 1);
    return run.item == piece.item && std::uint64_t{piece.first} + piece.count <= run.end;
}

Result<void> NullBackend::Impl::check_selection(
    const FramePlan& plan, std::size_t pass, std::uint32_t command, std::uint32_t index
) {
    const Selection& selection = plan.selections[index];
    const auto refused = [&](const std::string& what) {
        return invalid(
            "pass " + std::to_string(pass) + ", command " + std::to_string(command) +
            ": selections[" + std::to_string(index) + "] " + what
        );
    };
    const std::size_t item = index_of(selection.item);
    if (item >= item_primitives.size()) {
        return refused(
            "is of item " + std::to_string(item) + " of " + std::to_string(item_primitives.size())
        );
    }
    const auto first = plan.selected.begin() + static_cast<std::ptrdiff_t>(selection.first);
    in_order.assign(first, first + static_cast<std::ptrdiff_t>(selection.count));
    std::sort(in_order.begin(), in_order.end());
    if (!in_order.empty() && in_order.back() >= item_primitives[item]) {
        return refused(
            "has primitive " + std::to_string(in_order.back()) + " of item " +
            std::to_string(item) + ", which has " + std::to_string(item_primitives[item])
        );
    }
    const auto twice = std::adjacent_find(in_order.begin(), in_order.end());
    if (twice != in_order.end()) {
        return refused(
            "has primitive " + std::to_string(*twice) + " of item " + std::to_string(item) +
            " twice"
        );
    }
    return {};
}

Result<void>
NullBackend::Impl::check_geometry(const FramePlan& plan, std::size_t pass, std::uint32_t index) {
    const Command& command = plan.commands[index];
    const auto refused = [&](const std::string& what) {
        return invalid(
            "pass " + std::to_string(pass) + ", command " + std::to_string(index) + ": " + what
        );
    };
    for (std::uint32_t i = command.first; i < command.first + command.count; ++i) {
        if (index_of(plan.items[i]) >= item_primitives.size()) {
            return refused(
                "items[" + std::to_string(i) + "] is item " +
                std::to_string(index_of(plan.items[i])) + " of " +
                std::to_string(item_primitives.size())
            );
        }
    }
    for (std::uint32_t i = command.first_piece; i < command.first_piece + command.piece_count;
         ++i) {
        const Piece& piece = plan.pieces[i];
        if (!piece_exists(piece)) {
            return refused(
                "pieces[" + std::to_string(i) + "], primitives " + std::to_string(piece.first) +
                " to " + std::to_string(std::uint64_t{piece.first} + piece.count) +
                ", is no run of" + " item " + std::to_string(index_of(piece.item))
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

Result<void>
NullBackend::Impl::check_keyframes(const FramePlan& plan, std::size_t pass, std::uint32_t index) {
    const Command& command = plan.commands[index];
    for (std::uint32_t i = 0; i < command.keyframe_count; ++i) {
        const std::uint32_t keyframe = command.first_keyframe + i;
        const Region& source = plan.keyframes[keyframe].source;
        const PageId id = plan.keyframes[keyframe].page;
        const NullPage* page = find(plan.cache, id);
        if (Result<void> valid = gpu::check_keyframe_page(plan, pass, index, keyframe, page);
            !valid) {
            return valid;
        }
        // What was copied is apart, so that the parts add up.
        std::uint64_t made = 0;
        for (const Region& image : page->images) {
            made += area(intersect(image, source));
        }
        if (made != area(source)) {
            return invalid(
                "pass " + std::to_string(pass) + ", command " + std::to_string(index) +
                ": keyframe " + std::to_string(keyframe) + " shows " + text(source) + " of " +
                page_name(id) + ", of which only " + std::to_string(made) + " texels were made"
            );
        }
    }
    return {};
}

Result<void> NullBackend::Impl::check_images(
    const FramePlan& plan, std::size_t pass_index, std::uint32_t index
) {
    const Pass& pass = plan.passes[pass_index];
    const Command& command = plan.commands[index];
    const auto refused = [&](std::uint32_t quad, const std::string& what) {
        return invalid(
            "pass " + std::to_string(pass_index) + ", command " + std::to_string(index) +
            ": quad " + std::to_string(quad) + " " + what
        );
    };
    const double nearest = pass.view.lens.near_distance;
    const double farthest = pass.view.lens.far_distance * (1.0 + kDepthRounding);
    const NullPage* page = nullptr;
    for (std::uint32_t i = command.first; i < command.first + command.count; ++i) {
        const ImageQuad& quad = plan.quads[i];
        if (page == nullptr || page->id != quad.page) {
            page = find(plan.cache, quad.page);
        }
        if (Result<void> valid = gpu::check_image_page(plan, pass_index, index, i, page); !valid) {
            return valid;
        }
        // A quad nearly always shows a whole image; any part of one is as good.
        const std::vector<Region>& images = page->images;
        const bool inside = quad.source.x >= 0 && quad.source.y >= 0 && quad.source.width >= 1 &&
                            quad.source.height >= 1 && quad.source.width <= page->size &&
                            quad.source.height <= page->size && quad.source.x <= page->size &&
                            quad.source.y <= page->size;
        const auto holds = [&](const Region& image) { return contains(image, quad.source); };
        const auto found = std::lower_bound(images.begin(), images.end(), quad.source, before);
        const bool whole = inside && found != images.end() && holds(*found);
        if (!whole && !(inside && std::any_of(images.begin(), images.end(), holds))) {
            return refused(
                i,
                "shows " + text(quad.source) + " of " + page_name(quad.page) +
                    ", where no image was made"
            );
        }
        if (command.depth != QuadDepth::none) {
            continue; // in depth by its plane or texels, wherever they are
        }
        // What is baked into an image may be out of view; what is in the frame is seen.
        const double depth = double{quad.depth};
        if (depth < nearest || (pass.page == kNone<PageId> && depth > farthest)) {
            return refused(
                i,
                "stands at depth " + std::to_string(depth) + ", outside " +
                    std::to_string(nearest) + " to " + std::to_string(farthest)
            );
        }
    }
    return {};
}

Result<void>
NullBackend::Impl::check_layers(const FramePlan& plan, std::size_t pass, std::uint32_t index) {
    const Command& command = plan.commands[index];
    for (std::uint32_t i = command.first; i < command.first + command.count; ++i) {
        const NullLayers* image = find(plan.cache, plan.layers[i].image);
        const bool exists = image != nullptr && image->made;
        if (Result<void> valid = gpu::check_shown_layers(plan, pass, index, i, exists); !valid) {
            return valid;
        }
    }
    return {};
}

Result<void>
NullBackend::Impl::check_pass(const FramePlan& plan, std::size_t index, const NullTarget& frame) {
    const Pass& pass = plan.passes[index];
    if (Result<void> valid = gpu::check_places(
            plan,
            index,
            {0, 0, frame.width, frame.height},
            find(plan.cache, pass.page),
            find(plan.cache, pass.copy_page)
        );
        !valid) {
        return valid;
    }
    for (std::uint32_t i = 0; i < pass.command_count; ++i) {
        const std::uint32_t command = pass.first_command + i;
        Result<void> valid;
        if (draws_images(plan.commands[command])) {
            valid = check_images(plan, index, command);
        } else if (draws_geometry(plan.commands[command])) {
            valid = check_geometry(plan, index, command);
            if (valid) {
                valid = check_keyframes(plan, index, command);
            }
        } else if (plan.commands[command].kind == Command::Kind::layers) {
            valid = check_layers(plan, index, command);
        }
        if (!valid) {
            return valid;
        }
    }
    return {};
}

Result<void>
NullBackend::Impl::check_disjoint(const FramePlan& plan, std::size_t first, std::size_t last) {
    const auto scissor = [&](std::uint32_t pass) -> const Region& {
        return plan.passes[pass].scissor;
    };
    by_row.clear();
    for (std::size_t pass = first; pass < last; ++pass) {
        by_row.push_back(static_cast<std::uint32_t>(pass));
    }
    std::sort(by_row.begin(), by_row.end(), [&](std::uint32_t a, std::uint32_t b) {
        return scissor(a).y != scissor(b).y ? scissor(a).y < scissor(b).y : a < b;
    });
    for (std::size_t i = 0; i < by_row.size(); ++i) {
        const Region& lower = scissor(by_row[i]);
        for (std::size_t k = i + 1;
             k < by_row.size() && scissor(by_row[k]).y < lower.y + lower.height;
             ++k) {
            if (overlaps(lower, scissor(by_row[k]))) {
                return invalid(
                    "passes " + std::to_string(std::min(by_row[i], by_row[k])) + " and " +
                    std::to_string(std::max(by_row[i], by_row[k])) + " of batch " +
                    std::to_string(plan.passes[first].batch) + " both draw to " +
                    text(scissor(by_row[k]))
                );
            }
        }
    }
    return {};
}

void NullBackend::Impl::copy(const FramePlan& plan, const Pass& pass) {
    if (pass.copy_page == kNone<PageId>) {
        return;
    }
    std::vector<Region>& images = find(plan.cache, pass.copy_page)->images;
    std::erase_if(images, [&](const Region& image) { return overlaps(image, pass.copy); });
    images.insert(std::lower_bound(images.begin(), images.end(), pass.copy, before), pass.copy);
}

Result<void> NullBackend::Impl::run(const FramePlan& plan, const NullTarget& frame) {
    if (Result<void> valid = gpu::check_structure(plan); !valid) {
        return valid;
    }
    if (Result<void> valid = check_numbers(plan); !valid) {
        return valid;
    }
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
    for (std::size_t first = 0; first < plan.passes.size();) {
        std::size_t last = first;
        while (last < plan.passes.size() && plan.passes[last].batch == plan.passes[first].batch) {
            if (Result<void> valid = check_pass(plan, last, frame); !valid) {
                return valid;
            }
            ++last;
        }
        if (Result<void> valid = check_disjoint(plan, first, last); !valid) {
            return valid;
        }
        for (; first < last; ++first) {
            copy(plan, plan.passes[first]);
        }
    }
    return {};
}

NullBackend::NullBackend(
    std::span<const std::uint64_t> item_primitives, const Hierarchy* hierarchy, const Limits& limits
)
    : impl_(std::make_unique<Impl>()) {
    impl_->item_primitives.assign(item_primitives.begin(), item_primitives.end());
    impl_->limits = limits;
    if (hierarchy != nullptr) {
        impl_->runs_known = true;
        for (const Piece& piece : hierarchy->pieces) {
            const std::uint64_t end = std::uint64_t{piece.first} + piece.count;
            const bool joins = !impl_->runs.empty() && impl_->runs.back().item == piece.item &&
                               impl_->runs.back().end == piece.first;
            if (joins) {
                impl_->runs.back().end = end;
            } else {
                impl_->runs.push_back({piece.item, piece.first, end});
            }
        }
    }
}

NullBackend::~NullBackend() = default;

Result<void> NullBackend::execute(
    const FramePlan& plan, TargetId target, const FrameClear& /*clear*/
) noexcept {
    const NullTarget* frame = impl_->target(target);
    if (frame == nullptr) {
        return no_target(target);
    }
    if (Result<void> run = impl_->run(plan, *frame); !run) {
        for (NullPage& page : impl_->pages) {
            if (page.cache == plan.cache) {
                page.images.clear();
            }
        }
        for (NullLayers& image : impl_->layered) {
            image.made = image.made && image.cache != plan.cache;
        }
        return run;
    }
    const PlanWork work = work_of(plan, impl_->item_primitives);
    impl_->total.triangles += work.triangles;
    impl_->total.draws += work.draws;
    impl_->total.image_quads += work.image_quads;
    impl_->total.images += work.images;
    impl_->total.image_texels += work.image_texels;
    impl_->total.splats += work.splats;
    impl_->total.cubes += work.cubes;
    impl_->total.layered_images += work.layered_images;
    ++impl_->plans;
    return {};
}

Result<TargetId>
NullBackend::create_target(std::int32_t width, std::int32_t height, std::int32_t samples) noexcept {
    if (Result<void> valid = gpu::check_target(width, height, samples, impl_->limits.samples);
        !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    impl_->targets.push_back({width, height});
    return make_id<TargetId>(impl_->targets.size());
}

void NullBackend::destroy_target(TargetId target) noexcept {
    if (impl_->target(target) != nullptr) {
        impl_->targets[index_of(target) - 1] = {};
    }
}

Result<Picture> NullBackend::read_target(TargetId target) {
    if (impl_->target(target) == nullptr) {
        return no_target(target);
    }
    return fail(
        ErrorCode::unsupported,
        "null backend: target " + std::to_string(index_of(target)) + " holds no picture"
    );
}

Result<PositionPicture> NullBackend::read_positions(TargetId target) {
    if (impl_->target(target) == nullptr) {
        return no_target(target);
    }
    return fail(
        ErrorCode::unsupported,
        "null backend: target " + std::to_string(index_of(target)) + " holds no positions"
    );
}

Backend::Limits NullBackend::limits() const noexcept {
    return impl_->limits;
}

std::uint64_t NullBackend::image_bytes() const noexcept {
    std::uint64_t bytes = 0;
    for (const NullPage& page : impl_->pages) {
        bytes += gpu::page_bytes(page, page.samples);
    }
    for (const NullLayers& image : impl_->layered) {
        bytes += image.bytes;
    }
    return bytes;
}

std::uint64_t NullBackend::position_bytes() const noexcept {
    std::uint64_t bytes = 0;
    for (const NullPage& page : impl_->pages) {
        bytes += static_cast<std::uint64_t>(page.size) * static_cast<std::uint64_t>(page.size) *
                 sizeof(PositionTexel);
    }
    for (const NullLayers& image : impl_->layered) {
        bytes += image.point_bytes;
    }
    return impl_->limits.positions ? bytes : 0;
}

const PlanWork& NullBackend::total_work() const noexcept {
    return impl_->total;
}

std::uint64_t NullBackend::plans_executed() const noexcept {
    return impl_->plans;
}

} // namespace farfield
