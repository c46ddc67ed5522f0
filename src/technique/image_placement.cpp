#include "technique/geometry_pass.hpp"
#include "technique/plan_writer.hpp"
#include <farfield/math/frustum.hpp>
#include <farfield/technique/image_placement.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace farfield {

namespace {

constexpr std::uint32_t kNoImage = UINT32_MAX;
constexpr std::uint32_t kNoCell = UINT32_MAX;
/// Images that are asked for at a time: the one that is needed, those ahead, and those of the
/// ranges of yaw on both sides.
constexpr std::size_t kMostWanted = 8;

/// A layered image of the backend.
struct Slot {
    std::uint32_t image = kNoImage;
    std::uint64_t used_frame = 0;
};

/// What culls: the view itself, and the level view around it that images were placed for. Of two
/// views one inside the other, planes of the inner one alone may let through a box beside both.
struct Culling {
    Frustum view;
    Frustum around;
    bool served = false;

    [[nodiscard]] bool sees(const Box3f& box) const noexcept {
        return classify(view, box) != Overlap::outside &&
               (!served || classify(around, box) != Overlap::outside);
    }
};

} // namespace

struct ImagePlacement::Impl {
    const Hierarchy* hierarchy = nullptr;
    const PlacementMap* map = nullptr;
    LayeredImageSource* images = nullptr;
    ImagePlacementOptions options;
    std::vector<std::uint32_t> cell_at; ///< by node: the cell that it is, or none
    std::vector<Slot> slots;            ///< by `LayeredImageId`
    std::uint32_t replaced_by = kNoImage;
    std::vector<bool> replaced; ///< cells, by the image `replaced_by`
    std::uint64_t frame_number = 0;
    bool forgotten = false;
    FramePlan plan;
    ImagePlacementStatistics statistics;

    void want(const PlacedView& found, const View& view, const Motion& motion) noexcept;
    [[nodiscard]] std::uint32_t choose(const PlacedView& found, const Culling& culling) noexcept;
    [[nodiscard]] std::uint64_t left_with(std::uint32_t image, const Culling& culling) noexcept;
    void replace(std::uint32_t image) noexcept;
    void write_cells(const Culling& culling, const glm::vec3& eye, PlanWriter& writer) noexcept;
    void show(std::uint32_t image) noexcept;
    void make(const View& view, const Motion& motion) noexcept;

    std::array<std::uint32_t, kMostWanted> wanted{};
};

namespace {

/// Appends an image that is not there yet.
void append(
    std::array<std::uint32_t, kMostWanted>& list, std::size_t& count, std::uint32_t image
) noexcept {
    const auto end = list.begin() + static_cast<std::ptrdiff_t>(count);
    if (image != kNoImage && count < list.size() && std::find(list.begin(), end, image) == end) {
        list[count++] = image;
    }
}

} // namespace

/// Asks for the image of this view, of those ahead, and of those beside it.
void ImagePlacement::Impl::want(
    const PlacedView& found, const View& view, const Motion& motion
) noexcept {
    std::size_t count = 0;
    const auto add_range = [&](std::uint32_t range) {
        append(wanted, count, map->ranges[range].image);
    };
    if (found.refusal == PlacementRefusal::none) {
        add_range(found.range);
    }
    View then = view;
    for (const std::uint32_t frames : {options.prefetch_frames / 2, options.prefetch_frames}) {
        const double t = frames * motion.frame_seconds;
        then.eye = view.eye + motion.velocity * t;
        const PlacedView ahead = find(*map, then);
        if (ahead.refusal == PlacementRefusal::none) {
            add_range(ahead.range);
        }
    }
    if (found.refusal == PlacementRefusal::none) {
        const PlacementSite& site = map->sites[found.site];
        const std::uint32_t place = found.range - site.first_range;
        add_range(site.first_range + (place + 1) % site.range_count);
        add_range(site.first_range + (place + site.range_count - 1) % site.range_count);
    }
    images->want({wanted.data(), count});
}

/// Marks the cells of an image.
void ImagePlacement::Impl::replace(std::uint32_t image) noexcept {
    if (replaced_by == image) {
        return;
    }
    const auto mark = [&](std::uint32_t which, bool value) {
        if (which != kNoImage) {
            const PlacedImage& placed = map->images[which];
            for (std::uint32_t i = 0; i < placed.cell_count; ++i) {
                replaced[map->replaced[placed.first_cell + i]] = value;
            }
        }
    };
    mark(replaced_by, false);
    mark(image, true);
    replaced_by = image;
}

/// Primitives of a frame that shows an image.
std::uint64_t
ImagePlacement::Impl::left_with(std::uint32_t image, const Culling& culling) noexcept {
    replace(image);
    std::uint64_t left = 0;
    for (std::size_t i = 0; i < map->cells.size(); ++i) {
        if (!replaced[i] && culling.sees(map->cells[i].box)) {
            left += map->cells[i].primitives;
        }
    }
    return left;
}

/// The image that belongs to the view; where it is not in memory, the one of the site that leaves
/// least, or none where none leaves less than all.
std::uint32_t
ImagePlacement::Impl::choose(const PlacedView& found, const Culling& culling) noexcept {
    const std::uint32_t right = map->ranges[found.range].image;
    if (right == kNoImage || images->find(right) != nullptr) {
        return right;
    }
    statistics.missed = true;
    const PlacementSite& site = map->sites[found.site];
    std::uint32_t best = kNoImage;
    std::uint64_t least = left_with(kNoImage, culling);
    std::uint32_t before = kNoImage;
    for (std::uint32_t i = 0; i < site.range_count; ++i) {
        const std::uint32_t image = map->ranges[site.first_range + i].image;
        if (image == kNoImage || image == before || images->find(image) == nullptr) {
            continue;
        }
        before = image;
        const std::uint64_t left = left_with(image, culling);
        if (left < least) {
            least = left;
            best = image;
        }
    }
    return best;
}

