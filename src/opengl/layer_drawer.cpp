#include "opengl/layer_drawer.hpp"

#include <farfield/gpu/plan_rules.hpp>

#include <algorithm>
#include <utility>

namespace farfield::opengl {

LayerDrawer::LayerDrawer(const OpenGLBackendOptions& options) noexcept
    : positions_(options.positions), warps_(options.layers == LayerDrawing::warped),
      pictures_(options.executor) {}

LayerDrawer::~LayerDrawer() {
    for (Image& image : images_) {
        LayerPoints::destroy(image.buffers);
    }
}

LayerDrawer::Image* LayerDrawer::find(std::uint32_t cache, LayeredImageId image) noexcept {
    const auto found = std::find_if(images_.begin(), images_.end(), [&](const Image& of) {
        return of.cache == cache && of.id == image;
    });
    return found == images_.end() ? nullptr : &*found;
}

LayerOutput LayerDrawer::output(bool sampled) const noexcept {
    if (positions_) {
        return LayerOutput::positions;
    }
    return sampled ? LayerOutput::sampled_colors : LayerOutput::colors;
}

Result<void> LayerDrawer::update(std::uint32_t cache, const LayeredUpdate& update) {
    if (Result<void> valid = gpu::check_layered_update(update); !valid) {
        return valid;
    }
    if (Image* old = find(cache, update.image)) {
        LayerPoints::destroy(old->buffers);
        std::swap(*old, images_.back());
        images_.pop_back();
    }
    if (update.action == LayeredUpdate::Action::destroy) {
        return {};
    }
    const LayeredDepthImage& content = *update.content;
    Image image;
    image.cache = cache;
    image.id = update.image;
    image.bytes = gpu::layered_bytes(content);
    image.position_bytes = positions_ ? memory_bytes(content) - image.bytes : 0;
    if (warps_) {
        image.content = content;
        if (!positions_) {
            image.content.points = {};
        }
    } else {
        image.content.view = content.view;
        image.content.near_depth = content.near_depth;
        image.content.far_depth = content.far_depth;
        Result<LayerPoints::Buffers> uploaded = LayerPoints::upload(content, positions_);
        if (!uploaded) {
            return tl::unexpected(std::move(uploaded).error());
        }
        image.buffers = *uploaded;
    }
    images_.push_back(std::move(image));
    return {};
}

Result<void> LayerDrawer::require(bool sampled) {
    return warps_ ? pictures_.require(output(sampled)) : points_.require(output(sampled));
}

void LayerDrawer::draw(
    const FramePlan& plan,
    const Pass& pass,
    const Command& command,
    std::span<const glm::dvec2> places
) {
    const LayerOutput output = this->output(places.size() > 1);
    for (const ShownLayers& shown : std::span(plan.layers).subspan(command.first, command.count)) {
        const Image& image = *find(plan.cache, shown.image);
        if (warps_) {
            pictures_.draw(image.content, shown.node, pass, places, output);
        } else {
            points_.draw(image.content, image.buffers, shown.node, pass, places, output);
        }
    }
}

std::uint64_t LayerDrawer::bytes() const noexcept {
    std::uint64_t bytes = 0;
    for (const Image& image : images_) {
        bytes += image.bytes;
    }
    return bytes;
}

std::uint64_t LayerDrawer::position_bytes() const noexcept {
    std::uint64_t bytes = 0;
    for (const Image& image : images_) {
        bytes += image.position_bytes;
    }
    return bytes;
}

} // namespace farfield::opengl
