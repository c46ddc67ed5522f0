#include <farfield/gpu/plan_rules.hpp>
#include <farfield/math/view.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

namespace farfield::gpu {

namespace {

constexpr std::int32_t kMostPixels = 16384;

tl::unexpected<Error> invalid(std::string what) {
    return fail(ErrorCode::invalid_argument, "plan: " + std::move(what));
}

std::string pass_name(std::size_t pass) {
    return "pass " + std::to_string(pass);
}

std::string text(const Region& region) {
    return std::to_string(region.width) + " x " + std::to_string(region.height) + " at " +
           std::to_string(region.x) + ", " + std::to_string(region.y);
}

/// Within what a page or a target can have at most, so that sums of edges do not overflow.
bool possible(const Region& region) noexcept {
    return region.x >= 0 && region.y >= 0 && region.width >= 1 && region.height >= 1 &&
           region.x <= kMostPixels && region.y <= kMostPixels && region.width <= kMostPixels &&
           region.height <= kMostPixels;
}

bool in_range(std::uint32_t first, std::uint32_t count, std::size_t size) noexcept {
    return std::size_t{first} + count <= size;
}

tl::unexpected<Error> out_of_range(
    std::size_t pass,
    std::uint32_t command,
    const char* what,
    std::uint32_t first,
    std::uint32_t count,
    std::size_t size
) {
    return invalid(
        pass_name(pass) + ", command " + std::to_string(command) + ": " + what + " " +
        std::to_string(first) + " to " + std::to_string(std::uint64_t{first} + count) + " of " +
        std::to_string(size)
    );
}

/// Of what a command draws, or null for a kind that there is not.
const char* kind_name(Command::Kind kind) noexcept {
    switch (kind) {
    case Command::Kind::geometry:
    case Command::Kind::mask:
        return "geometry";
    case Command::Kind::projected:
        return "projected geometry";
    case Command::Kind::images:
    case Command::Kind::image_depths:
        return "images";
    case Command::Kind::splats:
        return "splats";
    case Command::Kind::cubes:
        return "cubes";
    case Command::Kind::layers:
        return "layered images";
    }
    return nullptr;
}

Result<void> check_command(const FramePlan& plan, std::size_t pass, std::uint32_t index) {
    const Command& command = plan.commands[index];
    const auto refused = [&](const std::string& what) {
        return invalid(pass_name(pass) + ", command " + std::to_string(index) + ": " + what);
    };
    const auto depth_name = [&] {
        return "depth " + std::to_string(static_cast<unsigned>(command.depth));
    };
    const char* const name = kind_name(command.kind);
    if (name == nullptr) {
        return refused("unknown kind " + std::to_string(static_cast<unsigned>(command.kind)));
    }
    if (!draws_geometry(command)) {
        if (command.piece_count != 0) {
            return refused(
                std::string(name) + " with " + std::to_string(command.piece_count) + " pieces"
            );
        }
        if (command.selection_count != 0) {
            return refused(
                std::string(name) + " with " + std::to_string(command.selection_count) +
                " selections"
            );
        }
        if (command.clip != Command::kNoClip) {
            return refused(std::string(name) + " with clip box " + std::to_string(command.clip));
        }
    }
    if (command.kind != Command::Kind::projected) {
        if (command.keyframe_count != 0) {
            return refused(
                std::string(name) + " with " + std::to_string(command.keyframe_count) + " keyframes"
            );
        }
        if (command.whole_triangles) {
            return refused(std::string(name) + " that shows keyframes on whole triangles");
        }
    }
    if (!draws_images(command) && command.depth != QuadDepth::none) {
        return refused(std::string(name) + " with " + depth_name() + " of images");
    }
    const auto within =
        [&](const char* what, std::uint32_t first, std::uint32_t count, std::size_t size
        ) -> Result<void> {
        if (!in_range(first, count, size)) {
            return out_of_range(pass, index, what, first, count, size);
        }
        return {};
    };
    switch (command.kind) {
    case Command::Kind::images:
    case Command::Kind::image_depths:
        if (command.depth > QuadDepth::texel) {
            return refused("images with unknown " + depth_name());
        }
        if (command.kind == Command::Kind::image_depths && command.depth == QuadDepth::none) {
            return refused("depths of images with none");
        }
        return within("quads", command.first, command.count, plan.quads.size());
    case Command::Kind::splats:
        return within("splats", command.first, command.count, plan.splats.size());
    case Command::Kind::cubes:
        return within("cubes", command.first, command.count, plan.cubes.size());
    case Command::Kind::layers:
        return within("layered images", command.first, command.count, plan.layers.size());
    case Command::Kind::projected:
        if (command.keyframe_count == 0 || command.keyframe_count > kMostKeyframes) {
            return refused(
                std::string(name) + " with " + std::to_string(command.keyframe_count) +
                " keyframes, expected 1 to " + std::to_string(kMostKeyframes)
            );
        }
        break;
    case Command::Kind::geometry:
    case Command::Kind::mask:
        break;
    }
    Result<void> valid = within("items", command.first, command.count, plan.items.size());
    if (valid) {
        valid = within("pieces", command.first_piece, command.piece_count, plan.pieces.size());
    }
    if (valid) {
        valid = within(
            "selections", command.first_selection, command.selection_count, plan.selections.size()
        );
    }
    if (valid && command.clip != Command::kNoClip) {
        valid = within("clip box", command.clip, 1, plan.clips.size());
    }
    if (valid) {
        valid = within(
            "keyframes", command.first_keyframe, command.keyframe_count, plan.keyframes.size()
        );
    }
    return valid;
}

/// No pass of the batch copies to a page that a command of this one projects.
Result<void> check_finished(const FramePlan& plan, std::size_t pass, std::uint32_t index) {
    const Command& command = plan.commands[index];
    const std::uint32_t batch = plan.passes[pass].batch;
    const auto copies = [&](std::size_t other) {
        const PageId page = plan.passes[other].copy_page;
        for (std::uint32_t i = 0; page != kNone<PageId> && i < command.keyframe_count; ++i) {
            if (plan.keyframes[command.first_keyframe + i].page == page) {
                return true;
            }
        }
        return false;
    };
    std::size_t first = pass;
    while (first > 0 && plan.passes[first - 1].batch == batch) {
        --first;
    }
    for (std::size_t other = first; other < plan.passes.size() && plan.passes[other].batch == batch;
         ++other) {
        if (copies(other)) {
            return invalid(
                pass_name(pass) + ", command " + std::to_string(index) + ": projects page " +
                std::to_string(index_of(plan.passes[other].copy_page)) + ", which " +
                pass_name(other) + " of the same batch copies to"
            );
        }
    }
    return {};
}

bool is_finite(const glm::vec3& v) noexcept {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Finite and not negative.
bool is_size(float size) noexcept {
    return size >= 0.0F && std::isfinite(size);
}

bool is_premultiplied(const glm::vec<4, std::uint8_t>& color) noexcept {
    return color.r <= color.a && color.g <= color.a && color.b <= color.a;
}

std::string text(const glm::vec<4, std::uint8_t>& color) {
    return std::to_string(color.r) + ", " + std::to_string(color.g) + ", " +
           std::to_string(color.b) + ", " + std::to_string(color.a);
}

Result<void> check_splats(const FramePlan& plan) {
    for (std::size_t i = 0; i < plan.splats.size(); ++i) {
        const Splat& splat = plan.splats[i];
        if (is_finite(splat.center) && is_size(splat.side) && is_premultiplied(splat.color)) {
            continue;
        }
        const std::string name = "splat " + std::to_string(i);
        if (!is_finite(splat.center)) {
            return invalid(name + " has a centre that is not finite");
        }
        if (!is_size(splat.side)) {
            return invalid(name + " has sides of " + std::to_string(splat.side) + " m");
        }
        return invalid(name + " has the colour " + text(splat.color) + ", not premultiplied");
    }
    return {};
}

Result<void> check_cubes(const FramePlan& plan) {
    for (std::size_t i = 0; i < plan.cube_frames.size(); ++i) {
        const glm::mat3& frame = plan.cube_frames[i];
        if (!is_finite(frame[0]) || !is_finite(frame[1]) || !is_finite(frame[2])) {
            return invalid("cube frame " + std::to_string(i) + " is not finite");
        }
    }
    for (std::size_t i = 0; i < plan.cubes.size(); ++i) {
        const ShownCube& cube = plan.cubes[i];
        const bool valid = is_finite(cube.center) && is_size(cube.size.x) && is_size(cube.size.y) &&
                           is_size(cube.size.z) && cube.frame < plan.cube_frames.size() &&
                           std::all_of(cube.faces.begin(), cube.faces.end(), is_premultiplied);
        if (valid) {
            continue;
        }
        const std::string name = "cube " + std::to_string(i);
        if (!is_finite(cube.center)) {
            return invalid(name + " has a centre that is not finite");
        }
        if (!is_size(cube.size.x) || !is_size(cube.size.y) || !is_size(cube.size.z)) {
            return invalid(
                name + " has edges of " + std::to_string(cube.size.x) + ", " +
                std::to_string(cube.size.y) + " and " + std::to_string(cube.size.z) + " m"
            );
        }
        if (cube.frame >= plan.cube_frames.size()) {
            return invalid(
                name + " has frame " + std::to_string(cube.frame) + " of " +
                std::to_string(plan.cube_frames.size())
            );
        }
        for (const glm::vec<4, std::uint8_t>& face : cube.faces) {
            if (!is_premultiplied(face)) {
                return invalid(name + " has the colour " + text(face) + ", not premultiplied");
            }
        }
    }
    return {};
}

Result<void> check_selections(const FramePlan& plan) {
    for (std::size_t i = 0; i < plan.selections.size(); ++i) {
        const Selection& selection = plan.selections[i];
        if (!in_range(selection.first, selection.count, plan.selected.size())) {
            return invalid(
                "selection " + std::to_string(i) + ": primitives " +
                std::to_string(selection.first) + " to " +
                std::to_string(std::uint64_t{selection.first} + selection.count) + " of " +
                std::to_string(plan.selected.size()) + " selected"
            );
        }
    }
    return {};
}

Result<void> check_keyframes(const FramePlan& plan) {
    for (std::size_t i = 0; i < plan.keyframes.size(); ++i) {
        const Keyframe& keyframe = plan.keyframes[i];
        const auto refused = [&](const std::string& what) {
            return invalid("keyframe " + std::to_string(i) + ": " + what);
        };
        if (Result<void> valid = validate(keyframe.view); !valid) {
            return refused(valid.error().message);
        }
        const Region& source = keyframe.source;
        if (!possible(source) || source.width != keyframe.view.width ||
            source.height != keyframe.view.height) {
            return refused(
                "shows " + text(source) + " for a view of " + std::to_string(keyframe.view.width) +
                " x " + std::to_string(keyframe.view.height)
            );
        }
        const bool in_order = keyframe.copy_near >= 0.0F && keyframe.copy_near < keyframe.copy_far;
        if (!in_order || !std::isfinite(keyframe.copy_far)) {
            return refused(
                "keeps depths of " + std::to_string(keyframe.copy_near) + " to " +
                std::to_string(keyframe.copy_far) + " m"
            );
        }
        if (!is_size(keyframe.offset_m)) {
            return refused("is off by " + std::to_string(keyframe.offset_m) + " m");
        }
        if (!(keyframe.max_shift_px >= 0.0F)) {
            return refused("may be shifted by " + std::to_string(keyframe.max_shift_px) + " px");
        }
    }
    return {};
}

std::string image_name(LayeredImageId image) {
    return "layered image " + std::to_string(index_of(image));
}

Result<void> check_layered_updates(const FramePlan& plan) {
    for (std::size_t i = 0; i < plan.layered_updates.size(); ++i) {
        const LayeredUpdate& update = plan.layered_updates[i];
        const auto refused = [&](const std::string& what) {
            return invalid("layered update " + std::to_string(i) + " " + what);
        };
        if (update.action > LayeredUpdate::Action::destroy) {
            return refused(
                "has unknown action " + std::to_string(static_cast<unsigned>(update.action))
            );
        }
        if (update.image == kNone<LayeredImageId>) {
            return refused("names no image");
        }
        if (update.action == LayeredUpdate::Action::create && update.content == nullptr) {
            return refused("creates " + image_name(update.image) + " of nothing");
        }
    }
    return {};
}

Result<void> check_pass(const FramePlan& plan, std::size_t index) {
    const Pass& pass = plan.passes[index];
    const bool frame = pass.page == kNone<PageId>;
    const bool last = index + 1 == plan.passes.size();
    const auto refused = [&](const std::string& what) {
        return invalid(pass_name(index) + ": " + what);
    };
    if (frame != last) {
        return refused(
            frame ? "draws the frame, but " + std::to_string(plan.passes.size() - index - 1) +
                        " passes follow"
                  : "is the last and draws into page " + std::to_string(index_of(pass.page)) +
                        " instead of the frame"
        );
    }
    if (index > 0) {
        const Pass& before = plan.passes[index - 1];
        if (pass.batch < before.batch || (frame && pass.batch == before.batch)) {
            return refused(
                "batch " + std::to_string(pass.batch) + " after batch " +
                std::to_string(before.batch)
            );
        }
        if (pass.batch == before.batch && pass.page != before.page) {
            return refused(
                "page " + std::to_string(index_of(pass.page)) +
                " in a batch that draws into page " + std::to_string(index_of(before.page))
            );
        }
    }
    if (Result<void> valid = validate(pass.view); !valid) {
        return refused(valid.error().message);
    }
    if (!possible(pass.viewport) || pass.viewport.width != pass.view.width ||
        pass.viewport.height != pass.view.height) {
        return refused(
            "viewport of " + text(pass.viewport) + " for a view of " +
            std::to_string(pass.view.width) + " x " + std::to_string(pass.view.height)
        );
    }
    if (!possible(pass.scissor) || !contains(pass.viewport, pass.scissor)) {
        return refused(
            "scissor of " + text(pass.scissor) + " outside the viewport of " + text(pass.viewport)
        );
    }
    if (pass.copy_page != kNone<PageId>) {
        if (frame || pass.copy_page == pass.page) {
            return refused(
                std::string(frame ? "copies the frame" : "copies its own page") + " to page " +
                std::to_string(index_of(pass.copy_page))
            );
        }
        if (!possible(pass.copy) || pass.copy.width != pass.scissor.width ||
            pass.copy.height != pass.scissor.height) {
            return refused("copies " + text(pass.scissor) + " to " + text(pass.copy));
        }
    }
    if (!in_range(pass.first_command, pass.command_count, plan.commands.size())) {
        return refused(
            "commands " + std::to_string(pass.first_command) + " to " +
            std::to_string(std::uint64_t{pass.first_command} + pass.command_count) + " of " +
            std::to_string(plan.commands.size())
        );
    }
    for (std::uint32_t command = 0; command < pass.command_count; ++command) {
        const std::uint32_t place = pass.first_command + command;
        if (Result<void> valid = check_command(plan, index, place); !valid) {
            return valid;
        }
        if (plan.commands[place].kind == Command::Kind::projected) {
            if (Result<void> valid = check_finished(plan, index, place); !valid) {
                return valid;
            }
        }
    }
    return {};
}

} // namespace

Result<void> check_structure(const FramePlan& plan) {
    if (plan.passes.empty()) {
        return invalid("no passes, expected at least that of the frame");
    }
    for (int axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(plan.origin[axis])) {
            return invalid("origin is " + std::to_string(plan.origin[axis]));
        }
    }
    for (std::size_t pass = 0; pass < plan.passes.size(); ++pass) {
        if (Result<void> valid = check_pass(plan, pass); !valid) {
            return valid;
        }
    }
    if (Result<void> valid = check_selections(plan); !valid) {
        return valid;
    }
    if (Result<void> valid = check_splats(plan); !valid) {
        return valid;
    }
    if (Result<void> valid = check_cubes(plan); !valid) {
        return valid;
    }
    if (Result<void> valid = check_layered_updates(plan); !valid) {
        return valid;
    }
    return check_keyframes(plan);
}

Result<void> check_places(
    const FramePlan& plan,
    std::size_t index,
    const Region& frame,
    const PageFacts* page,
    const PageFacts* copy_page
) {
    const Pass& pass = plan.passes[index];
    const auto refused = [&](const std::string& what) {
        return invalid(pass_name(index) + ": " + what);
    };
    Region whole = frame;
    if (pass.page != kNone<PageId>) {
        if (page == nullptr || !page->scratch) {
            return refused(
                "draws into page " + std::to_string(index_of(pass.page)) +
                (page == nullptr ? ", which does not exist" : ", which is no scratch page")
            );
        }
        whole = {0, 0, page->size, page->size};
    }
    if (!contains(whole, pass.viewport)) {
        return refused("viewport of " + text(pass.viewport) + " outside of " + text(whole));
    }
    if (pass.copy_page == kNone<PageId>) {
        return {};
    }
    const std::string name = "page " + std::to_string(index_of(pass.copy_page));
    if (copy_page == nullptr || copy_page->scratch) {
        return refused(
            "copies to " + name +
            (copy_page == nullptr ? ", which does not exist" : ", a scratch page")
        );
    }
    if (!contains(Region{0, 0, copy_page->size, copy_page->size}, pass.copy)) {
        return refused(
            "copies to " + text(pass.copy) + " of " + name + " of " +
            std::to_string(copy_page->size) + " texels a side"
        );
    }
    const bool in_order = pass.copy_near >= 0.0F && pass.copy_near < pass.copy_far;
    if (copy_page->depth && !(in_order && std::isfinite(pass.copy_far))) {
        return refused(
            "copies depths of " + std::to_string(pass.copy_near) + " to " +
            std::to_string(pass.copy_far) + " m to " + name
        );
    }
    return {};
}

Result<void> check_image_page(
    const FramePlan& plan,
    std::size_t pass,
    std::uint32_t command,
    std::uint32_t quad,
    const PageFacts* page
) {
    const auto refused = [&](const char* why) {
        return invalid(
            pass_name(pass) + ", command " + std::to_string(command) + ": quad " +
            std::to_string(quad) + " shows page " +
            std::to_string(index_of(plan.quads[quad].page)) + ", " + why
        );
    };
    if (page == nullptr) {
        return refused("which does not exist");
    }
    if (page->scratch) {
        return refused("a scratch page");
    }
    if (plan.commands[command].depth == QuadDepth::texel && !page->depth) {
        return refused("which keeps no depth, with that of its texels");
    }
    return {};
}

Result<void> check_keyframe_page(
    const FramePlan& plan,
    std::size_t pass,
    std::uint32_t command,
    std::uint32_t keyframe,
    const PageFacts* page
) {
    const auto refused = [&](const std::string& why) {
        return invalid(
            pass_name(pass) + ", command " + std::to_string(command) + ": keyframe " +
            std::to_string(keyframe) + " shows page " +
            std::to_string(index_of(plan.keyframes[keyframe].page)) + ", " + why
        );
    };
    if (page == nullptr) {
        return refused("which does not exist");
    }
    if (page->scratch) {
        return refused("a scratch page");
    }
    if (!page->depth) {
        return refused("which keeps no depth");
    }
    const Region& source = plan.keyframes[keyframe].source;
    if (!contains(Region{0, 0, page->size, page->size}, source)) {
        return refused(text(source) + " of " + std::to_string(page->size) + " texels a side");
    }
    return {};
}

std::uint64_t page_bytes(const PageFacts& page, std::int32_t samples) noexcept {
    constexpr std::uint64_t kColor = 4;
    constexpr std::uint64_t kTexelDepth = 2;
    constexpr std::uint64_t kSampleDepth = 4;
    const auto side = static_cast<std::uint64_t>(page.size);
    const std::uint64_t texel = page.scratch
                                    ? (kColor + kSampleDepth) * static_cast<std::uint64_t>(samples)
                                    : kColor + (page.depth ? kTexelDepth : 0);
    return side * side * texel;
}

Result<void> check_page(const PageUpdate& update, std::int32_t largest, std::int32_t most_samples) {
    const std::string name = "page " + std::to_string(index_of(update.page));
    if (update.page == kNone<PageId>) {
        return invalid("makes a page without an id");
    }
    if (update.size < 1) {
        return invalid(name + " of " + std::to_string(update.size) + " texels a side");
    }
    if (update.samples < 1 || (!update.scratch && update.samples != 1)) {
        return invalid(
            name + " with " + std::to_string(update.samples) + " samples a texel, expected " +
            (update.scratch ? "at least 1" : "1, since it is no scratch page")
        );
    }
    if (update.scratch && update.depth) {
        return invalid(name + ", a scratch page, that keeps depth beside its texels");
    }
    if (update.size > largest) {
        return fail(
            ErrorCode::unsupported,
            "plan: " + name + " of " + std::to_string(update.size) +
                " texels a side, the device takes " + std::to_string(largest)
        );
    }
    if (update.samples > most_samples) {
        return fail(
            ErrorCode::unsupported,
            "plan: " + name + " with " + std::to_string(update.samples) +
                " samples a texel, the device takes " + std::to_string(most_samples)
        );
    }
    return {};
}

Result<void> check_layered_update(const LayeredUpdate& update) {
    if (update.action == LayeredUpdate::Action::destroy) {
        return {};
    }
    if (Result<void> valid = validate(*update.content); !valid) {
        return invalid(image_name(update.image) + ": " + valid.error().message);
    }
    return {};
}

Result<void> check_shown_layers(
    const FramePlan& plan, std::size_t pass, std::uint32_t command, std::uint32_t shown, bool exists
) {
    if (exists) {
        return {};
    }
    return invalid(
        pass_name(pass) + ", command " + std::to_string(command) + ": layers[" +
        std::to_string(shown) + "] shows " + image_name(plan.layers[shown].image) +
        ", which does not exist"
    );
}

std::uint64_t layered_bytes(const LayeredDepthImage& image) noexcept {
    return memory_bytes(image) - std::uint64_t{image.points.size()} * sizeof(PositionTexel);
}

Result<void> check_target(
    std::int32_t width, std::int32_t height, std::int32_t samples, std::int32_t most_samples
) {
    if (width < 1 || height < 1 || width > kMostPixels || height > kMostPixels) {
        return fail(
            ErrorCode::invalid_argument,
            "target of " + std::to_string(width) + " x " + std::to_string(height) +
                " pixels, expected 1 to " + std::to_string(kMostPixels) + " a side"
        );
    }
    if (samples < 1) {
        return fail(
            ErrorCode::invalid_argument,
            "target with " + std::to_string(samples) + " samples a pixel, expected at least 1"
        );
    }
    if (samples > most_samples) {
        return fail(
            ErrorCode::unsupported,
            "target with " + std::to_string(samples) + " samples a pixel, the device takes " +
                std::to_string(most_samples)
        );
    }
    return {};
}

} // namespace farfield::gpu