void ImagePlacement::Impl::write_cells(
    const Culling& culling, const glm::vec3& eye, PlanWriter& writer
) noexcept {
    // Depth first, nearer children first. Deeper than trees are.
    std::array<std::uint32_t, 128> stack{};
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const std::uint32_t index = stack[--depth];
        const HierarchyNode& node = hierarchy->nodes[index];
        const std::uint32_t cell = cell_at[index];
        if (cell != kNoCell) {
            if (!replaced[cell] && culling.sees(map->cells[cell].box)) {
                writer.items(node.first_item, node.item_count);
                writer.pieces(
                    Command::Kind::geometry, node.first_piece, node.piece_count, Command::kNoClip
                );
                statistics.primitives += map->cells[cell].primitives;
                ++statistics.cells;
            }
            continue;
        }
        const Box3f box = unite(node.items_box, whole_pieces_box(*hierarchy, index));
        if (is_leaf(node) || is_empty(box) || !culling.sees(box)) {
            continue;
        }
        const unsigned far = far_child(node, eye);
        stack[depth++] = node.first_child + far;
        stack[depth++] = node.first_child + 1U - far;
    }
}

/// Hands an image over unless the backend has it, and draws it.
void ImagePlacement::Impl::show(std::uint32_t image) noexcept {
    auto slot =
        std::find_if(slots.begin(), slots.end(), [&](const Slot& s) { return s.image == image; });
    const LayeredDepthImage* const content = images->find(image);
    statistics.samples = content->samples.size();
    if (slot == slots.end()) {
        slot = std::min_element(slots.begin(), slots.end(), [](const Slot& a, const Slot& b) {
            return a.used_frame < b.used_frame;
        });
        slot->image = image;
        LayeredUpdate update;
        update.image = make_id<LayeredImageId>(static_cast<std::size_t>(slot - slots.begin()));
        update.content = content;
        plan.layered_updates.push_back(update);
        statistics.handed_over = true;
    }
    slot->used_frame = frame_number;
    Command command;
    command.kind = Command::Kind::layers;
    command.first = static_cast<std::uint32_t>(plan.layers.size());
    command.count = 1;
    plan.layers.push_back(
        {make_id<LayeredImageId>(static_cast<std::size_t>(slot - slots.begin())), 0}
    );
    plan.commands.push_back(command);
}

void ImagePlacement::Impl::make(const View& view, const Motion& motion) noexcept {
    clear(plan);
    plan.origin = hierarchy->origin;
    statistics = {};
    ++frame_number;
    if (forgotten) {
        for (std::size_t i = 0; i < slots.size(); ++i) {
            plan.layered_updates.push_back(
                {LayeredUpdate::Action::destroy, make_id<LayeredImageId>(i), nullptr}
            );
            slots[i] = {};
        }
        forgotten = false;
    }
    const PlacedView found = find(*map, view);
    statistics.refusal = found.refusal;
    statistics.site = found.site;
    want(found, view, motion);

    Culling culling;
    culling.view = make_frustum(view, hierarchy->origin);
    culling.served = found.refusal == PlacementRefusal::none;
    if (culling.served) {
        culling.around = make_frustum(found.around, hierarchy->origin);
        statistics.image = choose(found, culling);
    }
    replace(statistics.image);
    PlanWriter writer(plan, *hierarchy);
    writer.open();
    write_cells(culling, local_point(view.eye, hierarchy->origin), writer);
    write_moving(*hierarchy, culling.view, writer);
    if (statistics.image != kNoImage) {
        show(statistics.image);
    }
    writer.close(frame_pass(view, 0));
}

ImagePlacement::ImagePlacement(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
ImagePlacement::ImagePlacement(ImagePlacement&& other) noexcept = default;
ImagePlacement& ImagePlacement::operator=(ImagePlacement&& other) noexcept = default;
ImagePlacement::~ImagePlacement() = default;

Result<ImagePlacement> ImagePlacement::create(
    const Hierarchy& hierarchy,
    const PlacementMap& map,
    LayeredImageSource& images,
    const ImagePlacementOptions& options
) {
    if (options.resident_images < 1 || options.resident_images > 64) {
        return fail(
            ErrorCode::invalid_argument,
            "image placement: resident_images is " + std::to_string(options.resident_images) +
                ", expected 1 to 64"
        );
    }
    if (options.prefetch_frames > 1000) {
        return fail(
            ErrorCode::invalid_argument,
            "image placement: prefetch_frames is " + std::to_string(options.prefetch_frames) +
                ", expected 0 to 1000"
        );
    }
    if (Result<void> valid = validate(map, hierarchy); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    auto impl = std::make_unique<Impl>();
    impl->hierarchy = &hierarchy;
    impl->map = &map;
    impl->images = &images;
    impl->options = options;
    impl->cell_at.assign(hierarchy.nodes.size(), kNoCell);
    for (std::size_t i = 0; i < map.cells.size(); ++i) {
        impl->cell_at[map.cells[i].node] = static_cast<std::uint32_t>(i);
    }
    impl->replaced.assign(map.cells.size(), false);
    impl->slots.resize(options.resident_images);
    return ImagePlacement(std::move(impl));
}

const FramePlan& ImagePlacement::plan(const View& view, const Motion& motion) noexcept {
    impl_->make(view, motion);
    return impl_->plan;
}

void ImagePlacement::forget_images() noexcept {
    impl_->forgotten = true;
}

const ImagePlacementStatistics& ImagePlacement::statistics() const noexcept {
    return impl_->statistics;
}

} // namespace farfield
