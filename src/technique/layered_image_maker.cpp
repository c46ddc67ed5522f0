#include "technique/geometry_pass.hpp"
#include "technique/plan_writer.hpp"
#include <farfield/technique/layered_image_maker.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace farfield {

struct LayeredImageMaker::Impl {
    const Hierarchy* hierarchy = nullptr;
    const PlacementMap* map = nullptr;
    Backend* backend = nullptr;
    std::span<const glm::dmat4x3> item_frames;
    LayeredImageMakerOptions options;
    FramePlan plan;
    std::vector<ConstructionView> views;

    [[nodiscard]] View view_from(const PlacedImage& image, const glm::dvec3& eye) const noexcept;
    [[nodiscard]] Result<void> draw(const PlacedImage& image, ConstructionView& into);
};

/// A view from another eye around the cells of an image, turned as the image's own, with pixels as
/// large as its texels.
View LayeredImageMaker::Impl::view_from(const PlacedImage& image, const glm::dvec3& eye)
    const noexcept {
    View view = image.view;
    view.eye = eye;
    const double per_tangent_x = view.width / (view.lens.right - view.lens.left);
    const double per_tangent_y = view.height / (view.lens.top - view.lens.bottom);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    glm::dvec2 lo(kInfinity);
    glm::dvec2 hi(-kInfinity);
    double nearest = kInfinity;
    double farthest = 0.0;
    const glm::dmat3 to_camera = glm::transpose(view.camera_to_world);
    for (std::uint32_t i = 0; i < image.cell_count; ++i) {
        const Box3f& box = map->cells[map->replaced[image.first_cell + i]].box;
        for (unsigned c = 0; c < 8; ++c) {
            const glm::dvec3 at = to_camera * (map->origin + glm::dvec3(corner(box, c)) - eye);
            const glm::dvec2 tangents = glm::dvec2(at) / -at.z;
            lo = glm::min(lo, tangents);
            hi = glm::max(hi, tangents);
            nearest = std::min(nearest, -at.z);
            farthest = std::max(farthest, -at.z);
        }
    }
    const auto pixels = [](double tangents, double per_tangent) {
        return std::clamp(
            static_cast<std::int32_t>(std::ceil(tangents * per_tangent)), 1, kMostLayeredTexels
        );
    };
    view.width = pixels(hi.x - lo.x, per_tangent_x);
    view.height = pixels(hi.y - lo.y, per_tangent_y);
    // Whole pixels of the same size, unless that were too many.
    const double wide = std::max(hi.x - lo.x, view.width / per_tangent_x);
    const double high = std::max(hi.y - lo.y, view.height / per_tangent_y);
    const glm::dvec2 middle = 0.5 * (lo + hi);
    view.lens = {
        .left = middle.x - 0.5 * wide,
        .right = middle.x + 0.5 * wide,
        .bottom = middle.y - 0.5 * high,
        .top = middle.y + 0.5 * high,
        .near_distance = 0.5 * nearest,
        .far_distance = 2.0 * farthest};
    return view;
}

/// One picture of the cells of an image, and of nothing else.
Result<void> LayeredImageMaker::Impl::draw(const PlacedImage& image, ConstructionView& into) {
    clear(plan);
    plan.origin = hierarchy->origin;
    PlanWriter writer(plan, *hierarchy);
    writer.open();
    for (std::uint32_t i = 0; i < image.cell_count; ++i) {
        const PlacementCell& cell = map->cells[map->replaced[image.first_cell + i]];
        const HierarchyNode& node = hierarchy->nodes[cell.node];
        writer.items(node.first_item, node.item_count);
        writer.pieces(
            Command::Kind::geometry, node.first_piece, node.piece_count, Command::kNoClip
        );
    }
    writer.close(frame_pass(into.view, 0));
    const auto target = backend->create_target(into.view.width, into.view.height, 1);
    if (!target) {
        return tl::unexpected(target.error());
    }
    const auto read = [&]() -> Result<void> {
        Result<void> drawn = backend->execute(plan, *target, {true, glm::vec4(0.0F)});
        if (!drawn) {
            return drawn;
        }
        auto colors = backend->read_target(*target);
        if (!colors) {
            return tl::unexpected(std::move(colors).error());
        }
        auto positions = backend->read_positions(*target);
        if (!positions) {
            return tl::unexpected(std::move(positions).error());
        }
        into.colors = std::move(*colors);
        into.positions = std::move(*positions);
        return {};
    };
    Result<void> done = read();
    backend->destroy_target(*target);
    return done;
}

LayeredImageMaker::LayeredImageMaker(std::unique_ptr<Impl> impl) noexcept
    : impl_(std::move(impl)) {}
LayeredImageMaker::LayeredImageMaker(LayeredImageMaker&& other) noexcept = default;
LayeredImageMaker& LayeredImageMaker::operator=(LayeredImageMaker&& other) noexcept = default;
LayeredImageMaker::~LayeredImageMaker() = default;

Result<LayeredImageMaker> LayeredImageMaker::create(
    const Hierarchy& hierarchy,
    const PlacementMap& map,
    Backend& backend,
    std::span<const glm::dmat4x3> item_frames,
    const LayeredImageMakerOptions& options
) {
    if (options.views != 1 && options.views != 9) {
        return fail(
            ErrorCode::invalid_argument,
            "layered images: views is " + std::to_string(options.views) + ", expected 1 or 9"
        );
    }
    if (!backend.limits().positions) {
        return fail(
            ErrorCode::unsupported, "layered images: " + backend.device() + " keeps no positions"
        );
    }
    if (Result<void> valid = validate(map, hierarchy); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    auto impl = std::make_unique<Impl>();
    impl->hierarchy = &hierarchy;
    impl->map = &map;
    impl->backend = &backend;
    impl->item_frames = item_frames;
    impl->options = options;
    return LayeredImageMaker(std::move(impl));
}

Result<BuiltLayeredImage> LayeredImageMaker::make(std::uint32_t image) {
    Impl& impl = *impl_;
    if (image >= impl.map->images.size()) {
        return fail(
            ErrorCode::not_found,
            "layered images: image " + std::to_string(image) + " of " +
                std::to_string(impl.map->images.size())
        );
    }
    const PlacedImage& placed = impl.map->images[image];
    const Box3d& eyes = impl.map->sites[placed.site].eyes;
    impl.views.resize(impl.options.views);
    for (std::uint32_t i = 0; i < impl.options.views; ++i) {
        ConstructionView& view = impl.views[i];
        view.view = i == 0 ? placed.view : impl.view_from(placed, corner(eyes, i - 1));
        if (Result<void> drawn = impl.draw(placed, view); !drawn) {
            return tl::unexpected(std::move(drawn).error());
        }
    }
    return build_layered_image(placed.view, impl.views, impl.item_frames, impl.options.merging);
}

} // namespace farfield
